"""`treepilot parameters`: every parameter in force, with the file and line that sets it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from missions.execution.component_choices import MAPLESS_DEFAULTS, mark_of_robot, settings_of
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.inspection.parameter_descriptions import LISTS
from missions.language.model import Component
from stack.columns import columns
from stack.components import Choice
from stack.costmap.choosing import LayerChoice
from stack.costmap.parameters import CostmapParameters
from stack.documents import Mark
from stack.errors import InputError
from stack.parameters import Declaration, declarations, did_you_mean, nearest, values_of

DEFAULT, COMMAND_LINE = "default", "--parameter"


@dataclass(frozen=True, slots=True)
class Origin:
    """One parameter in force and its source.

    Attributes:
        name: `controller.cruise_speed`.
        value: the value with its unit.
        source: `default`, `--parameter`, or the file that sets it, with the line if known.
        help: one-line description.
        public: whether users may need it; the others are for experts.
        is_set: whether a file or the command line sets it.
    """

    name: str
    value: str
    source: str
    help: str
    public: bool = True
    is_set: bool = False


def parameters_of(mission: str, options: RunOptions | None = None) -> list[Origin]:
    """Return every parameter of a mission's navigation and localisation.

    Raises:
        InputError: the mission or a file it names has errors.
    """
    options = options or RunOptions()
    plan = prepare(mission, options)
    given = options.parameters or {}
    settings = settings_of(plan.mission, plan.robot, given)
    found = [
        origin
        for kind, choice in plan.choices.items()
        for origin in _of(plan, kind, choice, settings[kind])
    ]
    return [
        replace(item, source=COMMAND_LINE, is_set=True) if item.name in given else item
        for item in found
    ]


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


def _of(plan: PreparedMission, kind: str, choice: Choice, settings: Component) -> Iterator[Origin]:
    if choice.name != kind:
        source, is_set = _source(plan, kind, "use", settings.mark)
        yield Origin(f"{kind}.use", choice.name, source, "chosen component", is_set=is_set)
    values = values_of(choice.parameters)
    for name, declared in declarations(cast("type", type(choice.parameters))).items():
        source, is_set = _source(plan, kind, name, settings.marks.get(name))
        value = _shown(declared, values[name])
        yield Origin(f"{kind}.{name}", value, source, declared.help, declared.public, is_set)
    if kind in LISTS:
        source, is_set = _source(plan, kind, LISTS[kind].key, settings.marks.get(LISTS[kind].key))
        names = ", ".join(part.name for part in choice.parts) or "none"
        yield Origin(f"{kind}.{LISTS[kind].key}", names, source, LISTS[kind].help, is_set=is_set)
        yield from _of_layers(choice.parts, source, is_set=is_set)


def _of_layers(parts: Iterable[Any], source: str, *, is_set: bool) -> Iterator[Origin]:
    """Yield the parameters that a costmap's list sets for its layers; zones have none."""
    for layer in parts:
        if not isinstance(layer, LayerChoice):
            continue
        declared = declarations(layer.component.Parameters)
        values = values_of(layer.parameters(CostmapParameters()))
        for name in layer.values:
            item, value = declared[name], _shown(declared[name], values[name])
            yield Origin(f"{layer.name}.{name}", value, source, item.help, item.public, is_set)


def _source(plan: PreparedMission, kind: str, name: str, mark: Mark | None) -> tuple[str, bool]:
    """Return the file and line of a setting, and whether there is one: defaults have no file."""
    if mark is None or not mark.file:
        return _default_of(plan, kind, name), False
    file = _short(plan, mark.file)
    return (file if mark == mark_of_robot(plan.robot) else f"{file}:{mark.line}"), True


def _default_of(plan: PreparedMission, kind: str, name: str) -> str:
    """Return `default`, or that the default is one of missions without a map."""
    mapless = not plan.is_mapped and name in MAPLESS_DEFAULTS.get(kind, {})
    return f"{DEFAULT} without a map" if mapless else DEFAULT


def _short(plan: PreparedMission, file: str) -> str:
    """Return the file's name, with its folder if that is not the mission's."""
    path = Path(file)
    if path.parent == plan.mission.source.parent:
        return path.name
    return f"{path.parent.name}/{path.name}"


def _shown(declared: Declaration, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {declared.unit}" if declared.unit else text
