"""Driving out of a tight spot."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, port


class FreeSpaceEscape(RobotBehaviour):
    """Drive out of a tight spot into free space; uses the lidar only, not the costmap.

    Sweeps the footprint along short motions and selects the one that gains the most clearance.
    Space that the lidar has not seen counts as free only where the robot has just driven. Needs
    neither map nor pose, but a robot that is lost on its map does not move: it fails with LOST.
    From a keep-out zone, which no sensor sees, it drives out on the map by the shortest way.
    Other failures: COLLISION_AHEAD, NO_PROGRESS, TIMED_OUT.
    """

    clearance: float | None = port(
        "wanted clearance around the footprint; default: enough to turn, at least 15 cm",
        unit="m",
        default=None,
        above=0.0,
        at_most=5.0,
    )
    distance: float = port("longest distance to drive", unit="m", default=1.5, above=0.0)
    speed: float | None = port("speed; default: the robot's", unit="m/s", default=None, above=0.0)

    needs = ("lidar or sonar or depth_camera",)
    claims = ("base",)
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.escape(
            clearance=self.clearance, distance=self.distance, speed=self.speed
        )

    def update(self) -> Status:
        return self.follow(self._task)
