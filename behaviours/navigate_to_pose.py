"""Drive to one pose."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._odometry_trail import OdometryTrail
from behaviours.base import RobotBehaviour, output, port
from stack.types import Pose2D


class NavigateToPose(RobotBehaviour):
    """Drive to a pose in the map frame, planning again as the world changes.

    Fails with the navigation's reason: NO_VALID_PATH, GOAL_OCCUPIED, NO_PROGRESS and others.
    """

    goal: Pose2D = port("where to go, map frame")
    tolerance: float | None = port(
        "how near counts as there; the robot's own when left out",
        unit="m",
        default=None,
        above=0.0,
    )
    path_length: float = output("length of the way driven", unit="m")
    time_taken: float = output("from the start to the end of the drive", unit="s")

    uses_wheels = True

    def initialise(self) -> None:
        """Send the robot off."""
        self._task = self.robot.navigate_to(self.goal, tolerance=self.tolerance)
        self._started = self.robot.time
        self._trail = OdometryTrail()

    def update(self) -> Status:
        """Report on the drive; how far and how long it was is known when it ends."""
        self._trail.record(self.robot.time, self.robot.odometry)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.time_taken = self.robot.time - self._started
        return status
