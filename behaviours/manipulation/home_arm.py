"""Moving an arm to its home posture."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES
from behaviours.base import RobotBehaviour, port

HOME = "home"
"""The posture that every arm has."""


class HomeArm(RobotBehaviour):
    """Move the arm to the posture `home` of the robot file."""

    speed: float = port("share of the top speed", default=1.0, above=0.0, at_most=1.0)

    claims = ("arm",)
    fails_with = MOTION_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.arm.move_to_posture(HOME, speed=self.speed)

    def update(self) -> Status:
        return self.follow(self._task)
