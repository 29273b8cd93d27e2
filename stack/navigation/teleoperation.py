"""Assisted teleoperation: the operator drives, limited by the safety stage."""

from __future__ import annotations

from stack.navigation.tasks import MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Twist

TIME_TO_LIVE = 0.5
"""Seconds on the robot's clock for which one velocity command is driven."""


class Teleoperation:
    """Drives the operator's velocities until release, time limit or silence.

    It does not check for obstacles: the safety stage limits every velocity.

    Args:
        task: handle of the task.
        seconds: time limit for the operator.
        silence: seconds without a velocity command after which the task fails.
    """

    def __init__(self, task: MotionTask, seconds: float, silence: float) -> None:
        self.task = task
        self._seconds, self._silence = seconds, silence
        self._twist = STANDSTILL
        self._now = 0.0
        self._began: float | None = None
        self._received_at = 0.0

    def steer(self, twist: Twist) -> None:
        """Set the velocity to drive from the next step on, for TIME_TO_LIVE seconds."""
        self._twist, self._received_at = twist, self._now

    def discard_velocity(self) -> None:
        """Discard the velocity; used by pauses and emergency stops."""
        self._twist = STANDSTILL

    def release(self) -> None:
        """End the teleoperation with success; the mission continues."""
        self.task.succeed("released by the operator")

    def advance(self, state: NavigationState) -> Twist:
        """Return the operator's velocity, standstill after its time to live."""
        self._now = state.time
        if self._began is None:
            self._began = self._received_at = state.time
        left = self._seconds - (state.time - self._began)
        silent = state.time - self._received_at
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
        return self._twist if silent < TIME_TO_LIVE - 1e-9 else STANDSTILL
