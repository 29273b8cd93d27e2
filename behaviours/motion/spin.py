"""Turning in place."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, port


class Spin(RobotBehaviour):
    """Turn in place by an angle; more than a full turn is allowed."""

    also_known_as = ("rotate", "turn")

    angle: float = port("angle to turn, positive to the left", unit="rad")
    speed: float | None = port(
        "angular speed; default: the robot's", unit="rad/s", default=None, above=0.0
    )

    claims = ("base",)
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.spin(self.angle, speed=self.speed)

    def update(self) -> Status:
        return self.follow(self._task)
