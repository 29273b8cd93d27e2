"""The gripper of a robot: motions of its fingers as tasks."""

from __future__ import annotations

from stack.drivetrain.description import RobotDescription
from stack.errors import ParameterError
from stack.lifecycle import Timers
from stack.navigation.tasks import MotionTask
from stack.robot import Gripper
from stack.types import CurrentStep, FailureCode, GripperCommand, GripperState, Perceived

GRIPPER = "gripper"
"""Name of the measurement."""

PATIENCE = 2.0
"""Seconds after the planned end in which a motion of arm or gripper may still arrive."""

WIDTH_REACHED = 0.001
"""Distance from the wanted width at which the fingers have arrived, m."""

FINGERS_START = 0.15
"""Seconds after which fingers that do not move have been stopped by something."""


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

    @property
    def is_busy(self) -> bool:
        """Whether the fingers are to move."""
        return self._motion is not None

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
