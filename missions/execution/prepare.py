"""Prepare a mission: read and check it with its robot, world, map and components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from missions.execution.component_choices import choices_of
from missions.execution.fit import (
    fit_findings,
    keepout_areas,
    setting_findings,
    start_problem,
    zone_findings,
)
from missions.execution.fit.components import (
    Marks,
    check_estimator,
    check_map_size,
    check_markers,
    check_rate,
    check_robot_fits,
)
from missions.execution.fit.detector import located_detector
from missions.execution.fit.places import located_places
from missions.execution.resources import (
    catalogue_of,
    find_mission,
    known_markers,
    load_robot,
    load_world,
    open_recording,
    recorded_world,
    resources,
)
from missions.execution.route_graphs import leaves_of, located_planner
from missions.language.model import Mission
from missions.language.reading.header import LOCALISATION
from missions.language.reading.mission import FaultyMissionError, read_mission
from missions.language.reading.words import Draft
from missions.run_options import RunOptions
from robots.logs.recording import Recording
from stack.components import Choice
from stack.documents import Finding, Findings, read_text
from stack.documents.files import decoded, read_input
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.parameters import read_quantity
from stack.sim.worlds.world import World
from stack.types import Marker, Pose2D

__all__ = ["Diagnosis", "PreparedMission", "RunOptions", "diagnose", "prepare"]


MAP_ORIGIN = Pose2D(0.0, 0.0)
"""Start pose in the map frame when there is neither a map nor an initial pose."""


@dataclass(frozen=True)
class PreparedMission:
    """A checked mission with its robot, world, start pose and components. Nothing has moved.

    Attributes:
        belief: initial pose estimate, map frame; None when the mission declares it unknown.
        warnings: findings about the files that components name.
        recording: what a replayed robot plays; None for a robot that drives.
        markers: those that the robot knows, map frame; in a simulation others may stand there.
    """

    mission: Mission
    robot: RobotDescription
    world: World
    start: Pose2D
    belief: Pose2D | None
    choices: dict[str, Choice]
    text: str
    warnings: tuple[Finding, ...] = ()
    recording: Recording | None = None
    markers: tuple[Marker, ...] = ()

    @property
    def is_mapped(self) -> bool:
        """Whether the mission has a map."""
        return self.mission.map != "none"


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with a mission.

    Attributes:
        findings: the errors; or, if there are none, the warnings. In the order of discovery: the
            mission, its world, its components and files, the behaviours.
        plan: the prepared mission; None if there are errors.
    """

    findings: tuple[Finding, ...]
    plan: PreparedMission | None


def diagnose(
    path: Path, options: RunOptions | None = None, draft: Draft | None = None
) -> Diagnosis:
    """Read a mission and the files it names, and check that it can start. Nothing is started.

    `check`, the language server, `show`, `run` and its reload all call this: a mission without
    errors starts.

    Args:
        path: the mission file, which need not exist if there is a text.
        options: as for a run.
        draft: text to read instead of the file's, and a recorder of its words.

    Raises:
        InputError: an option is wrong, or a file cannot be read; not for errors in files.
    """
    found = Findings()
    try:
        plan = _planned(path, options or RunOptions(), draft or Draft(), found)
    except InputError as error:
        errors = tuple(error.findings) or tuple(found.errors)
        if not errors:
            raise
        return Diagnosis(errors, None)
    warnings = (*plan.mission.warnings, *plan.world.warnings, *plan.warnings)
    return Diagnosis(warnings, plan)


def prepare(name: str | Path, options: RunOptions) -> PreparedMission:
    """Read and check a mission and the files it names.

    Raises:
        InputError: the files have errors; it carries every finding. Nothing was started.
    """
    diagnosis = diagnose(find_mission(name), options)
    if diagnosis.plan is None:
        raise InputError(diagnosis.findings)
    return diagnosis.plan


def _planned(path: Path, options: RunOptions, draft: Draft, found: Findings) -> PreparedMission:
    """Return the prepared mission; collect the errors of one check before the next in `found`.

    Raises:
        InputError: all errors, or those without which the others cannot be checked.
    """
    mission = _mission(path, options, draft)
    text = draft.text
    if text is None:
        text = decoded(read_input(path, "mission"), path)
    folder = path.parent
    robot = load_robot(options.robot or mission.robot, _base_folder(options.robot, folder))
    marks = Marks(mission, read_text(text, str(path), "mission"))
    recording = _recording(options, marks)
    if recording is not None:
        robot = recording.describe(robot)
    named = options.world or mission.world
    if named:
        world = load_world(named, _base_folder(options.world, folder))
    else:
        world = recorded_world(robot.name)
    if options.camera == "off":
        robot = replace(robot, camera=None)
    if options.renderer:
        robot = robot.drawn_by(options.renderer)
    start = _start_pose(options.start, mission, world)
    _gather(found, lambda: _check_start(start, options, marks, world, robot))
    misfits = [] if recording else fit_findings(mission, world, robot, start)
    found.items += [item for item in misfits if item.severity == "error"]
    belief = _belief(mission, start)
    choices = choices_of(mission, robot, options.parameters or {})
    misfits += setting_findings(mission, robot, choices)
    _gather(found, lambda: check_robot_fits(choices, marks, robot))
    _gather(found, lambda: check_estimator(choices[LOCALISATION], marks, belief))
    if recording is None and (options.body or robot.body) == "simulated":
        _gather(found, lambda: check_rate(choices["loop"].parameters, marks))
    _gather(found, lambda: check_map_size(marks, world, choices["costmap"].parameters))
    layers = tuple(layer.located(folder) for layer in choices["costmap"].parts)
    choices["costmap"] = replace(choices["costmap"], parts=layers)
    areas = _gather(found, lambda: keepout_areas(layers)) or ()
    if recording is None:
        zoned = zone_findings(mission, world, robot, (start, marks.of("start")), areas)
        found.items += [item for item in zoned if item.severity == "error"]
        misfits += zoned
    limits = choices["speed_limits"]
    choices["speed_limits"] = replace(limits, parameters=limits.parameters.located(folder))
    planner = choices["planner"]
    located = _gather(found, lambda: located_planner(planner, mission, robot, world, areas))
    choices["planner"], warnings = located or (planner, ())
    detector = _gather(found, lambda: located_detector(choices, mission, robot))
    if detector is not None:
        choices["object_detector"], sightless = detector
        warnings = (*warnings, *sightless)
    places = _gather(found, lambda: located_places(choices["place_recognition"], mission))
    choices["place_recognition"] = places or choices["place_recognition"]
    warnings = (*misfits, *warnings)
    markers = _gather(found, lambda: known_markers(mission, world)) or ()
    _gather(found, lambda: check_markers(choices, marks, robot))
    plan = PreparedMission(
        mission, robot, world, start, belief, choices, text, warnings, recording, markers
    )  # fmt: skip
    _gather(found, lambda: _check_nodes(plan, options))
    found.raise_errors()
    return plan


def _mission(path: Path, options: RunOptions, draft: Draft) -> Mission:
    """Read the mission.

    Raises:
        InputError: its errors; those of its goals too if world and robot are known.
    """
    arguments = options.arguments or {}
    try:
        return read_mission(path, catalogue_of, resources(options.world), arguments, draft)
    except FaultyMissionError as error:
        errors = [*error.findings, *_goal_errors(error.mission, options)]
        raise InputError(errors) from None


def _goal_errors(mission: Mission, options: RunOptions) -> list[Finding]:
    """Return the errors of the goals of a mission that has other errors."""
    named, folder = options.world or mission.world, mission.source.parent
    if not named or mission.replay is not None or options.replay is not None:
        return []
    try:
        robot = load_robot(options.robot or mission.robot, _base_folder(options.robot, folder))
        world = load_world(named, _base_folder(options.world, folder))
    except InputError:
        return []  # among the mission's own errors
    found = fit_findings(mission, world, robot, mission.start or world.start)
    return [item for item in found if item.severity == "error"]


def _recording(options: RunOptions, marks: Marks) -> Recording | None:
    """Open the log that the options or the mission name.

    Raises:
        InputError: it cannot be played; a missing one at its name in the mission.
    """
    if options.replay is not None:
        return open_recording(options.replay)
    replay = marks.mission.replay
    if replay is None:
        return None
    try:
        return open_recording(replay.log, replay)
    except InputError as error:
        if not any(item.code == "E001" for item in error.findings):
            raise
        missing = error.findings[0]
        sentence = f"robot: {missing.mark.file}: {missing.sentence}"
        raise InputError([Finding(replay.mark, "E110", sentence, missing.hint)]) from None


T = TypeVar("T")


def _gather(found: Findings, check: Callable[[], T]) -> T | None:
    """Return the result of a check, or None after findings in files, which are collected."""
    try:
        return check()
    except InputError as error:
        if not error.findings:
            raise
        found.items += error.findings
        return None


def _check_nodes(plan: PreparedMission, options: RunOptions) -> None:
    """Raise InputError for behaviours that cannot be built, and for unknown nodes of options."""
    debugged = bool(options.breakpoints or options.forced)
    plugged = any(not leaf.behaviour.is_built_in for leaf in leaves_of(plan.mission))
    if not debugged and not plugged:
        return  # the built-in behaviours can be built with any valid ports
    from missions.trees.compiler import compile_mission

    tree = compile_mission(plan.mission)
    if not debugged:
        return
    from missions.trees.debugging import TreeDebugger

    debugger = TreeDebugger(tree)
    for node in options.breakpoints:
        debugger.set_breakpoint(node)
    for node, outcome in (options.forced or {}).items():
        debugger.force(node, outcome)


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
    start: Pose2D, options: RunOptions, marks: Marks, world: World, robot: RobotDescription
) -> None:
    """Raise InputError for a start outside the world or inside an obstacle."""
    sentence = start_problem(start, world, robot.footprint)
    if sentence:
        places = ", ".join(world.places)
        hint = f"start at one of its places: {places}" if places else "choose another start"
        if options.start is not None or options.world is not None:
            raise InputError(f"{sentence}; {hint}")
        raise InputError([Finding(marks.of("start"), "E412", sentence, hint)])


def _belief(mission: Mission, start: Pose2D) -> Pose2D | None:
    """Return the initial pose estimate; None when the mission declares it unknown."""
    if mission.initial_pose == "start":
        return start
    return mission.initial_pose if isinstance(mission.initial_pose, Pose2D) else None


def as_recorded(plan: PreparedMission, options: RunOptions) -> RunOptions:
    """Return the options with the seed of the recording that is replayed.

    Raises:
        InputError: the recording is of another robot.
    """
    if plan.recording is None or not plan.recording.about:
        return options
    about, file = plan.recording.about, plan.recording.file
    if about.get("robot") != plan.robot.name:
        raise InputError(
            f"{file} was recorded with the robot {about.get('robot')!r}, this mission"
            f" has {plan.robot.name!r}; choose it with --robot"
        )
    seed = about.get("seed", "")
    if not seed.isdecimal():
        raise InputError(f"{file}: the seed {seed!r} in its metadata is not a number")
    return replace(options, seed=int(seed))
