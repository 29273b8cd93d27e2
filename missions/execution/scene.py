"""Where a mission runs: its robot, world and start, and the log that is played."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from missions.execution.fit import start_problem
from missions.execution.fit.components import Marks
from missions.execution.resources import (
    SceneFiles,
    base_folder,
    open_recording,
    recorded_world,
)
from missions.language.model import Mission
from missions.run_options import RunOptions
from robots.logs.recording import Recording
from stack.documents import Finding, value_of
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.mavlink.origin import read_origin
from stack.parameters import declarations, read_quantity, suggestion
from stack.sim.worlds.world import Person, World
from stack.types import Pose2D

START_NUMBER, PERSON = "start.", "person."
OF_SCENE = (START_NUMBER, PERSON)
"""Parameters of the scene: `start.x`, `start.y`, `start.heading`, `person.NAME.speed`."""


@dataclass(frozen=True)
class Scene:
    """Robot, world and start of a run.

    Attributes:
        described: the robot as its file or the log describes it.
        robot: the same with the options of the run.
        world: at the start.
        start: pose, world frame.
        recording: what a replayed robot plays; None for a robot that drives.
    """

    described: RobotDescription
    robot: RobotDescription
    world: World
    start: Pose2D
    recording: Recording | None


def scene_of(marks: Marks, options: RunOptions, files: SceneFiles) -> Scene:
    """Return the robot, the world and the log of a mission.

    Raises:
        InputError: one of them cannot be read, or the start of the options is no pose.
    """
    mission = marks.mission
    folder = mission.source.parent
    described = files.robot(options.robot or mission.robot, base_folder(options.robot, folder))
    recording = _recording(options, marks)
    if recording is not None:
        described = recording.describe(described)
    robot = described
    if options.camera == "off":  # a camera that fails, not a robot without one
        robot = replace(robot, camera=None)
    if options.renderer:
        robot = robot.drawn_by(options.renderer)
    named = options.world or mission.world
    if not named:
        world = _placed(recorded_world(robot.name), options)
        return Scene(described, robot, world, _start(options, mission, world), recording)
    base = base_folder(options.world, folder)
    world = files.world(named, base)
    start = _moved(_start(options, mission, world), options)
    if start != world.start:
        world = files.world(named, base, start)
    world = _with_people(world, options)
    return Scene(described, robot, _placed(world, options), start, recording)


def _placed(world: World, options: RunOptions) -> World:
    """The world at the place on Earth that the options give."""
    if options.origin is None:
        return world
    try:
        return replace(world, origin=read_origin(options.origin))
    except InputError as error:
        raise InputError(f"--{error}") from None


def check_start(scene: Scene, marks: Marks, options: RunOptions) -> None:
    """Raise InputError for a start outside the world or inside an obstacle."""
    world = scene.world
    sentence = start_problem(scene.start, world, scene.robot.footprint)
    if sentence:
        places = ", ".join(world.places)
        hint = f"start at one of its places: {places}" if places else "choose another start"
        if options.start is not None or options.world is not None:
            raise InputError(f"{sentence}; {hint}")
        raise InputError([Finding(marks.of("start"), "E412", sentence, hint)])


def _start(options: RunOptions, mission: Mission, world: World) -> Pose2D:
    given = options.start
    if given is None:
        return mission.start if mission.start is not None else world.start
    return pose_of_option(given, {**world.places, **mission.places})


def _moved(start: Pose2D, options: RunOptions) -> Pose2D:
    """Return the start with the numbers of the options.

    Raises:
        InputError: one is wrong.
    """
    for name, text in _numbers(options, START_NUMBER):
        units = {"x": "m", "y": "m", "heading": "rad"}
        if name not in units:
            raise InputError(f"start.{name}: a start has {', '.join(units)}")
        try:
            start = replace(start, **{name: read_quantity(text, units[name])})
        except ParameterError as error:
            raise InputError(f"start.{name}: {error.sentence}") from None
    return start


def _with_people(world: World, options: RunOptions) -> World:
    """Return the world with the numbers of its people in the options.

    Raises:
        InputError: there is no such person or number, or it is wrong.
    """
    for full, text in _numbers(options, PERSON):
        name, _, number = full.rpartition(".")
        people = {person.name: person for person in world.people}
        known = declarations(Person)
        if name not in people or number not in known:
            hint: str = (
                suggestion(name, people) if name not in people else suggestion(number, known)
            )
            raise InputError(f"person.{full}: {world.name} has no such person or number", hint)
        try:
            people[name] = replace(people[name], **{number: known[number].read(value_of(text))})
        except ParameterError as error:
            raise InputError(f"person.{full}: {error.sentence}") from None
        world = replace(world, people=tuple(people.values()))
    return world


def _numbers(options: RunOptions, prefix: str) -> list[tuple[str, str]]:
    """Return the parameters with a prefix, without it."""
    every = (options.parameters or {}).items()
    return [(name.removeprefix(prefix), text) for name, text in every if name.startswith(prefix)]


def pose_of_option(given: str, places: Mapping[str, Pose2D]) -> Pose2D:
    """Return the pose of `--start`: x,y,heading or a place.

    Raises:
        InputError: it is neither.
    """
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
