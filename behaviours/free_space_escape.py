"""Drive out of a tight spot."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class FreeSpaceEscape(RobotBehaviour):
    """Drive out of a tight spot the freest way, by the lidar alone, whatever the costmap says.

    Sweeps the outline along short motions and takes the one that gains most room. What the lidar
    has not seen counts as free only where the robot has just been. Works without a map and while
    the robot is lost. Fails with COLLISION_AHEAD, NO_PROGRESS or TIMED_OUT.
    """

    clearance: float | None = port(
        "room wanted round the outline; enough to turn, and 15 cm at least, when left out",
        unit="m",
        default=None,
        above=0.0,
        at_most=5.0,
    )
    distance: float = port("to drive for it, at most", unit="m", default=1.5, above=0.0)
    speed: float | None = port("the robot's own when left out", unit="m/s", default=None, above=0.0)

    uses_wheels = True

    def initialise(self) -> None:
        """Begin to look for room."""
        self._task = self.robot.escape(
            clearance=self.clearance, distance=self.distance, speed=self.speed
        )

    def update(self) -> Status:
        """Report on the room there is."""
        return self.follow(self._task)
