"""The arm and the gripper of a robot: motions as tasks, and what the body is told of them.

A newer motion of the arm cancels the older one; the gripper moves by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from stack.drivetrain.arm_description import HOME, ArmDescription
from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import ParameterError
from stack.frames.links import RobotLinks
from stack.frames.tree import inverse, lifted
from stack.lifecycle import Timers
from stack.manipulation.scene import Scene
from stack.navigation.capabilities.gripper import GRIPPER, PATIENCE
from stack.navigation.capabilities.surroundings import Surroundings
from stack.navigation.capabilities.trajectory_check import ARRIVED, check_trajectory
from stack.navigation.plans.arm_plans import ArmPlans, Job, to_grasp, to_joints, to_place, to_pose
from stack.navigation.plans.deferred import Deferred
from stack.navigation.tasks import MotionTask
from stack.parameters import suggestion
from stack.robot import Arm
from stack.types import (
    Block,
    CurrentStep,
    Failure,
    FailureCode,
    FloatArray,
    GraspPlan,
    GripperState,
    JointState,
    JointTrajectory,
    Perceived,
    PlacePlan,
)

JOINTS = "joints"
"""Name of the measurement."""

AT_HOME = 0.1
"""Distance of each joint from `home` up to which the base may drive, rad or m."""

STANDS_WITHIN = 10.0
"""Seconds in which arm and base come to rest before a motion: a heavy base needs some."""


@dataclass
class _Planning:
    """A task that waits for a plan; the job is submitted once the arm stands."""

    task: MotionTask
    job: Job[Any]
    use: Callable[[Any], None]
    answer: Deferred[Any] | None = None


class PlannedGrasps(MotionTask):
    """A search for grasps."""

    grasps: tuple[GraspPlan, ...] = ()


class PlannedPlace(MotionTask):
    """A search for a place."""

    place: PlacePlan | None = None


class StackArm(Arm):
    """Moves the arm, and answers from the newest measurement of its joints.

    Args:
        robot: with an arm.
        now: what the step has perceived.
        timers: stand still while the arm is held.
        plans: of its motions.
        around: what it must not touch.

    Attributes:
        description: of the arm.
        links: of the robot.
        around: what it must not touch.
        grasps: the last ones that were found, until a block is held.
    """

    def __init__(
        self, robot: RobotDescription, now: CurrentStep, timers: Timers, plans: ArmPlans,
        around: Surroundings,
    ) -> None:  # fmt: skip
        assert robot.arm is not None
        self._timer = timers.new()
        self.description: ArmDescription = robot.arm
        self._now, self.links = now, RobotLinks(robot.links, BASE)
        self._plans, self.around = plans, around
        self.grasps: tuple[GraspPlan, ...] = ()
        self._new: JointTrajectory | None = None
        self._stops = False
        self._planning: _Planning | None = None
        self._motion: tuple[MotionTask, JointTrajectory] | None = None
        self._waiting: tuple[MotionTask, JointTrajectory] | None = None

    @property
    def joint_names(self) -> tuple[str, ...]:
        return self.description.joints

    @property
    def postures(self) -> Mapping[str, FloatArray]:
        return MappingProxyType(dict(self.description.postures))

    @property
    def joints(self) -> JointState | None:
        return self._now.perceived.newest(JOINTS, JointState)

    @property
    def tool_pose(self) -> FloatArray | None:
        in_base = self.tool_in_base
        if in_base is None:
            return None
        return inverse(self.base_from_link) @ in_base

    @property
    def tool_in_base(self) -> FloatArray | None:
        """Measured pose (4, 4) of the tool in the base frame, metres."""
        joints = self.joints
        if joints is None:
            return None
        positions = dict(zip(self.joint_names, joints.positions.tolist(), strict=True))
        return self.links.pose(self.description.tool_link, positions)

    @property
    def blocks(self) -> Mapping[str, Block]:
        link = inverse(self._odom_from_link)
        return MappingProxyType(
            {name: _moved(block, link) for name, block in self.around.blocks.items()}
        )

    @property
    def held(self) -> Block | None:
        tool = self.tool_pose
        return None if tool is None else self.around.held_at(tool)

    def box(self, name: str) -> tuple[FloatArray, FloatArray]:
        return self.around.box(name, self._link_from_map)

    def see(self, blocks: Iterable[Block], gone: Iterable[Block] = ()) -> tuple[Block, ...]:
        base = self._odom_from_link
        found = self.around.see(
            [_moved(block, base) for block in blocks], [_moved(block, base) for block in gone],
            self._tool_in_odom, base @ self._link_from_map,
        )  # fmt: skip
        return tuple(_moved(block, inverse(base)) for block in found)

    def hold(self, block: Block, width: float) -> None:
        tool = self._tool_in_odom
        assert tool is not None, "a grasp was measured"
        self.around.hold(_moved(block, self._odom_from_link), tool, width)
        self.grasps = ()

    def release(self, *, lost: bool = False) -> None:
        tool = self._tool_in_odom
        if lost or tool is None:
            self.around.lose()
        else:
            self.around.release(tool)

    @property
    def is_busy(self) -> bool:
        """Whether a motion or a search for grasps is planned or under way."""
        return any(it is not None for it in (self._planning, self._waiting, self._motion))

    @property
    def is_at_home(self) -> bool:
        """Whether the measured joints are at the posture `home`; no, before they are measured."""
        joints, home = self.joints, self.description.postures[HOME]
        return joints is not None and bool(np.abs(joints.positions - home).max() < AT_HOME)

    def follow(self, trajectory: JointTrajectory) -> MotionTask:
        check_trajectory(trajectory, self.description, self.joints)
        self.cancel("a newer motion of the arm")
        task = MotionTask("move the arm", self._ended)
        self._waiting = task, trajectory
        self._timer.start(self._now.perceived.time)
        self._begin_once_standing(self._now.perceived)
        return task

    def move_joints(self, positions: FloatArray, *, speed: float = 1.0) -> MotionTask:
        goal = np.array(positions, dtype=np.float64)
        if goal.shape != (len(self.joint_names),):
            wanted = f"expected {len(self.joint_names)} positions, got an array {goal.shape}"
            raise ParameterError("positions", wanted)
        return self._plan(MotionTask("move the arm", self._ended),
                          partial(to_joints, goal=goal, speed=speed))  # fmt: skip

    def move_to_posture(self, name: str, *, speed: float = 1.0) -> MotionTask:
        if name not in self.postures:
            hint = suggestion(name, self.postures)
            raise ParameterError("posture", f"the arm has no posture {name!r}", hint)
        return self.move_joints(self.postures[name], speed=speed)

    def move_tool(
        self, pose: FloatArray, *, straight: bool = False, touching: Iterable[Block | str] = (),
        width: float | None = None, speed: float = 1.0,
    ) -> MotionTask:  # fmt: skip
        names = (it if isinstance(it, str) else self._name_of(it) for it in touching)
        job = partial(
            to_pose, goal=pose.copy(), straight=straight, touching=tuple(names), width=width,
            speed=speed,
        )  # fmt: skip
        return self._plan(MotionTask("move the tool", self._ended), job)

    def plan_grasps(self, block: Block) -> PlannedGrasps:
        task = PlannedGrasps("look for grasps", self._ended)

        def keep(found: tuple[GraspPlan, ...]) -> None:
            task.grasps = self.grasps = found
            task.succeed(f"{len(found)} grasps")

        self._plan(task, partial(to_grasp, block=self._name_of(block)), keep)
        return task

    def plan_place(
        self, tools: Sequence[FloatArray], *, above: float, width: float
    ) -> PlannedPlace:
        task = PlannedPlace("look for a place", self._ended)

        def keep(found: PlacePlan) -> None:
            task.place = found
            task.succeed("a place")

        self._plan(task, partial(to_place, tools=tuple(tools), above=above, width=width), keep)
        return task

    def cancel(self, why: str = "cancelled") -> None:
        """Cancel the motion; the arm stops."""
        for begun in (self._motion, self._waiting):
            if begun is not None:
                begun[0].cancel(why)
        if self._planning is not None:
            self._planning.task.cancel(why)

    def step(self, perceived: Perceived, *, held: bool) -> tuple[JointTrajectory | None, bool]:
        """Follow the task; return a new trajectory, and whether the arm shall stop."""
        if not held:
            self._prepare(perceived)
            self._begin_once_standing(perceived)
        new, self._new = self._new, None
        if new is None and self._motion is not None:
            self._watch(*self._motion, perceived)
        stops, self._stops = self._stops, False
        return new, stops

    @property
    def motion(self) -> JointTrajectory | None:
        """What it moves along now; None while it rests or plans."""
        return None if self._motion is None else self._motion[1]

    def _plan(
        self, task: MotionTask, job: Job[Any], use: Callable[[Any], None] | None = None
    ) -> MotionTask:
        self.cancel("a newer motion of the arm")
        self._planning = _Planning(task, job, use or partial(self._begin, task))
        self._timer.start(self._now.perceived.time)
        task.report("planning", 0.0)
        return task

    def _prepare(self, perceived: Perceived) -> None:
        """Ask for the plan once arm and base stand; use it when it is due."""
        planning, now = self._planning, perceived.time
        if planning is None:
            return
        if planning.answer is None:
            joints = perceived.newest(JOINTS, JointState)
            if joints is None:
                self._keep_waiting(planning.task, "the joints are not measured", now)
            elif not joints.stands:
                self._keep_waiting(planning.task, "the arm does not come to rest", now)
            elif not perceived.motion.twist.stands:
                self._keep_waiting(planning.task, "the base does not come to rest", now)
            else:
                scene = self._scene(perceived)
                planning.answer = self._plans.ask(planning.job, joints.positions, scene, now)
            return
        answer = planning.answer.result(now)
        if isinstance(answer, Failure):
            planning.task.fail(answer.code, answer.sentence)
        elif answer is not None:
            self._planning = None
            planning.use(answer)

    def _scene(self, perceived: Perceived) -> Scene:
        """Return what surrounds the arm, in the frame of its base link."""
        spread, fingers = perceived.estimate.covariance, perceived.newest(GRIPPER, GripperState)
        place = float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))
        return self.around.scene(
            self._link_from_map, inverse(self._odom_from_link),
            None if fingers is None else fingers.width, (place, float(spread[2, 2]) ** 0.5),
        )  # fmt: skip

    def _begin_once_standing(self, perceived: Perceived) -> None:
        """Begin a motion that needs no plan if the base stands."""
        if self._waiting is None:
            return
        task, trajectory = self._waiting
        if perceived.motion.twist.stands:
            self._waiting = None
            self._begin(task, trajectory)
        else:
            self._keep_waiting(task, "the base does not come to rest", perceived.time)

    def _keep_waiting(self, task: MotionTask, why: str, now: float) -> None:
        """Fail a task that has waited too long for arm and base to stand."""
        if self._timer.elapsed(now) > STANDS_WITHIN:
            task.fail(FailureCode.NO_PROGRESS, f"{why} within {STANDS_WITHIN:g} s")

    def _begin(self, task: MotionTask, trajectory: JointTrajectory) -> None:
        self._timer.start(self._now.perceived.time)
        self._motion = task, trajectory
        self._new, self._stops = trajectory, False

    @property
    def base_from_link(self) -> FloatArray:
        """Pose (4, 4) of the arm's base link in the base frame, metres."""
        return self.links.pose(self.description.base_link, {})

    @property
    def _link_from_map(self) -> FloatArray:
        """(4, 4) base link <- map."""
        return inverse(lifted(self._now.perceived.estimate.pose) @ self.base_from_link)

    @property
    def _odom_from_link(self) -> FloatArray:
        """(4, 4) odom <- base link."""
        return lifted(self._now.perceived.motion.pose) @ self.base_from_link

    @property
    def _tool_in_odom(self) -> FloatArray | None:
        """(4, 4) of the tool in the odom frame; None before its joints are measured."""
        tool = self.tool_pose
        return None if tool is None else self._odom_from_link @ tool

    def _name_of(self, block: Block) -> str:
        """Return the name of a block, base link."""
        return self.around.name_of(_moved(block, self._odom_from_link))

    def _watch(self, task: MotionTask, trajectory: JointTrajectory, perceived: Perceived) -> None:
        joints, elapsed = perceived.newest(JOINTS, JointState), self._timer.elapsed(perceived.time)
        assert joints is not None, "every motion begins at measured positions"
        left = max(0.0, trajectory.duration - elapsed)
        task.report(f"{left:.1f} s to go", 0.0)
        errors = np.abs(joints.positions - trajectory.positions[-1])
        if joints.problem:
            task.fail(FailureCode.ARM_COLLISION, joints.problem)
        elif left == 0.0 and errors.max() < ARRIVED and joints.stands:
            task.succeed("arrived")
        elif elapsed > trajectory.duration + PATIENCE:
            worst = int(errors.argmax())
            name, off = self.joint_names[worst], float(errors[worst])
            task.fail(FailureCode.NO_PROGRESS, f"{name} is still {off:.3f} from its goal")

    def _ended(self, task: MotionTask) -> None:
        if self._planning is not None:
            if self._planning.answer is not None:
                self._planning.answer.drop()
            self._planning = None
        self._waiting = None
        if self._motion is not None:
            self._motion, self._new, self._stops = None, None, True


def _moved(block: Block, transform: FloatArray) -> Block:
    """Return a block in another frame, given the transform (4, 4) from its own."""
    return replace(block, pose=transform @ block.pose)
