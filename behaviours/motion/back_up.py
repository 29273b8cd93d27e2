"""Driving straight backward."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, port


class BackUp(RobotBehaviour):
    """Drive straight backward; fails before touching an obstacle seen by the lidar."""

    also_known_as = ("backward", "reverse")

    distance: float = port("distance to drive", unit="m", default=0.3, above=0.0)
    speed: float | None = port("speed; default: the robot's", unit="m/s", default=None, above=0.0)

    claims = ("base",)
    drives_backward = True
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.back_up(self.distance, speed=self.speed)

    def update(self) -> Status:
        return self.follow(self._task)
