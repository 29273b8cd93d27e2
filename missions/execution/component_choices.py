"""Components and settings under `navigation`, chosen by name and checked.

`planner` and `controller` are components, replaceable by plugin; `costmap`, `navigator`, `safety`
and `tracker` are settings of parts that there is one of. A costmap's `layers` and the safety
stage's `zones` are lists, read by those who use them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from stack.components import Choice, choose
from stack.costmap.choosing import read_layers, usual_layers
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.navigation.parameters import NavigationParameters
from stack.parameters import build, suggestion
from stack.perception.tracker_parameters import TrackerParameters
from stack.safety.parameters import SafetyParameters
from stack.safety.zones import read_zones

DEFAULTS = {"planner": "astar", "controller": "pure_pursuit"}
SETTINGS: dict[str, type] = {
    "costmap": CostmapParameters,
    "navigator": NavigationParameters,
    "safety": SafetyParameters,
    "tracker": TrackerParameters,
}
WITHOUT_A_MAP = {"costmap": {"obstacle_range": 8.0, "clearing_range": 9.0, "decay": 300.0}}
"""Defaults where what is sensed is all the map there is: it reaches farther and is kept longer, or
a robot that left a dead end would plan back into it."""

PARTS: dict[str, tuple[str, Callable[[Any, Any], tuple[Any, ...]]]] = {
    "costmap": ("layers", read_layers),
    "safety": ("zones", read_zones),
}


def chosen(kind: str, wanted: Mapping[str, Any]) -> Choice:
    """The component or settings of a kind: `{"use": name, parameter: value}`.

    Raises:
        InputError: no such kind or component.
        ParameterError: an unknown parameter or a value that will not do.
    """
    values = {key: value for key, value in wanted.items() if key != "use"}
    if kind in SETTINGS:
        if "use" in wanted:
            raise ParameterError("use", f"{kind} has settings but no alternatives to choose from")
        return _settings(kind, values)
    if kind not in DEFAULTS:
        raise InputError(f"navigation has no {kind!r}; {suggestion(kind, [*DEFAULTS, *SETTINGS])}")
    return choose(kind, wanted.get("use", DEFAULTS[kind]), values)


def all_chosen(
    robot: RobotDescription,
    mission: Mapping[str, tuple[str | None, Mapping[str, Any]]],
    *,
    mapped: bool = True,
) -> dict[str, Choice]:
    """Every kind: defaults, under the robot's own settings, under the mission's.

    A layer that names another component drops the parameters below it: they mean nothing to it.

    Args:
        robot: whose settings hold where the mission says nothing.
        mission: kind -> name and parameters.
        mapped: whether there is a map; without one other defaults hold.
    """
    choices = {}
    for kind in (*DEFAULTS, *SETTINGS):
        wanted: dict[str, Any] = {} if mapped else dict(WITHOUT_A_MAP.get(kind, {}))
        use, values = mission.get(kind, (None, {}))
        layers = (robot.navigation.get(kind) or {}, {**values, **({"use": use} if use else {})})
        for layer in layers:
            before = wanted.get("use", DEFAULTS.get(kind))
            if layer.get("use", before) != before:
                wanted = {}
            wanted.update(layer)
        choices[kind] = chosen(kind, wanted)
    return choices


def _settings(kind: str, values: dict[str, Any]) -> Choice:
    """Settings of a part, and the parts of that, if it has any."""
    key, read = PARTS.get(kind, ("", None))
    listed = values.pop(key, None)
    parameters: Any = build(SETTINGS[kind], values)
    if read is None or listed is None:
        return Choice(kind, kind, SETTINGS[kind], parameters, _usual(kind))
    return Choice(kind, kind, SETTINGS[kind], parameters, read(listed, parameters))


def _usual(kind: str) -> tuple[Any, ...]:
    return usual_layers() if kind == "costmap" else ()
