"""Navigation to one pose."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, RobotBehaviour, output, port
from stack.types import Pose2D


class NavigateToPose(RobotBehaviour):
    """Drive to a pose in the map frame; replans when the world changes.

    Fails with the failure code of the drive: NO_VALID_PATH, GOAL_OCCUPIED, NO_PROGRESS and others.
    If the goal cannot be reached, the robot stays where it is. With `partial`, or with
    `allow_partial` of the planner, it drives to the nearest reachable pose instead. With `partial`
    this is a success, and `remaining` is the distance left to the goal; without, it fails with
    NO_VALID_PATH.
    """

    goal: Pose2D = port("goal pose, map frame")
    tolerance: float | None = port(
        "goal tolerance; default: the robot's",
        unit="m",
        default=None,
        above=0.0,
    )
    partial: bool = port("accept the nearest reachable pose", default=False)
    remaining: float = output("straight-line distance left to the goal", unit="m")
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration of the drive", unit="s")

    uses_wheels = True
    fails_with = DRIVE_FAILURES
    goal_ports = ("goal",)

    def initialise(self) -> None:
        """Start the drive."""
        self._task = self.robot.navigate_to(
            self.goal, tolerance=self.tolerance, partial=self.partial
        )
        self._timer = self.start_timer()
        self._trail = OdometryTrail()

    def update(self) -> Status:
        """Return the status of the drive; write the outputs at its end."""
        self._trail.record(self.robot.time, self.robot.odometry)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.remaining = self.robot.pose.distance_to(self.goal)
            self.time_taken = self._timer.elapsed
        return status
