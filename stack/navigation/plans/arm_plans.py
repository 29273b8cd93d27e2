"""Plans of an arm outside the control loop, used at a fixed latency."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.manipulation.collisions import Collisions
from stack.manipulation.grasps import SUPPORT, grasps
from stack.manipulation.model import ArmModel
from stack.manipulation.places import place
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Scene
from stack.navigation.plans.deferred import Deferred, DeferringWorker
from stack.streams import stream
from stack.types import FloatArray, GraspPlan, JointTrajectory, PlacePlan

T = TypeVar("T")

LATENCY = 0.5
"""Seconds from a request to its result, on the robot's clock; 95 of 100 plans take less."""


@dataclass(frozen=True)
class PlanInput:
    """Where a plan begins, and what is around.

    Attributes:
        start: (n,) positions of the joints, at rest.
        scene: what must not be touched.
        generator: of its samples.
    """

    start: FloatArray
    scene: Scene
    generator: np.random.Generator


Job = Callable[[ArmPlanner, PlanInput], T]
"""Plans something; raises NavigationError."""


class ArmPlans(DeferringWorker):
    """Plans one request at a time. The model of the arm is read with the first one.

    Args:
        robot: with an arm.
        seed: of the run.
        log: receives tracebacks.
        is_real_time: results are used when they come.
    """

    def __init__(
        self, robot: RobotDescription, seed: int, log: Callable[[str], None], *, is_real_time: bool
    ) -> None:
        super().__init__("the planner of the arm", log, is_real_time=is_real_time)
        self._robot, self._seed, self._count = robot, seed, 0
        self._planner: ArmPlanner | None = None

    @staticmethod
    def kernels() -> KernelTypes:
        """Compiled functions of a plan."""
        from stack.manipulation.kernels import TIME_LAW

        return TIME_LAW

    def ask(self, job: Job[T], start: FloatArray, scene: Scene, now: float) -> Deferred[T]:
        """Submit a job; its result is due `LATENCY` after now, seconds on the robot's clock."""
        self._count += 1
        given = PlanInput(start, scene, stream(self._seed, "arm", self._count))
        submitted = self.deferral.worker.submit(partial(self._carry_out, job, given))
        return self.keep(Deferred(submitted, now + LATENCY, self.deferral))

    def _carry_out(self, job: Job[T], given: PlanInput) -> T:
        robot = self._robot
        if self._planner is None:
            assert robot.arm is not None
            self._planner = ArmPlanner(ArmModel(robot.model, robot.arm, links=robot.links))
        return job(self._planner, given)


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
