"""The arm and the gripper of a robot: motions as tasks, and what the body is told of them.

A newer motion of the arm cancels the older one; the gripper moves by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np

from stack.drivetrain.arm_description import HOME, ArmDescription
from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import ParameterError
from stack.frames.links import RobotLinks
from stack.frames.tree import inverse, lifted
from stack.lifecycle import Timers
from stack.manipulation.scene import Scene
from stack.navigation.capabilities.arm_motion import ArmMotion
from stack.navigation.capabilities.gripper import GRIPPER
from stack.navigation.capabilities.motion_watch import JOINTS, MotionWatch
from stack.navigation.capabilities.surroundings import Surroundings
from stack.navigation.capabilities.trajectory_check import check_trajectory
from stack.navigation.plans.arm_plans import ArmPlans, Job, to_grasp, to_joints, to_place, to_pose
from stack.navigation.tasks import Emit, MotionTask
from stack.parameters import suggestion
from stack.perception.camera_lease import CameraLease
from stack.robot import Arm
from stack.types import (
    Block,
    CurrentStep,
    FailureCode,
    FloatArray,
    GraspPlan,
    GripperState,
    JointState,
    JointTrajectory,
    Limitation,
    Perceived,
    PlacePlan,
)

LOST = 0.5
"""Share of the width of a held block below which the fingers do not hold it any more."""

AT_HOME = 0.1
"""Distance of each joint from `home` up to which the base may drive, rad or m."""


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
        lease: keeps the depth cameras on.
        emit: called with (kind, text, level="info", **fields) for each event.

    Attributes:
        description: of the arm.
        links: of the robot.
        around: what it must not touch.
        grasps: the last ones that were found, until a block is held.
    """

    def __init__(  # noqa: PLR0913 - what it is connected with
        self, robot: RobotDescription, now: CurrentStep, timers: Timers, plans: ArmPlans,
        around: Surroundings, lease: CameraLease, emit: Emit,
    ) -> None:  # fmt: skip
        assert robot.arm is not None
        self.description: ArmDescription = robot.arm
        self._now, self.links, self.around = now, RobotLinks(robot.links, BASE), around
        self.grasps: tuple[GraspPlan, ...] = ()
        self._emit = emit
        self._camera_in_tool = _camera_in_tool(robot, robot.arm.tool_link, self.links)
        cameras = {name: bool(it.link) for name, it in robot.depth_cameras.items()}
        watch = MotionWatch(cameras, robot.arm, self._places, plans, lease)
        self._motion = ArmMotion(robot.arm, now, timers, plans, watch, self._scene)

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
    def camera_in_tool(self) -> FloatArray | None:
        return self._camera_in_tool

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

    def tell(self, did: str, text: str, **fields: float | str) -> None:
        level = "warning" if did == "lost" else "info"
        self._emit("arm", text, level=level, did=did, **fields)

    @property
    def is_busy(self) -> bool:
        """Whether a motion or a search for grasps is planned or under way."""
        return self._motion.is_busy

    @property
    def is_at_home(self) -> bool:
        """Whether the measured joints are at the posture `home`; no, before they are measured."""
        joints, home = self.joints, self.description.postures[HOME]
        return joints is not None and bool(np.abs(joints.positions - home).max() < AT_HOME)

    def follow(self, trajectory: JointTrajectory, *, fixed: bool = True) -> MotionTask:
        check_trajectory(trajectory, self.description, self.joints)
        task = MotionTask("move the arm", self._motion.ended)
        end = trajectory.positions[-1]
        self._motion.follow(
            task, trajectory, None if fixed else partial(to_joints, goal=end, speed=1.0)
        )
        return task

    def move_joints(self, positions: FloatArray, *, speed: float = 1.0) -> MotionTask:
        goal = np.array(positions, dtype=np.float64)
        if goal.shape != (len(self.joint_names),):
            wanted = f"expected {len(self.joint_names)} positions, got an array {goal.shape}"
            raise ParameterError("positions", wanted)
        return self._plan("move the arm", partial(to_joints, goal=goal, speed=speed))

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
        return self._plan("move the tool", job)

    def plan_grasps(self, block: Block) -> PlannedGrasps:
        task = PlannedGrasps("look for grasps", self._motion.ended)

        def keep(found: tuple[GraspPlan, ...]) -> None:
            task.grasps = self.grasps = found
            task.succeed(f"{len(found)} grasps")

        self._motion.plan(task, partial(to_grasp, block=self._name_of(block)), keep)
        return task

    def plan_place(
        self, tools: Sequence[FloatArray], *, above: float, width: float
    ) -> PlannedPlace:
        task = PlannedPlace("look for a place", self._motion.ended)

        def keep(found: PlacePlan) -> None:
            task.place = found
            task.succeed("a place")

        job = partial(to_place, tools=tuple(tools), above=above, width=width)
        self._motion.plan(task, job, keep)
        return task

    def cancel(self, why: str = "cancelled") -> None:
        """Cancel the motion; the arm stops."""
        self._motion.cancel(why)

    def step(self, perceived: Perceived, *, held: bool) -> tuple[JointTrajectory | None, bool]:
        """Follow the task; return a new trajectory, and whether the arm shall stop."""
        self._watch_hand(perceived)
        return self._motion.step(perceived, held=held)

    @property
    def motion(self) -> JointTrajectory | None:
        """What it moves along now; None while it rests or plans."""
        return self._motion.trajectory

    @property
    def waits(self) -> bool:
        """Whether it stands on its way because something is in it."""
        return self._motion.waits

    @property
    def limitation(self) -> Limitation | None:
        """Why it stands although it wants to move; None if it does not."""
        return self._motion.limitation

    def _watch_hand(self, perceived: Perceived) -> None:
        """Stop a motion when the fingers close because the block between them is lost."""
        held, fingers = self.around.held, perceived.newest(GRIPPER, GripperState)
        if held is None or fingers is None or self.motion is None:
            return
        if fingers.width < LOST * held.width:
            self.around.lose()
            sentence = f"the {held.block.colour} block was lost"
            self.tell("lost", sentence, colour=held.block.colour)
            self._motion.fail(FailureCode.SLIPPED, sentence)

    def _plan(self, what: str, job: Job[JointTrajectory]) -> MotionTask:
        task = MotionTask(what, self._motion.ended)
        self._motion.plan(task, job)
        return task

    def _scene(self, perceived: Perceived) -> Scene:
        """Return what surrounds the arm, in the frame of its base link."""
        spread, fingers = perceived.estimate.covariance, perceived.newest(GRIPPER, GripperState)
        place = float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))
        return self.around.scene(
            self._link_from_map, inverse(self._odom_from_link),
            None if fingers is None else fingers.width, (place, float(spread[2, 2]) ** 0.5),
        )  # fmt: skip

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

    def _places(self) -> tuple[FloatArray, FloatArray]:
        return inverse(self.base_from_link), self._odom_from_link


def _moved(block: Block, transform: FloatArray) -> Block:
    """Return a block in another frame, given the transform (4, 4) from its own."""
    return replace(block, pose=transform @ block.pose)


def _camera_in_tool(robot: RobotDescription, tool: str, links: RobotLinks) -> FloatArray | None:
    """Return the pose (4, 4) in the tool of a camera that moves with it; None without one."""
    for camera in (robot.camera, *robot.depth_cameras.values()):
        if camera is None or not camera.link:
            continue
        if links.chain(camera.link).names == links.chain(tool).names:
            in_base = links.pose(camera.link, {}) @ camera.model.base_from_optical()
            return inverse(links.pose(tool, {})) @ in_base
    return None
