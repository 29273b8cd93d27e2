"""Prepare a mission: read and check it with its robot, world, map and components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import TypeVar

from behaviours.catalogue import plugin_sources
from missions.execution.component_choices import choices_of
from missions.execution.fit import (
    component_findings,
    fit_findings,
    fixed_base_findings,
    keepout_areas,
    setting_findings,
    tolerance_findings,
    zone_findings,
)
from missions.execution.fit.arms import arm_findings
from missions.execution.fit.components import (
    Marks,
    check_estimator,
    check_map_size,
    check_markers,
    check_rate,
    check_robot_fits,
)
from missions.execution.fit.faults import component_parameters, faults_of
from missions.execution.fit.installation import check_body, check_packages, check_renderer
from missions.execution.fit.models import located_detector, located_places, located_policy
from missions.execution.fit.needs import behaviour_needs
from missions.execution.fit.routes import located_planner
from missions.execution.fit.steps import every_leaf
from missions.execution.resources import (
    SceneFiles,
    base_folder,
    catalogue_of,
    find_mission,
    known_markers,
    resources,
)
from missions.execution.scene import Scene, check_start, scene_of
from missions.language.model import Mission
from missions.language.reading.header import LOCALISATION
from missions.language.reading.mission import FaultyMissionError, read_mission
from missions.language.reading.words import Draft
from missions.run_options import RunOptions
from robots.bodies import body_kind
from robots.logs.recording import Recording
from stack.components import Choice
from stack.costmap.choosing import LayerChoice
from stack.documents import Finding, Findings, Mark, read_text
from stack.documents.files import decoded, noting_inputs, read_input
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.sim.faults.planned import PlannedFault
from stack.sim.worlds.world import World
from stack.types import Marker, Pose2D

Choices = dict[str, Choice]

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
        read: the files that were read for it, absolute.
        faults: that befall the robot.
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
    read: tuple[Path, ...] = ()
    faults: tuple[PlannedFault, ...] = ()

    @property
    def is_mapped(self) -> bool:
        """Whether the mission has a map."""
        return self.mission.map != "none"

    @property
    def files(self) -> list[Path]:
        """The mission file, its includes, its parameter files and its plugin files."""
        mission, folder = self.mission, self.mission.source.parent
        return [
            mission.source, *mission.includes, *(folder / name for name in mission.parameter_files),
            *plugin_sources(mission.plugins, folder),
        ]  # fmt: skip


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
        with noting_inputs() as read:
            plan = _planned(path, options or RunOptions(), draft or Draft(), found)
    except InputError as error:
        errors = tuple(error.findings) or tuple(found.errors)
        if not errors:
            raise
        return Diagnosis(errors, None)
    warnings = (
        *plan.mission.warnings, *plan.world.warnings, *plan.robot.warnings, *plan.warnings
    )  # fmt: skip
    return Diagnosis(warnings, replace(plan, read=tuple(read)))


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
    """Return the prepared mission; collect findings in the order of the checks in `found`.

    Raises:
        InputError: all errors, or those without which the others cannot be checked.
    """
    files = SceneFiles()
    mission = _mission(path, options, draft, files)
    text = draft.text
    if text is None:
        text = decoded(read_input(path, "mission"), path)
    marks = Marks(mission, read_text(text, str(path), "mission"))
    scene = scene_of(marks, options, files)
    _check_scene(scene, marks, options, found)
    choices = choices_of(mission, scene.robot, component_parameters(options.parameters), found)
    belief = _belief(mission, scene.start)
    _check_components(choices, scene, marks, belief, found)
    _check_installation(choices, scene, marks, options, found)
    choices = _with_files(choices, scene, marks, found)
    markers = _gather(found, lambda: known_markers(mission, scene.world)) or ()
    _gather(found, lambda: check_markers(choices, marks, scene.robot))
    of_faults = marks.of("faults")
    faults = _gather(
        found, lambda: faults_of(mission, scene.world, scene.robot, options, of_faults)
    )
    plan = PreparedMission(
        mission, scene.robot, scene.world, scene.start, belief, choices, text,
        tuple(found.warnings), scene.recording, markers, faults=faults or (),
    )  # fmt: skip
    _gather(found, lambda: _check_nodes(plan, options))
    found.raise_errors()
    return plan


def _check_scene(scene: Scene, marks: Marks, options: RunOptions, found: Findings) -> None:
    """Check the start, and what the nodes of the mission ask of the robot and the world."""
    found.items += behaviour_needs(marks.mission, scene.described)
    found.items += arm_findings(marks.mission, scene.described, scene.world)
    if not scene.robot.drivetrain.moves:
        return
    _gather(found, lambda: check_start(scene, marks, options))
    if scene.recording is None:
        found.items += fit_findings(marks.mission, scene.world, scene.robot, scene.start)


def _check_components(
    choices: Choices, scene: Scene, marks: Marks, belief: Pose2D | None, found: Findings
) -> None:
    """Check that the components fit the robot, the mission and its map."""
    mission, robot = marks.mission, scene.robot
    if not robot.drivetrain.moves:
        found.items += fixed_base_findings(choices, marks, scene.described)
        return
    found.items += setting_findings(mission, robot, choices)
    found.items += component_findings(choices, marks, scene.described)
    found.items += tolerance_findings(mission, robot, choices)
    _gather(found, lambda: check_robot_fits(choices, marks, robot))
    _gather(found, lambda: check_estimator(choices[LOCALISATION], marks, belief))
    _gather(found, lambda: check_map_size(marks, scene.world, choices["costmap"].parameters))


def _check_installation(
    choices: Choices, scene: Scene, marks: Marks, options: RunOptions, found: Findings
) -> None:
    """Check that this installation has the packages, and that the simulation can do its part."""
    _gather(found, lambda: check_packages(choices, marks))
    if scene.recording is not None:
        return
    kind = _gather(found, lambda: body_kind(options.body or scene.robot.body))
    if kind is None:
        return
    found.items += check_body(scene.robot, options.body)
    if kind.simulates:
        _gather(found, lambda: check_renderer(scene.robot, options.renderer))
        _gather(found, lambda: check_rate(choices["loop"].parameters, marks))


def _with_files(choices: Choices, scene: Scene, marks: Marks, found: Findings) -> Choices:
    """Return the components with the paths of their files resolved; check these files."""
    mission, world, robot = marks.mission, scene.world, scene.robot
    folder = mission.source.parent
    costmap, limits = choices["costmap"], choices["speed_limits"]
    layers = _layers(choices, folder)
    areas = _gather(found, lambda: keepout_areas(layers)) or ()
    if scene.recording is None and robot.drivetrain.moves:
        start = scene.start, marks.of("start")
        found.items += zone_findings(mission, world, robot, start, areas)
    planner, of_graph = _gather(
        found, lambda: located_planner(choices["planner"], mission, robot, world, areas)
    ) or (choices["planner"], ())
    detector, of_detector = _gather(found, lambda: located_detector(choices, mission, robot)) or (
        choices["object_detector"], ()
    )  # fmt: skip
    places = _gather(found, lambda: located_places(choices["place_recognition"], mission))
    policy = _gather(found, lambda: located_policy(choices["controller"], mission, robot))
    found.items += [*of_graph, *of_detector]
    return {
        **choices,
        "controller": policy or choices["controller"],
        "costmap": replace(costmap, parts=layers),
        "speed_limits": replace(limits, parameters=limits.parameters.located(folder)),
        "planner": planner,
        "object_detector": detector,
        "place_recognition": places or choices["place_recognition"],
    }


def _layers(choices: Choices, folder: Path) -> tuple[LayerChoice, ...]:
    """Return the costmap layers with the paths of their files resolved."""
    return tuple(layer.located(folder) for layer in choices["costmap"].parts)


def _mission(path: Path, options: RunOptions, draft: Draft, files: SceneFiles) -> Mission:
    """Read the mission.

    Raises:
        InputError: its errors; those of its goals too if world and robot are known.
    """
    arguments = options.arguments or {}
    try:
        asked = resources(options.world, files)
        return read_mission(path, catalogue_of, asked, arguments, draft)
    except FaultyMissionError as error:
        errors = [*error.findings, *_goal_errors(error.mission, options, files)]
        raise InputError(errors) from None


def _goal_errors(mission: Mission, options: RunOptions, files: SceneFiles) -> list[Finding]:
    """Return the errors of the goals of a mission that has other errors."""
    named, folder = options.world or mission.world, mission.source.parent
    if not named or mission.replay is not None or options.replay is not None:
        return []
    try:
        robot = files.robot(options.robot or mission.robot, base_folder(options.robot, folder))
        world = files.world(named, base_folder(options.world, folder), mission.start)
    except InputError:
        return []  # among the mission's own errors
    start = mission.start or world.start
    if isnan(start.x):
        return []  # a place with an error
    if not robot.drivetrain.moves:
        return [*behaviour_needs(mission, robot), *arm_findings(mission, robot, world)]
    found = fit_findings(mission, world, robot, start)
    try:
        choices = choices_of(mission, robot, component_parameters(options.parameters), Findings())
        areas = keepout_areas(_layers(choices, folder))
    except InputError:
        areas = ()  # among the mission's own errors
    found += zone_findings(mission, world, robot, (start, Mark(str(mission.source))), areas)
    errors = [item for item in found if item.severity == "error"]
    errors += arm_findings(mission, robot, world)
    return [*errors, *behaviour_needs(mission, robot)]


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
    plugged = any(not leaf.behaviour.is_built_in for leaf in every_leaf(plan.mission))
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
