"""Drive straight."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class DriveOnHeading(RobotBehaviour):
    """Drive straight and hold the heading; gives up rather than touch what the lidar sees.

    Needs no map and no pose. Fails with COLLISION_AHEAD, NO_PROGRESS or TIMED_OUT.
    """

    distance: float = port("how far; negative is backward", unit="m")
    speed: float | None = port("the robot's own when left out", unit="m/s", default=None, above=0.0)
    direction: float = port(
        "of travel, positive to the left of its front; omnidirectional robots only",
        unit="rad",
        default=0.0,
        at_least=-3.15,
        at_most=3.15,
    )

    uses_wheels = True

    def initialise(self) -> None:
        """Begin to drive."""
        self._task = self.robot.drive_on_heading(
            self.distance, speed=self.speed, direction=self.direction
        )

    def update(self) -> Status:
        """Report on the way."""
        return self.follow(self._task)
