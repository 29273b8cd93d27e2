"""Plans of an arm outside the control loop, used at a fixed latency."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.manipulation.collisions import Collisions
from stack.manipulation.grasps import SUPPORT, grasps
from stack.manipulation.measured import CELL, SOMETHING, ArmPicture, MeasuredPoints
from stack.manipulation.model import ArmModel
from stack.manipulation.places import place
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Scene, ScenePoints
from stack.navigation.plans.deferred import Deferred, DeferringWorker
from stack.streams import stream
from stack.types import FloatArray, GraspPlan, JointTrajectory, PlacePlan

T = TypeVar("T")

WATCH_LATENCY = 0.1
"""Seconds from a picture to what it says about a motion."""

NEAR = 0.08
"""Metres from the way within which something new stops the arm: it moves while pictures are taken
and compared, and the arm brakes."""

LATENCY = 0.5
"""Seconds from a request to its result, on the robot's clock; 95 of 100 plans take less."""


@dataclass(frozen=True)
class PlanInput:
    """Where a plan begins, and what is around.

    Attributes:
        start: (n,) positions of the joints, at rest.
        scene: what must not be touched, measured points included.
        generator: of its samples.
    """

    start: FloatArray
    scene: Scene
    generator: np.random.Generator


@dataclass(frozen=True)
class Obstructed:
    """There is a plan, but what the cameras see now is in its way."""

    sentence: str


@dataclass(frozen=True)
class Way:
    """The rest of a motion.

    Attributes:
        positions: (k, n) of the joints, the first one now.
        known: time of the newest picture when it was planned, seconds.
    """

    positions: FloatArray
    known: float


Job = Callable[[ArmPlanner, PlanInput], T]
"""Plans something; raises NavigationError."""


class ArmPlans(DeferringWorker):
    """Plans one request at a time. The model of the arm is read with the first one.

    Args:
        robot: with an arm.
        seed: of the run.
        log: receives tracebacks.
        is_real_time: results are used when they come.

    Attributes:
        newest_picture: time of the newest one that a plan knows, seconds.
    """

    def __init__(
        self, robot: RobotDescription, seed: int, log: Callable[[str], None], *, is_real_time: bool
    ) -> None:
        super().__init__("the planner of the arm", log, is_real_time=is_real_time)
        self._robot, self._seed, self._count = robot, seed, 0
        self._planner: ArmPlanner | None = None
        self._measured: MeasuredPoints | None = None
        self.newest_picture = -np.inf

    @staticmethod
    def kernels() -> KernelTypes:
        """Compiled functions of a plan."""
        from stack.manipulation.kernels import TIME_LAW

        return TIME_LAW

    def ask(
        self, job: Job[T], start: FloatArray, scene: Scene, now: float,
        pictures: Sequence[ArmPicture] = (),
    ) -> Deferred[T | Obstructed]:  # fmt: skip
        """Submit a job; its result is due `LATENCY` after now, seconds on the robot's clock.

        Args:
            job: to be done.
            start: (n,) positions of the joints, at rest.
            scene: what is known around the arm.
            now: seconds.
            pictures: of depth cameras that no job has had yet.
        """
        stamps = (picture.image.stamp for picture in pictures)
        self.newest_picture = max(stamps, default=self.newest_picture)
        self._count += 1
        given = PlanInput(start, scene, self._stream())
        submitted = self.deferral.worker.submit(partial(self._carry_out, job, given, pictures))
        return self.keep(Deferred(submitted, now + LATENCY, self.deferral))

    def compare(
        self, way: Way, scene: Scene, pictures: Sequence[ArmPicture], now: float
    ) -> Deferred[str]:
        """Compare pictures with the rest of a motion.

        Args:
            way: the motion.
            scene: what is known around the arm.
            pictures: of depth cameras that no job has had yet.
            now: seconds.

        Returns:
            What comes near to what, due `WATCH_LATENCY` after now; empty: the way is free.
        """
        submitted = self.deferral.worker.submit(partial(self._compare, way, scene, pictures))
        return self.keep(Deferred(submitted, now + WATCH_LATENCY, self.deferral))

    def _stream(self) -> np.random.Generator:
        return stream(self._seed, "arm", self._count)

    def _carry_out(
        self, job: Job[T], given: PlanInput, pictures: Sequence[ArmPicture]
    ) -> T | Obstructed:
        planner, measured = self._ready(given.scene, pictures)
        if not len(measured.points):
            return job(planner, given)
        try:
            return job(planner, replace(given, scene=measured.added_to(given.scene)))
        except NavigationError as error:
            job(planner, replace(given, generator=self._stream()))  # may raise the true reason
            return Obstructed(error.failure.sentence)

    def _compare(self, way: Way, scene: Scene, pictures: Sequence[ArmPicture]) -> str:
        planner, measured = self._ready(scene, pictures)
        new = measured.since(way.known)
        if not len(new):
            return ""
        alone = replace(scene, objects=(), points=(ScenePoints(SOMETHING, new, CELL),))
        checks = Collisions(planner.model, alone, NEAR, itself=False)
        moved = np.abs(np.diff(way.positions, axis=0)) @ planner.model.reach
        steps = np.floor(np.concatenate(([0.0], moved.cumsum())) / NEAR)
        rows = np.flatnonzero(np.diff(steps, prepend=-1.0))
        for positions in way.positions[rows]:
            if (near := checks.pair_at(positions)) is not None:
                return f"{near.other} is in the way of {near.link}"
        return ""

    def _ready(
        self, scene: Scene, pictures: Sequence[ArmPicture]
    ) -> tuple[ArmPlanner, MeasuredPoints]:
        """Return the planner, and the measured points with those of new pictures."""
        robot = self._robot
        if self._planner is None:
            assert robot.arm is not None
            self._planner = ArmPlanner(ArmModel(robot.model, robot.arm, links=robot.links))
        if self._measured is None:
            self._measured = MeasuredPoints(self._planner.model)
        for picture in pictures:
            self._measured.see(picture, scene)
        return self._planner, self._measured


def to_joints(
    planner: ArmPlanner, given: PlanInput, *, goal: FloatArray, speed: float
) -> JointTrajectory:
    """Plan to positions (n,) of the joints."""
    scene = _leaving(planner, given)
    waypoints = planner.plan(given.start, [goal], scene, given.generator)
    return planner.trajectory(waypoints, scene, speed)


def to_pose(  # noqa: PLR0913 - what a motion of the tool is
    planner: ArmPlanner, given: PlanInput, *, goal: FloatArray, straight: bool,
    touching: tuple[str, ...], width: float | None, speed: float,
) -> JointTrajectory:  # fmt: skip
    """Plan to a pose (4, 4) of the tool in the base link.

    Args:
        planner: of the arm.
        given: where it begins.
        goal: the pose.
        straight: along a line.
        touching: names of objects that the fingers and what they hold may touch.
        width: between the fingers, metres, for which there is room; None: as they are.
        speed: share of the arm's top speed.
    """
    scene = _leaving(planner, given)
    scene = scene if width is None else replace(scene, width=width)
    gripper = planner.model.description.gripper
    parts = () if gripper is None else gripper.finger_links
    held = () if scene.held is None else (scene.held.name,)
    scene = scene.touching(*((part, name) for part in (*parts, *held) for name in touching))
    if straight:
        waypoints = planner.straight(given.start, goal, scene)
    else:
        waypoints = planner.plan_to_pose(given.start, goal, scene, given.generator)
    return planner.trajectory(waypoints, scene, speed)


def to_grasp(planner: ArmPlanner, given: PlanInput, *, block: str) -> tuple[GraspPlan, ...]:
    """Return the grasps of a block of the scene, the best first."""
    found = grasps(planner, block, given.scene, given.start, given.generator)
    forward = planner.kinematics.forward
    return tuple(
        GraspPlan(one.name, one.pre_grasp, one.tool, forward(one.lift[-1]), one.width, one.opening)
        for one in found
    )


def to_place(
    planner: ArmPlanner, given: PlanInput, *, tools: tuple[FloatArray, ...], above: float,
    width: float,
) -> PlacePlan:  # fmt: skip
    """Return the first of some poses of the tool (4, 4) where the held block can be put down."""
    scene = _leaving(planner, given)
    return place(planner, tools, above, width, scene, given.start, given.generator)


def _leaving(planner: ArmPlanner, given: PlanInput) -> Scene:
    """Return the scene in which a held block may touch what it stands on at the start."""
    scene = given.scene
    if scene.held is None:
        return scene
    name = scene.held.name
    supports = Collisions(planner.model, scene).near(name, given.start, SUPPORT)
    return scene.touching(*((name, other) for other in supports))
