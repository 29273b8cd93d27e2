"""What came of a parameter file of Nav2: for the mission, for people, and as a file of ours."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from missions.language.model import Component
from missions.nav2.reading import Nav2Settings
from missions.nav2.reasons import NO_EQUIVALENT
from stack.documents import Finding, Mark, as_yaml

CODE = "W110"
MANY = 6
"""Names after which a warning counts the rest."""


def components_of(settings: Nav2Settings) -> dict[str, Component]:
    """The choices by kind, as if they stood in the mission, with their places in Nav2's file."""
    nowhere = Mark("nav2_params")
    found = {}
    for kind, chosen in settings.kinds.items():
        mark = chosen.use_mark or next(iter(chosen.marks.values()), nowhere)
        found[kind] = Component(kind, chosen.use, mark, chosen.values, chosen.marks)
    return found


def warnings_of(settings: Nav2Settings) -> tuple[Finding, ...]:
    """A warning a server about what has no effect; what need not be said here is left out."""
    by_server: dict[str, list[tuple[str, Mark]]] = {}
    for item in settings.left:
        if item.why == NO_EQUIVALENT:
            server, _, name = item.path.partition(".")
            by_server.setdefault(server, []).append((name, item.mark))
    return tuple(_warning(server, items) for server, items in by_server.items())


def _warning(server: str, items: list[tuple[str, Mark]]) -> Finding:
    names = ", ".join(name for name, _ in items[:MANY])
    more = f" and {len(items) - MANY} more" if len(items) > MANY else ""
    hint = "`treepilot nav2 FILE` lists everything"
    return Finding(items[0][1], CODE, f"{server}: no equivalent for {names}{more}", hint, "warning")


def lines_of(settings: Nav2Settings) -> Iterator[str]:
    """Both lists for people: what is taken over and as what, what is not and why."""
    yield f"Taken over: {len(settings.taken)}"
    for item in settings.taken:
        ours = f"{item.kind}.{item.name} = {_short(item.value)}"
        yield f"  {item.mark.line:>5}  {item.path}  ->  {ours}"
    yield f"Not taken over: {len(settings.left)}"
    for left in settings.left:
        yield f"  {left.mark.line:>5}  {left.path}  ({left.why})"


def parameter_file(settings: Nav2Settings, source: str) -> str:
    """The same as a parameter file of ours, to be named under `parameters` or pasted."""
    section: dict[str, Any] = {
        kind: {**({"use": chosen.use} if chosen.use else {}), **chosen.values}
        for kind, chosen in settings.kinds.items()
    }
    return f"# From {source}, by `treepilot nav2`.\n{as_yaml(section)}"


def _short(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
