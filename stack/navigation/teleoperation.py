"""Assisted teleoperation: the operator drives, limited by the safety stage."""

from __future__ import annotations

from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.types import STANDSTILL, FailureCode, Perceived, Twist

COMMAND_TIME = 0.5
"""Seconds for which one velocity of the operator is driven."""


class Teleoperation(MotionExecutor):
    """Drives the operator's velocities until release, time limit or silence.

    It does not check for obstacles: the safety stage limits every velocity.

    Args:
        task: handle of the task.
        seconds: time limit for the operator.
        silence: seconds without a velocity command after which the task fails.
    """

    def __init__(self, task: MotionTask, seconds: float, silence: float) -> None:
        super().__init__(task)
        self._seconds, self._silence = seconds, silence
        self._twist = STANDSTILL
        self._now = 0.0
        self._total, self._since_command = self.timers.new(), self.timers.new()

    def steer(self, twist: Twist) -> None:
        """Set the velocity to drive from the next step on, until its timeout."""
        self._twist = twist
        self._since_command.start(self._now)

    def release(self) -> None:
        """End the teleoperation with success; the mission continues."""
        self.task.succeed("released by the operator")

    def start(self, now: float) -> None:
        self._now = now
        self._total.start(now)
        self._since_command.start(now)

    def pause(self, now: float) -> None:
        """Hold the robot, and discard the velocity that was sent before."""
        super().pause(now)
        self._twist = STANDSTILL

    def step(self, perceived: Perceived) -> Twist:
        """Return the operator's velocity, standstill after its timeout."""
        self._now = perceived.time
        left = self._seconds - self._total.elapsed(perceived.time)
        silent = self._since_command.elapsed(perceived.time)
        if left <= 1e-9:
            self.task.fail(
                FailureCode.TIMED_OUT, f"the operator did not finish within {self._seconds:g} s"
            )
        elif silent >= self._silence - 1e-9:
            self.task.fail(
                FailureCode.NO_PROGRESS, f"the operator sent no velocity for {self._silence:g} s"
            )
        else:
            self.task.report(f"the operator drives, {left:.0f} s left", 0.0)
        return self._twist if silent < COMMAND_TIME - 1e-9 else STANDSTILL
