"""Every parameter in force, with its default and the file and line that sets it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from missions.execution.component_choices import (
    LISTS,
    MAPLESS_DEFAULTS,
    default_of,
    mark_of_robot,
    settings_of,
)
from missions.execution.fit.faults import component_parameters
from missions.execution.prepare import PreparedMission
from missions.language.model import Component
from stack.components import Choice
from stack.costmap.choosing import LayerChoice
from stack.costmap.parameters import CostmapParameters
from stack.documents import Mark
from stack.parameters import REQUIRED, Declaration, declarations, values_of

DEFAULT, COMMAND_LINE, NONE = "default", "--parameter", "none"


@dataclass(frozen=True, slots=True)
class Origin:
    """One parameter in force and its source.

    Attributes:
        name: `controller.cruise_speed`.
        value: the value with its unit.
        default: that of the component, or of missions without a map; empty if there is none.
        source: `default`, `--parameter`, or the file that sets it, with the line if known.
        help: one-line description.
        public: whether users may need it; the others are for experts.
        is_set: whether a file or the command line sets it.
    """

    name: str
    value: str
    default: str
    source: str
    help: str
    public: bool = True
    is_set: bool = False


def origins_of(plan: PreparedMission, given: Mapping[str, str]) -> list[Origin]:
    """Return every parameter of a mission's navigation and localisation.

    Args:
        plan: the prepared mission.
        given: parameters of the command line, by full name.
    """
    given = component_parameters(given)
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


def _of(plan: PreparedMission, kind: str, choice: Choice, settings: Component) -> Iterator[Origin]:
    usual = {} if plan.is_mapped else MAPLESS_DEFAULTS.get(kind, {})
    if choice.name != kind:
        source, is_set = _source(plan, kind, "use", settings.mark)
        default = default_of(kind, mapped=plan.is_mapped)
        yield Origin(f"{kind}.use", choice.name, default, source, "chosen component", is_set=is_set)
    values = values_of(choice.parameters)
    for name, declared in declarations(cast("type", type(choice.parameters))).items():
        source, is_set = _source(plan, kind, name, settings.marks.get(name))
        default = usual.get(name, declared.default)
        yield _origin(kind, declared, values[name], default, source, is_set=is_set)
    if kind in LISTS:
        key, meaning = LISTS[kind].key, LISTS[kind].help
        source, is_set = _source(plan, kind, key, settings.marks.get(key))
        names = ", ".join(part.name for part in choice.parts) or NONE
        default = "" if is_set else names  # that of the costmap depends on the sensors
        yield Origin(f"{kind}.{key}", names, default, source, meaning, is_set=is_set)
        yield from _of_layers(choice.parts, source, is_set=is_set)


def _of_layers(parts: Iterable[Any], source: str, *, is_set: bool) -> Iterator[Origin]:
    """Yield the parameters that a costmap's list sets for its layers; zones have none."""
    for layer in parts:
        if not isinstance(layer, LayerChoice):
            continue
        declared = declarations(layer.component.Parameters)
        values = values_of(layer.parameters(CostmapParameters()))
        for name in layer.values:
            item = declared[name]
            yield _origin(layer.name, item, values[name], item.default, source, is_set=is_set)


def _origin(  # noqa: PLR0913 - the fields of the record
    owner: str, declared: Declaration, value: Any, default: Any, source: str, *, is_set: bool
) -> Origin:
    return Origin(
        f"{owner}.{declared.name}", _shown(declared, value), _shown(declared, default), source,
        declared.help, declared.public, is_set,
    )  # fmt: skip


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
    if value is REQUIRED:
        return ""
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or NONE
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {declared.unit}" if declared.unit else text
