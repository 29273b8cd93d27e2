"""`treepilot parameters`: every parameter in force, with the file and line that sets it."""

from __future__ import annotations

from missions.execution.prepare import RunOptions, prepare
from missions.execution.records.origins import Origin, origins_of
from stack.columns import columns
from stack.errors import InputError
from stack.parameters import did_you_mean, nearest


def parameters_of(mission: str, options: RunOptions | None = None) -> list[Origin]:
    """Return every parameter of a mission's navigation and localisation.

    Raises:
        InputError: the mission or a file it names has errors.
    """
    options = options or RunOptions()
    return origins_of(prepare(mission, options), options.parameters or {})


def for_users(origins: list[Origin], wanted: str) -> list[Origin]:
    """Return the public parameters, those that are set, and those whose whole name is wanted."""
    return [
        item
        for item in origins
        if item.public or item.is_set or wanted in (item.name, item.name.partition(".")[2])
    ]


def filtered(origins: list[Origin], wanted: str) -> list[Origin]:
    """Return the parameters of one kind, or else those whose names contain a text.

    Args:
        origins: of a mission.
        wanted: a kind such as `safety`, or a part of a name; empty: all.

    Raises:
        InputError: no parameter of the mission has such a name.
    """
    kinds = {item.name.partition(".")[0] for item in origins}
    if wanted in kinds:
        return [item for item in origins if item.name.startswith(f"{wanted}.")]
    found = [item for item in origins if wanted.lower() in item.name]
    if not found:
        names = {part for item in origins for part in (item.name, item.name.partition(".")[2])}
        close = nearest(wanted, sorted(kinds | names))
        hint = did_you_mean(close) if close else f"kinds: {', '.join(sorted(kinds))}"
        raise InputError(f"no parameter of the mission has {wanted!r} in its name; {hint}")
    return found


def lines_of(origins: list[Origin]) -> list[str]:
    """Return a table: name, value, source, description."""
    return columns([(item.name, item.value, item.source, item.help) for item in origins])
