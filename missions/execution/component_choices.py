"""Components and settings of navigation and localisation: chosen by name, checked.

The kinds of `DEFAULTS` are components and can come from a plugin; those of `SETTINGS` are settings
of fixed parts. The costmap reads its own list of `layers`, the safety stage its own list of
`zones`. `localisation` and `odometry` are keys of the mission beside `navigation`; all others stand
under `navigation`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from missions.language.component_layers import layered
from missions.language.model import Component, Mission
from missions.language.reading.header import TOP_COMPONENTS
from stack.components import DEFAULTS, Choice, Estimator, accepted, choose
from stack.control.evasion.parameters import EvasionParameters
from stack.costmap.choosing import (
    for_lidars,
    read_layers,
    sensing_layers,
    usual_layers,
    with_sensors,
)
from stack.costmap.parameters import CostmapParameters
from stack.costmap.speed_limits import SpeedLimitParameters
from stack.documents import Findings, Mark, value_of
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.navigation.parameters import NavigationParameters
from stack.parameters import build, suggestion
from stack.perception.cameras.parameters import CameraParameters
from stack.perception.colour_parameters import ColourParameters
from stack.perception.depth.parameters import DepthParameters
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.objects.parameters import ObjectDetectorParameters
from stack.perception.obstacle_memory import ObstacleMemoryParameters
from stack.perception.places.parameters import PlaceParameters
from stack.perception.tracking.parameters import TrackerParameters
from stack.runtime.failsafe_parameters import FailsafeParameters
from stack.runtime.parameters import LoopParameters
from stack.safety.parameters import SafetyParameters
from stack.safety.zones import SafetyZone, read_safety_zones
from stack.telemetry.recording_parameters import RecordingParameters

SETTINGS: dict[str, type] = {
    "costmap": CostmapParameters,
    "speed_limits": SpeedLimitParameters,
    "navigator": NavigationParameters,
    "evasion": EvasionParameters,
    "safety": SafetyParameters,
    "failsafe": FailsafeParameters,
    "tracker": TrackerParameters,
    "depth": DepthParameters,
    "cameras": CameraParameters,
    "coloured_objects": ColourParameters,
    "object_detector": ObjectDetectorParameters,
    "markers": MarkerParameters,
    "place_recognition": PlaceParameters,
    "obstacle_memory": ObstacleMemoryParameters,
    "loop": LoopParameters,
    "recording": RecordingParameters,
}
DRIVING_KINDS = frozenset(
    (
        *DEFAULTS,
        "costmap",
        "speed_limits",
        "navigator",
        "evasion",
        "safety",
        "tracker",
        "obstacle_memory",
    )
)
"""The kinds without effect on a robot that cannot drive."""

NAVIGATION_KINDS = tuple(kind for kind in (*DEFAULTS, *SETTINGS) if kind not in TOP_COMPONENTS)
"""The keys under `navigation`."""

MAPLESS_DEFAULTS: dict[str, dict[str, Any]] = {
    "localisation": {"use": "dead_reckoning"},
    "costmap": {"obstacle_range": 8.0, "clearing_range": 9.0, "decay": 300.0},
}
"""Defaults without a map. Sensed obstacles reach farther and are kept longer than with a map;
otherwise a robot that left a dead end would plan back into it."""


@dataclass(frozen=True, slots=True)
class ListSetting:
    """A list that belongs to the settings of a part but is no parameter.

    Attributes:
        key: as written in files.
        help: one sentence.
        example: of a mission.
        read: returns the entries of what a file says, with the parameters of the part.
        usual: returns the default.
        item: the dataclass of an entry; None if entries are components.
    """

    key: str
    help: str
    example: str
    read: Callable[[Any, Any], tuple[Any, ...]]
    usual: Callable[[], tuple[Any, ...]]
    item: type | None = None


LISTS = {
    "safety": ListSetting(
        "zones",
        "polygons or circles around the robot in which an obstacle stops, slows or limits it",
        "navigation: {safety: {zones: [{action: slow_down, radius: 0.6 m, ratio: 0.5}]}}",
        read_safety_zones,
        tuple,
        SafetyZone,
    ),
    "costmap": ListSetting(
        "layers",
        "what marks cells, in this order; `treepilot list layers` shows the layers",
        "navigation: {costmap: {layers: [static, sensors, {use: social, horizon: 3 s}]}}",
        read_layers,
        usual_layers,
    ),
}
"""Settings of a fixed part -> its list."""


def chosen(kind: str, use: str | None, values: Mapping[str, Any], *, mapped: bool = True) -> Choice:
    """Return the component or settings that `{use: name, parameter: value}` chooses.

    Args:
        kind: e.g. planner.
        use: name of the component; None: the default.
        values: raw parameters.
        mapped: whether there is a map; the default estimator depends on it.

    Raises:
        InputError: unknown kind or component.
        ParameterError: unknown parameter or invalid value, or an estimator that needs a map.
    """
    if kind in SETTINGS:
        if use is not None:
            raise ParameterError("use", f"{kind} has settings only; remove `use`")
        return _settings(kind, values)
    if kind not in DEFAULTS:
        raise InputError(f"navigation has no {kind!r}", suggestion(kind, [*DEFAULTS, *SETTINGS]))
    name = default_of(kind, mapped=mapped) if use is None else use
    choice = choose(kind, name, dict(values))
    if not mapped and issubclass(choice.component, Estimator) and choice.component.needs_map:
        sentence = f"the estimator {choice.name!r} needs a map, and this mission has `map: none`"
        raise ParameterError("use", sentence, "use `dead_reckoning`, or give the mission a map")
    return choice


def default_of(kind: str, *, mapped: bool = True) -> str:
    """Return the name of the default component of a kind; the kind itself for settings."""
    default: str = DEFAULTS.get(kind, kind)
    return default if mapped else MAPLESS_DEFAULTS.get(kind, {}).get("use", default)


def all_chosen(
    robot: RobotDescription,
    mission: Mapping[str, Component],
    findings: Findings,
    *,
    mapped: bool = True,
) -> dict[str, Choice]:
    """Return the choice of every kind. The mission overrides the robot, the robot the defaults.

    Args:
        robot: its settings apply where the mission sets nothing.
        mission: by kind, with the parameters of the command line.
        findings: receives warnings about the robot's parameters that a component does not have.
        mapped: whether there is a map; without one `MAPLESS_DEFAULTS` apply.
    """
    settings = _settings_in_force(robot, mission, findings, mapped=mapped)
    choices = {
        kind: chosen(kind, wanted.use, wanted.values, mapped=mapped)
        for kind, wanted in settings.items()
    }
    sees_depth = bool(robot.depth_cameras) and choices["depth"].parameters.obstacles
    choices["costmap"] = _costmap(settings["costmap"].values, robot, sees_depth=sees_depth)
    return choices


def _settings_in_force(
    robot: RobotDescription,
    mission: Mapping[str, Component],
    findings: Findings,
    *,
    mapped: bool,
) -> dict[str, Component]:
    """Return what chooses the component of every kind, as `all_chosen` does."""
    found: dict[str, Component] = {}
    for kind in (*DEFAULTS, *SETTINGS):
        wanted = _default(kind, mapped=mapped)
        own = dict(robot.components.get(kind) or {})
        robots = Component(kind, own.pop("use", None), mark_of_robot(robot), own) if own else None
        for layer in (robots, mission.get(kind)):
            if layer is not None:
                marks = {name: layer.marks.get(name, layer.mark) for name in layer.values}
                complete = replace(layer, marks=marks)
                wanted, dropped = layered(wanted, complete, accepted_parameters)
                findings.items += [dropped] if dropped else []
        found[kind] = wanted
    return found


def mark_of_robot(robot: RobotDescription) -> Mark:
    """Return the mark of all settings of a robot: its file."""
    return Mark(str(robot.source or robot.name))


def accepted_parameters(kind: str, name: str, values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the parameters that a component has too; all where `chosen` refuses the name."""
    try:
        return accepted(kind, name, values) if kind in DEFAULTS else values
    except InputError:
        return values


def _default(kind: str, *, mapped: bool) -> Component:
    use = default_of(kind, mapped=mapped) if kind in DEFAULTS else None
    usual = {} if mapped else MAPLESS_DEFAULTS.get(kind, {})
    return Component(kind, use, Mark(""), {n: v for n, v in usual.items() if n != "use"})


def _costmap(values: Mapping[str, Any], robot: RobotDescription, *, sees_depth: bool) -> Choice:
    """Return the costmap with layers for the sensors of the robot."""
    lidars, sonars = tuple(robot.all_lidars), tuple(robot.sonars)
    if "layers" not in values:
        usual = usual_layers(lidars, sonars, depth=sees_depth)
        return replace(chosen("costmap", None, values), parts=usual)
    sensing = sensing_layers(lidars, sonars, depth=sees_depth)
    layers = with_sensors(values["layers"], sensing)
    listed = chosen("costmap", None, {**values, "layers": layers})
    return replace(listed, parts=for_lidars(listed.parts, lidars))


def choices_of(
    mission: Mission, robot: RobotDescription, given: Mapping[str, str], findings: Findings
) -> dict[str, Choice]:
    """Return the components of a mission with the parameters of the command line.

    Args:
        mission: as read.
        robot: its settings apply where neither sets anything.
        given: KIND.NAME -> value as text; KIND.use names a component.
        findings: receives warnings about parameters that a named component does not have.

    Raises:
        InputError: a name or a value of `given` or of the robot is wrong.
    """
    wanted = _with_parameters(mission, given, findings)
    try:
        return all_chosen(robot, wanted, findings, mapped=mission.map != "none")
    except ParameterError as error:  # not from the mission: its values were checked on reading
        named = [name for name in given if name.endswith(f".{error.name}")] or list(given)
        hint = f"; {error.hint}" if error.hint else ""
        source = f"--parameter {', '.join(named)}" if named else f"robot {robot.name}: {error.name}"
        raise InputError(f"{source}: {error.sentence}{hint}") from None


def settings_of(
    mission: Mission, robot: RobotDescription, given: Mapping[str, str]
) -> dict[str, Component]:
    """Return the settings behind the `choices_of` a mission, each with the mark of its source.

    Settings without a mark are defaults.
    """
    wanted = _with_parameters(mission, given, Findings())
    return _settings_in_force(robot, wanted, Findings(), mapped=mission.map != "none")


def _with_parameters(
    mission: Mission, given: Mapping[str, str], findings: Findings
) -> dict[str, Component]:
    """Return the choices with the command line's parameters; `controller.use` names a component."""
    parts = dict(mission.components)
    split = [(*name.partition("."), text) for name, text in given.items()]
    for kind, _, parameter, text in split:
        if not parameter:
            raise InputError(
                f"--parameter {kind}: expected KIND.NAME=VALUE, e.g. controller.cruise_speed=0.4"
            )
        if kind not in (*DEFAULTS, *SETTINGS):
            hint = suggestion(kind, [*DEFAULTS, *SETTINGS])
            raise InputError(f"--parameter: navigation has no {kind!r}; {hint}")
        if parameter != "use":
            continue
        if not text:
            raise InputError(f"--parameter {kind}.use: the name of the component is missing")
        named = Component(kind, text, Mark(str(mission.source)))
        parts[kind], dropped = layered(parts.get(kind), named, accepted_parameters)
        findings.items += [dropped] if dropped else []
    for kind, _, parameter, text in split:
        if parameter != "use":
            part = parts.get(kind) or Component(kind, None, Mark(str(mission.source)))
            parts[kind] = replace(part, values={**part.values, parameter: value_of(text)})
    return parts


def _settings(kind: str, values: Mapping[str, Any]) -> Choice:
    """Return the settings of a part, with its list of layers or zones if it has one."""
    listed = LISTS.get(kind)
    key = "" if listed is None else listed.key
    parameters: Any = build(SETTINGS[kind], {n: v for n, v in values.items() if n != key})
    parts: tuple[Any, ...] = ()
    if listed is not None:
        entries = values.get(key)
        parts = listed.usual() if entries is None else listed.read(entries, parameters)
    return Choice(kind, kind, SETTINGS[kind], parameters, parts)
