"""Drive at a velocity for a time."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import STANDSTILL, Twist

TIME_TO_LIVE = 0.3
"""Seconds one command lasts: three ticks, so that a late tick does not make the robot stutter."""
ROUNDING = 1e-9


class DriveFor(RobotBehaviour):
    """Drive at a velocity for a time; safety may slow the robot down meanwhile."""

    time: float = port("how long", unit="s", above=0.0)
    linear: float = port("speed forward; negative is backward", unit="m/s", default=0.0)
    angular: float = port("turning speed, positive to the left", unit="rad/s", default=0.0)

    uses_wheels = True

    def initialise(self) -> None:
        """Note when it is over."""
        self._end = self.robot.time + self.time

    def update(self) -> Status:
        """Command the velocity anew on every tick."""
        left = self._end - self.robot.time
        if left <= ROUNDING:
            return Status.SUCCESS
        self.robot.drive_for(Twist(self.linear, self.angular), min(left, TIME_TO_LIVE))
        self.feedback_message = f"{left:.1f} s left"
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Stand still, unless it was over already and somebody else may be driving."""
        super().terminate(new_status)
        if self.status is Status.RUNNING:
            self.robot.drive_for(STANDSTILL, TIME_TO_LIVE)
