"""Driving at a velocity for a time."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE, DrivingBehaviour
from behaviours.base import port
from stack.types import Twist


class DriveFor(DrivingBehaviour):
    """Drive at a velocity for a time; the safety stage may slow the robot down."""

    time: float = port("duration", unit="s", above=0.0)
    linear: float = port("forward speed; negative: backward", unit="m/s", default=0.0)
    angular: float = port("angular speed, positive to the left", unit="rad/s", default=0.0)

    claims = ("base",)

    def initialise(self) -> None:
        self._timer = self.start_timer()

    def update(self) -> Status:
        if self._timer.is_over(self.time):
            return Status.SUCCESS
        left = self._timer.left(self.time)
        self.robot.base.drive_for(Twist(self.linear, self.angular), min(left, TIME_TO_LIVE))
        self.feedback_message = f"{left:.1f} s left"
        return Status.RUNNING
