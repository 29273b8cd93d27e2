"""Telling the localisation where the robot is."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Pose2D


class SetPose(RobotBehaviour):
    """Set the estimate of the robot's pose, for example on a dock. Rivals are given up."""

    pose: Pose2D = port("where the robot is, map frame")
    position_deviation: float = port(
        "standard deviation of the position", unit="m", default=0.1, at_least=0.0
    )
    heading_deviation: float = port(
        "standard deviation of the heading", unit="rad", default=0.05, at_least=0.0
    )

    can_fail = False
    needs = ("base",)
    fails_with = ()

    def update(self) -> Status:
        self.robot.localisation.set_pose(
            self.pose,
            position_deviation=self.position_deviation,
            heading_deviation=self.heading_deviation,
            source="mission",
        )
        return Status.SUCCESS
