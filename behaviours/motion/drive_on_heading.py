"""Driving straight."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, port


class DriveOnHeading(RobotBehaviour):
    """Drive straight and keep the heading; fails before touching an obstacle seen by the lidar.

    Needs no map and no pose. Fails with COLLISION_AHEAD, NO_PROGRESS or TIMED_OUT.
    """

    also_known_as = ("forward", "move_forward", "drive_forward")

    distance: float = port("distance to drive; negative: backward", unit="m")
    speed: float | None = port("speed; default: the robot's", unit="m/s", default=None, above=0.0)
    direction: float = port(
        "direction of travel, positive to the left of the heading; omnidirectional robots only",
        unit="rad",
        default=0.0,
        at_least=-3.15,
        at_most=3.15,
    )

    claims = ("base",)
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.drive_on_heading(
            self.distance, speed=self.speed, direction=self.direction
        )

    def update(self) -> Status:
        return self.follow(self._task)
