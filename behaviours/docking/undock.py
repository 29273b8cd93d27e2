"""Leaving a dock."""

from __future__ import annotations

from math import pi

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, port
from stack.types import TaskStatus


class Undock(RobotBehaviour):
    """Leave a dock backward, as far as `dock` begins its approach, and turn away from it.

    Fails before touching an obstacle behind it that a sensor sees.
    """

    also_known_as = ("UndockRobot",)

    distance: float = port("distance to drive", unit="m", default=0.6, above=0.0, at_most=3.0)
    speed: float | None = port("speed; default: the robot's", unit="m/s", default=None, above=0.0)
    turn: bool = port("turn round at the end, away from the dock", default=False)

    claims = ("base",)
    drives_backward = True
    takes_time = True
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.back_up(self.distance, speed=self.speed)
        self._is_turning = False

    def update(self) -> Status:
        is_back = self._task.status is TaskStatus.SUCCEEDED
        if is_back and self.turn and not self._is_turning:
            self._task, self._is_turning = self.robot.base.spin(pi), True
        return self.follow(self._task)
