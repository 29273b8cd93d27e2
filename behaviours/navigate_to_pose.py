"""Drive to one pose."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._odometry_trail import OdometryTrail
from behaviours.base import RobotBehaviour, output, port
from stack.types import Pose2D


class NavigateToPose(RobotBehaviour):
    """Drive to a pose in the map frame, planning again as the world changes.

    Fails with the navigation's reason: NO_VALID_PATH, GOAL_OCCUPIED, NO_PROGRESS and others. Where
    the goal cannot be reached it stays where it is, unless `partial` or the planner's own
    `allow_partial` says otherwise: then it drives to the nearest place that can be reached. With
    `partial` that is success, and `remaining` how far away the goal is; without, NO_VALID_PATH.
    """

    goal: Pose2D = port("where to go, map frame")
    tolerance: float | None = port(
        "how near counts as there; the robot's own when left out",
        unit="m",
        default=None,
        above=0.0,
    )
    partial: bool = port("as near as there is a way to will do", default=False)
    remaining: float = output("from where the drive ended to the goal, straight", unit="m")
    path_length: float = output("length of the way driven", unit="m")
    time_taken: float = output("from the start to the end of the drive", unit="s")

    uses_wheels = True

    def initialise(self) -> None:
        """Send the robot off."""
        self._task = self.robot.navigate_to(
            self.goal, tolerance=self.tolerance, partial=self.partial
        )
        self._started = self.robot.time
        self._trail = OdometryTrail()

    def update(self) -> Status:
        """Report on the drive; how far and how long it was is known when it ends."""
        self._trail.record(self.robot.time, self.robot.odometry)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.remaining = self.robot.pose.distance_to(self.goal)
            self.time_taken = self.robot.time - self._started
        return status
