"""Test behaviours without a simulator: a robot of plain attributes, and a helper that ticks.

robot = ScriptedRobot()
drive = NavigateToPose(goal=Pose2D(1, 0))
assert tick(drive, robot) is Status.RUNNING
robot.task.succeed()
assert tick(drive, robot) is Status.SUCCESS
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from stack.errors import ParameterError
from stack.robot import Robot
from stack.types import (
    STANDSTILL,
    Battery,
    Failure,
    FailureCode,
    FloatArray,
    Footprint,
    Image,
    Marker,
    MarkerSighting,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    TaskStatus,
    Twist,
)

TICK_PERIOD = 0.1
"""Seconds between two ticks of the tree in a mission."""


@dataclass
class ScriptedTask:
    """A task whose outcome the test decides."""

    status: TaskStatus = TaskStatus.RUNNING
    feedback: str = ""
    failure: Failure | None = None
    distance_remaining: float = 0.0
    path: Path | None = None

    def succeed(self, path: Path | None = None) -> None:
        """End it well."""
        self.status, self.path = TaskStatus.SUCCEEDED, path

    def fail(self, code: str = FailureCode.FAILED, sentence: str = "the test says so") -> None:
        """End it badly."""
        self.status, self.failure = TaskStatus.FAILED, Failure(code, sentence)

    def cancel(self) -> None:
        """End it early; does nothing once it is over."""
        if self.status is TaskStatus.RUNNING:
            self.status = TaskStatus.CANCELLED
            self.failure = Failure(FailureCode.CANCELLED, "cancelled")


def _fits_nowhere(pose: Pose2D) -> float:
    return 0.0


@dataclass
class ScriptedRobot:
    """A stack.robot.Robot that the test plays the world for.

    What the behaviour may read are attributes that the test sets: `robot.battery = Battery(0.1)`.
    What it asks for is kept in `calls` as (name, arguments); the newest task is `task`.

    Attributes:
        picture: what `image()` answers.
        sightings: what `marker_sightings()` answers.
        fit: stands for `fit_at`.
        covariance: (3, 3) of x, y, heading, in `estimate`.
        said: lines for the operator.
        twist: velocity last commanded by `drive_for`.
        calls: everything asked of the robot, in order.
        task: the newest task; its outcome is the test's to set.
        motion: the newest task that drives; a newer one cancels it.
        edges: of the route graph.
    """

    time: float = 0.0
    pose: Pose2D = Pose2D(0.0, 0.0)
    odometry: Pose2D = Pose2D(0.0, 0.0)
    localisation_health: float = 1.0
    covariance: FloatArray = field(default_factory=lambda: np.diag([0.0025, 0.0025, 0.001]))
    speed: Twist = STANDSTILL
    footprint: Footprint = field(default_factory=lambda: Footprint.circle(0.22))
    battery: Battery = field(default_factory=lambda: Battery(1.0))
    scan: Scan | None = None
    markers: tuple[Marker, ...] = ()
    picture: Image | None = None
    sightings: tuple[MarkerSighting, ...] = ()
    fit: Callable[[Pose2D], float] = _fits_nowhere
    said: list[str] = field(default_factory=list)
    twist: Twist = STANDSTILL
    calls: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    task: ScriptedTask = field(default_factory=ScriptedTask)
    motion: ScriptedTask = field(default_factory=ScriptedTask)
    edges: tuple[str, ...] = ()

    def advance(self, seconds: float) -> None:
        """Let time pass. A test with a world of its own overrides this and moves the robot."""
        self.time = round(self.time + seconds, 9)

    def asked(self, name: str) -> list[dict[str, Any]]:
        """The arguments of every call of that name, in order."""
        return [arguments for called, arguments in self.calls if called == name]

    @property
    def estimate(self) -> PoseEstimate:
        """Pose, covariance and health in one."""
        return PoseEstimate(self.pose, self.covariance, self.localisation_health)

    def image(self) -> Image | None:
        """The picture that the test set."""
        return self.picture

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        """The sightings that the test set."""
        return self.sightings

    def fit_at(self, pose: Pose2D) -> float:
        """The answer of the function that the test set."""
        return self.fit(pose)

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> ScriptedTask:
        """A new motion task."""
        return self._move("navigate_to", goal=goal, tolerance=tolerance, partial=partial)

    def navigate_through(
        self, goals: list[Pose2D], *, tolerance: float | None = None
    ) -> ScriptedTask:
        """A new motion task."""
        return self._move("navigate_through", goals=goals, tolerance=tolerance)

    def follow_path(self, path: Path) -> ScriptedTask:
        """A new motion task."""
        return self._move("follow_path", path=path)

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> ScriptedTask:
        """A new task; the test ends it with `robot.task.succeed(path)`."""
        return self._ask("plan", goal=goal, start=start)

    def spin(self, angle: float, *, speed: float | None = None) -> ScriptedTask:
        """A new motion task."""
        return self._move("spin", angle=angle, speed=speed)

    def back_up(self, distance: float, *, speed: float | None = None) -> ScriptedTask:
        """A new motion task."""
        return self._move("back_up", distance=distance, speed=speed)

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0
    ) -> ScriptedTask:
        """A new motion task."""
        return self._move("drive_on_heading", distance=distance, speed=speed, direction=direction)

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5, speed: float | None = None
    ) -> ScriptedTask:
        """A new motion task."""
        return self._move("escape", clearance=clearance, distance=distance, speed=speed)

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> ScriptedTask:
        """A new motion task."""
        return self._move("assisted_teleop", seconds=seconds, silence=silence)

    def drive_for(self, twist: Twist, seconds: float) -> None:
        """Keep the velocity in `twist`; cancels a motion under way, as the real robot does."""
        self.motion.cancel()
        self.twist = twist
        self.calls.append(("drive_for", {"twist": twist, "seconds": seconds}))

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Note the call."""
        given = {"radius": radius, "layer": layer}
        rest = {name: value for name, value in given.items() if value is not None}
        self.calls.append(("clear_costmap", {"which": which, **rest}))

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Note the call; an edge that is not in `edges` does not exist."""
        if edge not in self.edges:
            raise ParameterError("edge", f"the route graph has no edge {edge!r}")
        self.calls.append(("set_edge", {"edge": edge, "closed": closed}))

    def relocalise(self) -> ScriptedTask:
        """A new task."""
        return self._ask("relocalise")

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Believe it, and note the call."""
        self.pose = pose
        deviations = {
            "position_deviation": position_deviation,
            "heading_deviation": heading_deviation,
        }
        self.calls.append(("set_pose", {"pose": pose, **deviations, "source": source}))

    def save_image(self, image: Image, name: str) -> str:
        """Keep nothing, answer the path that it would have."""
        self.calls.append(("save_image", {"image": image, "name": name}))
        return f"images/{name}.png"

    def say(self, text: str) -> None:
        """Keep the line in `said`."""
        self.said.append(text)
        self.calls.append(("say", {"text": text}))

    def _move(self, name: str, **arguments: Any) -> ScriptedTask:
        self.motion.cancel()
        self.motion = self._ask(name, **arguments)
        return self.motion

    def _ask(self, name: str, **arguments: Any) -> ScriptedTask:
        self.calls.append((name, arguments))
        self.task = ScriptedTask()
        return self.task


def tick(behaviour: Behaviour, robot: ScriptedRobot, seconds: float = 0.0) -> Status:
    """Tick once now, then every 0.1 s of the robot's clock, until it ends or the time is over.

    A fresh behaviour is set up with the robot first. Returns the status after the last tick.
    """
    if getattr(behaviour, "robot", None) is not robot:
        behaviour.setup(robot=robot)
    behaviour.tick_once()
    for _ in range(round(seconds / TICK_PERIOD)):
        if behaviour.status is not Status.RUNNING:
            break
        robot.advance(TICK_PERIOD)
        behaviour.tick_once()
    return behaviour.status


def halt(behaviour: Behaviour) -> None:
    """End it as a tree does that has found something more important."""
    behaviour.stop(Status.INVALID)


if TYPE_CHECKING:
    _IS_A_ROBOT: Robot = ScriptedRobot()  # the type checker compares every member
