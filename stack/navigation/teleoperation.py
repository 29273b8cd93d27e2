"""The operator drives for a while; the safety stage cuts what would touch something."""

from __future__ import annotations

from stack.navigation.tasks import MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Twist

TIME_TO_LIVE = 0.5
"""Seconds on the robot's clock that one velocity of the operator is driven for."""


class Teleoperation:
    """Drives the velocities that come in, until released, out of time, or left alone too long.

    What comes near is none of its business: the safety stage behind it has the last word on every
    velocity, whoever wishes it.

    Args:
        task: its handle.
        seconds: that the operator has.
        silence: seconds without a velocity after which nobody is believed to be there.
    """

    def __init__(self, task: MotionTask, seconds: float, silence: float) -> None:
        self.task = task
        self._seconds, self._silence = seconds, silence
        self._twist = STANDSTILL
        self._now = 0.0
        self._began: float | None = None
        self._heard_at = 0.0

    def steer(self, twist: Twist) -> None:
        """Drive this from the next step on; lives half a second."""
        self._twist, self._heard_at = twist, self._now

    def let_go(self) -> None:
        """Forget the velocity: after a pause or an emergency stop none is driven from before."""
        self._twist = STANDSTILL

    def release(self) -> None:
        """The operator is done: the mission goes on."""
        self.task.succeed("released by the operator")

    def advance(self, state: NavigationState) -> Twist:
        """The operator's velocity while it lives."""
        self._now = state.time
        if self._began is None:
            self._began = self._heard_at = state.time
        left = self._seconds - (state.time - self._began)
        unheard = state.time - self._heard_at
        if left <= 1e-9:
            self.task.fail(
                FailureCode.TIMED_OUT, f"the operator was not done after {self._seconds:g} s"
            )
        elif unheard >= self._silence - 1e-9:
            self.task.fail(
                FailureCode.NO_PROGRESS, f"the operator sent no velocity for {self._silence:g} s"
            )
        else:
            self.task.report(f"the operator drives, {left:.0f} s left", 0.0)
        return self._twist if unheard < TIME_TO_LIVE - 1e-9 else STANDSTILL
