"""The arm and the gripper of a robot: motions as tasks, and what the body is told of them.

A newer motion of the arm cancels the older one; the gripper moves by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import ParameterError
from stack.frames.links import RobotLinks
from stack.lifecycle import Timers
from stack.navigation.tasks import MotionTask
from stack.robot import Arm, Gripper
from stack.types import (
    ArmView,
    CurrentStep,
    FailureCode,
    FloatArray,
    GripperCommand,
    GripperState,
    JointState,
    JointTrajectory,
    Perceived,
)

JOINTS, GRIPPER = "joints", "gripper"
"""Names of the measurements."""

ARRIVED = 0.01
"""Distance of each joint from its goal at which a motion is over, rad or m."""

AT_REST = 0.02
"""Speed below which a joint stands, rad/s or m/s."""

PATIENCE = 2.0
"""Seconds after the planned end in which a motion may still arrive."""

WIDTH_REACHED = 0.001
"""Distance from the wanted width at which the fingers have arrived, m."""

FINGERS_START = 0.15
"""Seconds after which fingers that do not move have been stopped by something."""


class ArmOrders(NamedTuple):
    """What the body is told in a step, as `BodyCommand` means it."""

    trajectory: JointTrajectory | None = None
    gripper: GripperCommand | None = None
    hold_arm: bool = False
    stop_arm: bool = False


class StackArm(Arm):
    """Moves the arm, and answers from the newest measurement of its joints.

    Args:
        robot: with an arm.
        now: what the step has perceived.
        timers: stand still while the arm is held.
    """

    def __init__(self, robot: RobotDescription, now: CurrentStep, timers: Timers) -> None:
        assert robot.arm is not None
        self._timer = timers.new()
        self.description: ArmDescription = robot.arm
        self._now, self._links = now, RobotLinks(robot.links, BASE)
        self._new: JointTrajectory | None = None
        self._stops = False
        self._motion: tuple[MotionTask, JointTrajectory] | None = None

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
        joints = self.joints
        if joints is None:
            return None
        positions = dict(zip(self.joint_names, joints.positions.tolist(), strict=True))
        return self._links.pose(self.description.tool_link, positions)

    def follow(self, trajectory: JointTrajectory) -> MotionTask:
        self._check(trajectory)
        self.cancel("a newer motion of the arm")
        task = MotionTask("move the arm", self._ended)
        self._timer.start(self._now.perceived.time)
        self._motion = task, trajectory
        self._new, self._stops = trajectory, False
        return task

    def cancel(self, why: str = "cancelled") -> None:
        """Cancel the motion; the arm stops."""
        if self._motion is not None:
            self._motion[0].cancel(why)

    def step(self, perceived: Perceived) -> tuple[JointTrajectory | None, bool]:
        """Follow the task; return a new trajectory, and whether the arm shall stop."""
        new, self._new = self._new, None
        if new is None and self._motion is not None:
            self._watch(*self._motion, perceived)
        stops, self._stops = self._stops, False
        return new, stops

    def _watch(self, task: MotionTask, trajectory: JointTrajectory, perceived: Perceived) -> None:
        joints = perceived.newest(JOINTS, JointState)
        if joints is None:
            return
        elapsed = self._timer.elapsed(perceived.time)
        left = max(0.0, trajectory.duration - elapsed)
        task.report(f"{left:.1f} s to go", 0.0)
        errors = np.abs(joints.positions - trajectory.positions[-1])
        if joints.problem:
            task.fail(FailureCode.NO_PROGRESS, joints.problem)
        elif left == 0.0 and errors.max() < ARRIVED and np.abs(joints.velocities).max() < AT_REST:
            task.succeed("arrived")
        elif elapsed > trajectory.duration + PATIENCE:
            worst = int(errors.argmax())
            name, off = self.joint_names[worst], float(errors[worst])
            task.fail(FailureCode.NO_PROGRESS, f"{name} is still {off:.3f} from its goal")

    def _ended(self, task: MotionTask) -> None:
        self._motion, self._new, self._stops = None, None, True

    def _check(self, trajectory: JointTrajectory) -> None:
        """Raise ParameterError for a trajectory that the arm cannot follow."""
        limits, rows = self.description.limits, trajectory.positions
        if rows.ndim != 2 or rows.shape[1] != len(self.joint_names) or len(rows) < 2:
            wanted = f"at least 2 rows of {len(self.joint_names)} positions"
            raise ParameterError("trajectory", f"expected {wanted}, got an array {rows.shape}")
        if trajectory.velocities.shape != rows.shape or trajectory.times.shape != rows.shape[:1]:
            raise ParameterError("trajectory", "times, positions and velocities differ in length")
        if trajectory.times[0] != 0.0 or not (np.diff(trajectory.times) > 0.0).all():
            raise ParameterError("trajectory", "times must rise from 0")
        if np.any(trajectory.velocities[-1]):
            raise ParameterError("trajectory", "it must end at rest")
        outside = (rows < limits.lower - ARRIVED) | (rows > limits.upper + ARRIVED)
        if outside.any():
            row, joint = map(int, np.argwhere(outside)[0])
            raise ParameterError(
                "trajectory",
                f"{self.joint_names[joint]} would go to {rows[row, joint]:.3f}, beyond its limits "
                f"{limits.lower[joint]:g} to {limits.upper[joint]:g}",
            )
        joints = self.joints
        if joints is not None:
            away = np.abs(rows[0] - joints.positions)
            if away.max() > 0.05:
                worst = int(away.argmax())
                raise ParameterError(
                    "trajectory",
                    f"it begins {away[worst]:.3f} from where {self.joint_names[worst]} is",
                    "plan from the measured positions",
                )


class StackGripper(Gripper):
    """Moves the fingers, and answers from their newest measurement.

    Args:
        robot: with a gripper.
        now: what the step has perceived.
        timers: stand still while the robot is held.
    """

    def __init__(self, robot: RobotDescription, now: CurrentStep, timers: Timers) -> None:
        self._timer = timers.new()
        assert robot.arm is not None and robot.arm.gripper is not None
        self._description, self._now = robot.arm.gripper, now
        self._new: GripperCommand | None = None
        self._motion: tuple[MotionTask, GripperCommand] | None = None

    @property
    def state(self) -> GripperState | None:
        return self._now.perceived.newest(GRIPPER, GripperState)

    @property
    def width_max(self) -> float:
        return self._description.width_max

    def move(self, width: float, force: float | None = None) -> MotionTask:
        force = self._description.force_max if force is None else force
        if not 0.0 <= width <= self.width_max:
            raise ParameterError("width", f"{width:g} m must be between 0 and {self.width_max:g}")
        if not 0.0 < force <= self._description.force_max:
            most = self._description.force_max
            raise ParameterError("force", f"{force:g} N must be above 0 and at most {most:g}")
        if self._motion is not None:
            self._motion[0].cancel("a newer motion of the gripper")
        task = MotionTask("move the gripper", self._ended)
        self._timer.start(self._now.perceived.time)
        self._new = GripperCommand(width, force)
        self._motion = task, self._new
        return task

    def step(self, perceived: Perceived) -> GripperCommand | None:
        """Follow the task; return a new command."""
        new, self._new = self._new, None
        if new is None and self._motion is not None:
            self._watch(*self._motion, perceived)
        return new

    def _watch(self, task: MotionTask, wanted: GripperCommand, perceived: Perceived) -> None:
        state = perceived.newest(GRIPPER, GripperState)
        if state is None:
            return
        elapsed, off = self._timer.elapsed(perceived.time), state.width - wanted.width
        limit = self.width_max / self._description.speed + PATIENCE
        task.report(f"{1e3 * state.width:.0f} mm wide", 0.0)
        if abs(off) < WIDTH_REACHED and not state.moving:
            task.succeed(f"{1e3 * state.width:.0f} mm wide")
        elif elapsed > FINGERS_START and not state.moving and off > 0.0 and state.force > 0.0:
            task.succeed(f"holds something, {1e3 * state.width:.0f} mm wide")
        elif elapsed > limit:
            sentence = f"the fingers are {1e3 * abs(off):.0f} mm from the wanted width"
            task.fail(FailureCode.NO_PROGRESS, sentence)

    def _ended(self, task: MotionTask) -> None:
        self._motion, self._new = None, None


class ArmStage:
    """Moves arm and gripper in each step; of a robot without them, nothing.

    Args:
        robot: with or without an arm.
        now: what the step has perceived.

    Attributes:
        arm: None without one.
        gripper: None without one.
    """

    def __init__(self, robot: RobotDescription, now: CurrentStep) -> None:
        self._timers = Timers()
        has_gripper = robot.arm is not None and robot.arm.gripper is not None
        self.arm = None if robot.arm is None else StackArm(robot, now, self._timers)
        self.gripper = StackGripper(robot, now, self._timers) if has_gripper else None

    def step(self, perceived: Perceived, *, held: bool) -> ArmOrders:
        """Return what the body is told in this step; while held, motions stand on their way."""
        if self.arm is None:
            return ArmOrders()
        trajectory, stops = self.arm.step(perceived)
        gripper = None if self.gripper is None else self.gripper.step(perceived)
        return ArmOrders(trajectory, gripper, held, stops)

    def view(self, perceived: Perceived) -> ArmView | None:
        """Return what displays show of the arm; None without one, or before its first joints."""
        joints = perceived.newest(JOINTS, JointState)
        tool = None if self.arm is None else self.arm.tool_pose
        if self.arm is None or joints is None or tool is None:
            return None
        limits, gripper = self.arm.description.limits, perceived.newest(GRIPPER, GripperState)
        fingers = (0.0, 0.0, 0.0)
        if self.gripper is not None and gripper is not None:
            fingers = gripper.width, self.gripper.width_max, gripper.force
        return ArmView(
            self.arm.joint_names, joints.positions, limits.lower, limits.upper,
            not self.is_standing(perceived), tool, joints.problem, *fingers,
        )  # fmt: skip

    def is_standing(self, perceived: Perceived) -> bool:
        """Whether all joints stand, by their newest measurement."""
        joints = perceived.newest(JOINTS, JointState)
        return joints is None or bool(np.abs(joints.velocities).max() < AT_REST)

    def pause(self, now: float) -> None:
        """Let the time limits stand still from a time on, seconds."""
        self._timers.pause(now)

    def resume(self, now: float) -> None:
        """Let them go on."""
        self._timers.resume(now)

    def emergency_stop(self) -> None:
        """End the motion of the arm."""
        if self.arm is not None:
            self.arm.cancel("emergency stop")
