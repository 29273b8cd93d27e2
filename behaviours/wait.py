"""Let time pass."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port

ROUNDING = 1e-9
"""Seconds; a clock summed from periods may stand a hair before the round figure."""


class Wait(RobotBehaviour):
    """Succeed when a time has passed on the robot's clock."""

    takes_time = True
    can_fail = False

    time: float = port("how long", unit="s", at_least=0.0)

    def initialise(self) -> None:
        """Note when it is over."""
        self._end = self.robot.time + self.time

    def update(self) -> Status:
        """Compare with the robot's clock."""
        left = self._end - self.robot.time
        if left <= ROUNDING:
            return Status.SUCCESS
        self.feedback_message = f"{left:.1f} s left"
        return Status.RUNNING
