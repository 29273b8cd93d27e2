"""Prepare a mission: read and check it with its robot, world, map and components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from missions.execution.component_choices import DEFAULTS, SETTINGS, all_chosen
from missions.execution.goal_checks import fit_findings
from missions.execution.resources import (
    catalogue_of,
    find_mission,
    load_robot,
    load_world,
    resources,
)
from missions.execution.route_graphs import located_planner
from missions.language.model import Mission
from missions.language.reading.header import LOCALISATION
from missions.language.reading.mission import read_mission
from stack.components import Choice, Component, Estimator
from stack.costmap.parameters import CostmapParameters
from stack.documents import Finding, Mark, read_file, value_of
from stack.documents.files import decoded, read_input
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.mapping.limits import MAX_CELLS
from stack.parameters import read_quantity, suggestion
from stack.runtime.parameters import LoopParameters
from stack.sim.physics.settings import SimulationSettings
from stack.sim.worlds.outlines import outlines
from stack.sim.worlds.rasterise import RESOLUTION, map_problem, map_shape
from stack.sim.worlds.world import World
from stack.telemetry.records import Command
from stack.types import Pose2D

__all__ = ["PreparedMission", "RunOptions", "prepare"]


MAP_ORIGIN = Pose2D(0.0, 0.0)
"""Start pose in the map frame when there is neither a map nor an initial pose."""


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, as `treepilot run` takes them.

    Attributes:
        speed: simulated seconds per wall second; 0 is as fast as possible.
        out: the run folder, made absolute; None writes no records.
        serve: let dashboards attach.
        mavlink: address to send MAVLink telemetry to, or None.
        parameters: `controller.cruise_speed` -> value as text; overrides all files.
        camera: "asked" renders an image only when the mission asks for one; "off" simulates a
            robot without a working camera; "on" renders all the time, for the recording.
        watch: reload the mission when its file changes.
        breakpoints: nodes before which the mission stops.
        forced: node -> outcome, in force from the start.
        body: simulated | scripted; empty: the choice of the robot file.
        replay: sensor log to play instead of driving; its seed replaces `seed`.
        record: what to record besides events: `sensors`.
        on_lost_records: continue | stop, when a record cannot be written, e.g. on a full disk.
        identity: of the run, chosen by the process that starts it; empty: a new one.
    """

    seed: int = 0
    arguments: dict[str, str] | None = None
    robot: str | None = None
    world: str | None = None
    start: str | None = None
    out: Path | None = None
    speed: float = 0.0
    rerun: bool = False
    serve: bool = True
    mavlink: str | None = None
    camera: str = "asked"
    parameters: Mapping[str, str] | None = None
    watch: bool = False
    breakpoints: tuple[str, ...] = ()
    forced: dict[str, str] | None = None
    body: str = ""
    replay: Path | None = None
    record: tuple[str, ...] = ()
    on_lost_records: str = "continue"
    identity: str = ""

    def __post_init__(self) -> None:
        if self.out is not None:  # a plugin may change the working directory
            object.__setattr__(self, "out", self.out.absolute())

    def first_commands(self) -> list[Command]:
        """Return the breakpoints and forced outcomes as commands, applied before the first step."""
        stops = [Command("start", "break", {"node": node}) for node in self.breakpoints]
        forced = (self.forced or {}).items()
        return stops + [
            Command("start", "force", {"node": node, "status": outcome}) for node, outcome in forced
        ]


@dataclass(frozen=True)
class PreparedMission:
    """A checked mission with its robot, world, start pose and components. Nothing has moved.

    Attributes:
        belief: initial pose estimate, map frame; None when the mission declares it unknown.
        warnings: findings about the files that components name.
    """

    mission: Mission
    robot: RobotDescription
    world: World
    start: Pose2D
    belief: Pose2D | None
    choices: dict[str, Choice]
    text: str
    warnings: tuple[Finding, ...] = ()

    @property
    def is_mapped(self) -> bool:
        """Whether the mission has a map."""
        return self.mission.map != "none"


def prepare(name: str | Path, options: RunOptions) -> PreparedMission:
    """Read and check a mission and the files it names.

    Raises:
        InputError: the files have errors; it carries every finding. Nothing was started.
    """
    path = find_mission(name)
    mission = read_mission(path, catalogue_of, resources(options.world), options.arguments or {})
    folder = path.parent
    robot = load_robot(options.robot or mission.robot, _base_folder(options.robot, folder))
    world = load_world(options.world or mission.world, _base_folder(options.world, folder))
    if options.camera == "off":
        robot = replace(robot, camera=None)
    start = _start_pose(options.start, mission, world)
    _check_start(start, options, mission, world, robot)
    misfits = [] if options.replay else fit_findings(mission, world, robot)
    if any(item.severity == "error" for item in misfits):
        raise InputError([item for item in misfits if item.severity == "error"])
    belief = _belief(mission, start)
    wanted = {kind: (part.use, part.values) for kind, part in mission.components.items()}
    wanted = _with_parameters(wanted, options.parameters or {})
    try:
        choices = all_chosen(robot, wanted, mapped=mission.map != "none")
    except ParameterError as error:  # not from the mission: its values were checked on reading
        names = list(options.parameters or {})
        given = [name for name in names if name.endswith(f".{error.name}")] or names
        hint = f"; {error.hint}" if error.hint else ""
        source = f"--parameter {', '.join(given)}" if given else f"robot {robot.name}: {error.name}"
        raise InputError(f"{source}: {error.sentence}{hint}") from None
    _check_fit(choices, mission, robot)
    _check_estimator(choices[LOCALISATION], mission, belief)
    if options.replay is None and (options.body or robot.body) == "simulated":
        _check_rate(choices["loop"].parameters, mission)
    _check_map_size(mission, world, choices["costmap"].parameters)
    layers = tuple(layer.located(folder) for layer in choices["costmap"].parts)
    choices["costmap"] = replace(choices["costmap"], parts=layers)
    limits = choices["speed_limits"]
    choices["speed_limits"] = replace(limits, parameters=limits.parameters.located(folder))
    choices["planner"], warnings = located_planner(choices["planner"], mission, robot, world)
    plan = PreparedMission(
        mission=mission,
        robot=robot,
        world=world,
        start=start,
        belief=belief,
        choices=choices,
        text=decoded(read_input(path, "mission"), path),
        warnings=(*misfits, *warnings),
    )
    if options.breakpoints or options.forced:
        _check_nodes(plan, options)
    return plan


def _check_nodes(plan: PreparedMission, options: RunOptions) -> None:
    """Raise InputError for breakpoints and forced outcomes of unknown nodes."""
    from missions.trees.compiler import compile_mission
    from missions.trees.debugging import TreeDebugger

    debugger = TreeDebugger(compile_mission(plan.mission))
    for node in options.breakpoints:
        debugger.set_breakpoint(node)
    for node, outcome in (options.forced or {}).items():
        debugger.force(node, outcome)


def _check_fit(choices: dict[str, Choice], mission: Mission, robot: RobotDescription) -> None:
    """Raise InputError for components whose settings do not fit the robot."""
    for choice in choices.values():
        if not issubclass(choice.component, Component):
            continue  # settings of a fixed part
        try:
            choice.component.check(choice.parameters, robot)
        except InputError as error:
            mark = _mark_of_component(mission, choice.kind)
            raise InputError([Finding(mark, "E111", str(error))]) from None


def _check_estimator(choice: Choice, mission: Mission, belief: Pose2D | None) -> None:
    """Raise InputError for an unknown initial pose on a map that the estimator cannot find."""
    estimator: type[Estimator] = choice.component
    if mission.map != "none" and belief is None and estimator.needs_initial_pose:
        sentence = f"the estimator {choice.name!r} cannot find an unknown initial pose"
        mark = _mark_of(mission.source, "initial_pose")
        raise InputError([Finding(mark, "E111", sentence, "use `localisation: mcl`, or give one")])


def _check_rate(loop: LoopParameters, mission: Mission) -> None:
    """Raise InputError for a control rate that the simulation cannot step."""
    try:
        SimulationSettings().steps("control period", loop.period)
    except ParameterError as error:
        mark = _mark_of_component(mission, "loop", "control_rate")
        raise InputError([Finding(mark, "E111", error.sentence, error.hint)]) from None


Wanted = dict[str, tuple[str | None, Mapping[str, Any]]]


def _check_map_size(mission: Mission, world: World, costs: CostmapParameters) -> None:
    """Raise InputError for a world of which no map can be drawn in cells of this size."""
    if mission.map != "from_world":
        return
    for resolution in (RESOLUTION, costs.map_resolution):
        sentence = map_problem(world, resolution)
        if not sentence:
            continue
        hint = "use `map: none`, or set closer `bounds` in the world file"
        if resolution != RESOLUTION:
            rows, columns = map_shape(world, resolution)
            least = ceil(100.0 * resolution * (rows * columns / MAX_CELLS) ** 0.5) / 100.0
            hint = f"set `navigation: {{costmap: {{map_resolution: {least:g}}}}}`"
        raise InputError([Finding(_mark_of(mission.source, "world"), "E413", sentence, hint)])


def _with_parameters(wanted: Wanted, given: Mapping[str, str]) -> Wanted:
    """Return the choices with the command line's parameters; `controller.use` names a component."""
    wanted = dict(wanted)
    for name, text in given.items():
        kind, dot, parameter = name.partition(".")
        if not dot or not parameter:
            raise InputError(
                f"--parameter {name}: expected KIND.NAME=VALUE, e.g. controller.cruise_speed=0.4"
            )
        use, values = wanted.get(kind, (None, {}))
        if parameter == "use":
            wanted[kind] = (text, values if text == use else {})
        else:
            wanted[kind] = (use, {**values, parameter: value_of(text)})
    for kind in {name.partition(".")[0]: None for name in given}:
        if kind not in (*DEFAULTS, *SETTINGS):
            hint = suggestion(kind, [*DEFAULTS, *SETTINGS])
            raise InputError(f"--parameter: navigation has no {kind!r}; {hint}")
    return wanted


def _base_folder(option: str | None, mission_folder: Path) -> Path:
    """Return the base of a relative path: the current folder for an option, else the mission's."""
    return Path.cwd() if option else mission_folder


def _start_pose(given: str | None, mission: Mission, world: World) -> Pose2D:
    if given is None:
        return mission.start if mission.start is not None else world.start
    places = {**world.places, **mission.places}
    if given in places:
        return places[given]
    parts = given.split(",")
    if len(parts) not in (2, 3):
        raise InputError(f"--start {given}: expected x,y,heading or one of {', '.join(places)}")
    try:
        units = ("m", "m", "rad")
        numbers = [read_quantity(part, unit) for part, unit in zip(parts, units, strict=False)]
    except ParameterError as error:
        raise InputError(f"--start {given}: {error.sentence}") from None
    return Pose2D(*numbers)


def _check_start(
    start: Pose2D, options: RunOptions, mission: Mission, world: World, robot: RobotDescription
) -> None:
    """Raise InputError for a start outside the world or inside an obstacle."""
    x_min, y_min, x_max, y_max = world.bounds
    where = f"the start ({start.x:g}, {start.y:g})"
    sentence = ""
    if not (x_min <= start.x <= x_max and y_min <= start.y <= y_max):
        covered = f"x {x_min:g} to {x_max:g} m and y {y_min:g} to {y_max:g} m"
        sentence = f"{where} is outside {world.name}, which covers {covered}"
    point = np.array([[start.x, start.y]])
    for outline in outlines(world):
        if outline.distance_to(point)[0] < robot.footprint.inscribed_radius:
            thing = outline.name or "a wall"
            sentence = sentence or f"{where} collides with {thing} of {world.name}"
    if sentence:
        places = ", ".join(world.places)
        hint = f"start at one of its places: {places}" if places else "choose another start"
        if options.start is not None or options.world is not None:
            raise InputError(f"{sentence}; {hint}")
        raise InputError([Finding(_mark_of(mission.source, "start"), "E412", sentence, hint)])


def _mark_of(path: Path, key: str) -> Mark:
    """Return the position of a top-level key's value, or the start of the file."""
    node = read_file(path, "mission").get(key)
    return node.mark if node is not None else Mark(str(path))


def _mark_of_component(mission: Mission, kind: str, parameter: str = "") -> Mark:
    """Return the position of a component or its parameter; of its section if it is a default."""
    named = mission.components.get(kind)
    if named is None:
        return _mark_of(mission.source, "navigation")
    return named.marks.get(parameter, named.mark)


def _belief(mission: Mission, start: Pose2D) -> Pose2D | None:
    """Return the initial pose estimate; None when the mission declares it unknown."""
    if mission.initial_pose == "start":
        return start
    return mission.initial_pose if isinstance(mission.initial_pose, Pose2D) else None
