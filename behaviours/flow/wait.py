"""Waiting for a time."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class Wait(RobotBehaviour):
    """Succeed after a time on the robot's clock."""

    also_known_as = ("Delay", "Sleep", "pause", "Timer")
    takes_time = runs_in_tests = True
    duration_port = "time"
    fails_with = ()
    can_fail = False

    time: float = port("duration", unit="s", at_least=0.0)

    def initialise(self) -> None:
        self._timer = self.start_timer()

    def update(self) -> Status:
        if self._timer.is_over(self.time):
            return Status.SUCCESS
        self.feedback_message = f"{self._timer.left(self.time):.1f} s left"
        return Status.RUNNING
