"""Arm and gripper of a robot as a stage of the control loop, and what they allow the base to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from stack.drivetrain.arm_description import HOME
from stack.drivetrain.description import RobotDescription
from stack.lifecycle import Timers
from stack.navigation.capabilities.arm import StackArm
from stack.navigation.capabilities.gripper import StackGripper
from stack.navigation.capabilities.motion_watch import JOINTS
from stack.navigation.capabilities.surroundings import Surroundings
from stack.navigation.motion_stage import DriveInterlock
from stack.navigation.plans.arm_plans import ArmPlans
from stack.navigation.tasks import Emit, MotionTask
from stack.perception.camera_lease import CameraLease
from stack.types import (
    CurrentStep,
    Failure,
    FailureCode,
    GripperCommand,
    JointState,
    JointTrajectory,
    Limitation,
    Perceived,
)
from stack.types.limitations import ARM, STOPPED


class ArmOrders(NamedTuple):
    """What the body is told in a step, as `BodyCommand` means it."""

    trajectory: JointTrajectory | None = None
    gripper: GripperCommand | None = None
    hold_arm: bool = False
    stop_arm: bool = False


class ArmStage(DriveInterlock):
    """Moves arm and gripper in each step; of a robot without them, nothing.

    The base of a robot with an arm drives only while the arm is at `home` and has nothing to do; a
    motion of the base that is asked for before waits, and the arm moves to `home`. A motion of the
    arm is planned once the base stands. A behaviour that claims the arm keeps it until it ends.

    Args:
        robot: with or without an arm.
        now: what the step has perceived.
        plans: of the arm.
        around: what the arm must not touch.
        lease: keeps the depth cameras on, which watch the way of the arm.
        emit: called with (kind, text, level="info", **fields) for each event.

    Attributes:
        arm: None without one.
        gripper: None without one.
    """

    def __init__(  # noqa: PLR0913 - what it is connected with
        self, robot: RobotDescription, now: CurrentStep, plans: ArmPlans,
        around: Surroundings, lease: CameraLease, emit: Emit,
    ) -> None:  # fmt: skip
        self._timers, self._plans = Timers(), plans
        self._homing: tuple[MotionTask, MotionTask] | None = None
        self._is_reserved = False
        has_gripper = robot.arm is not None and robot.arm.gripper is not None
        self.arm = None
        if robot.arm is not None:
            self.arm = StackArm(robot, now, self._timers, plans, around, lease, emit)
        self.gripper = StackGripper(robot, now, self._timers) if has_gripper else None

    def step(self, perceived: Perceived, *, held: bool) -> ArmOrders:
        """Return what the body is told in this step; while held, motions stand on their way."""
        if self.arm is None:
            return ArmOrders()
        trajectory, stops = self.arm.step(perceived, held=held)
        gripper = None if self.gripper is None else self.gripper.step(perceived)
        return ArmOrders(trajectory, gripper, held or self.arm.waits, stops)

    @property
    def limitation(self) -> Limitation | None:
        """Why the arm stands although it wants to move; None if it does not."""
        return None if self.arm is None else self.arm.limitation

    def reserve(self, claims: Iterable[tuple[str, ...]]) -> None:
        """Keep the arm for behaviours that are running; call before the base moves in a step.

        Args:
            claims: what each of them claims. One that claims base and arm decides itself.
        """
        self._is_reserved = any("arm" in parts and "base" not in parts for parts in claims)

    def hindrance(self, perceived: Perceived) -> Limitation | None:
        """As in `DriveInterlock`: the arm has something to do, or is not at `home`."""
        if self.arm is None:
            return None
        if self.arm.is_busy:
            return Limitation(STOPPED, ARM, "the arm moves")
        if self._is_reserved:
            return Limitation(STOPPED, ARM, "a behaviour uses the arm")
        return None if self.arm.is_at_home else Limitation(
            STOPPED, ARM, f"the arm is not at `{HOME}`"
        )  # fmt: skip

    def remove_hindrance(self, perceived: Perceived, task: MotionTask) -> Failure | None:
        """As in `DriveInterlock`: the arm moves to `home` once it has nothing else to do.

        If something else cancels that, the arm begins again.
        """
        if self.arm is None or self.arm.is_busy or self._is_reserved:
            return None
        if self.gripper is not None and self.gripper.is_busy:
            return None
        asked, homing = self._homing or (task, None)
        failure = None if homing is None or asked is not task else homing.failure
        if failure is not None and failure.code != FailureCode.CANCELLED:
            sentence = f"the arm cannot move to `{HOME}`: {failure.sentence}"
            return Failure(failure.code, sentence)
        self._homing = task, self.arm.move_to_posture(HOME)
        return None

    def is_standing(self, perceived: Perceived) -> bool:
        """Whether all joints stand, by their newest measurement."""
        joints = perceived.newest(JOINTS, JointState)
        return joints is None or joints.stands

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

    def await_plans(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for a plan that is due; whether none is late."""
        return self._plans.await_results(now, longest)

    def close(self) -> None:
        """Stop planning."""
        self._plans.close()
