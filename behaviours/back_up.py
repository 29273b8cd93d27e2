"""Drive straight back."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class BackUp(RobotBehaviour):
    """Drive straight back; gives up rather than touch what the lidar sees."""

    distance: float = port("how far", unit="m", default=0.3, above=0.0)
    speed: float | None = port("the robot's own when left out", unit="m/s", default=None, above=0.0)

    uses_wheels = True

    def initialise(self) -> None:
        """Begin to back up."""
        self._task = self.robot.back_up(self.distance, speed=self.speed)

    def update(self) -> Status:
        """Report on the way back."""
        return self.follow(self._task)
