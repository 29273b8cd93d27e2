"""Waiting for a time."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port

ROUNDING = 1e-9
"""Seconds; a clock summed from periods has rounding errors."""


class Wait(RobotBehaviour):
    """Succeed after a time on the robot's clock."""

    takes_time = True
    can_fail = False

    time: float = port("duration", unit="s", at_least=0.0)

    def initialise(self) -> None:
        """Store the end time."""
        self._end = self.robot.time + self.time

    def update(self) -> Status:
        """Compare the end time with the robot's clock."""
        left = self._end - self.robot.time
        if left <= ROUNDING:
            return Status.SUCCESS
        self.feedback_message = f"{left:.1f} s left"
        return Status.RUNNING
