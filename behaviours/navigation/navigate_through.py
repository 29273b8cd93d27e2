"""Navigation through several poses."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, RobotBehaviour, output, port
from stack.types import FailureCode, Pose2D


class NavigateThrough(RobotBehaviour):
    """Drive through several poses without stopping; stop at the last one.

    The planners hybrid_astar and lattice pass each pose with its heading. With astar and theta_star
    the robot passes it with the heading of the path.
    """

    also_known_as = ("NavigateThroughPoses",)

    goals: list[Pose2D] = port("poses to drive through, map frame; the robot stops at the last")
    tolerance: float | None = port(
        "goal tolerance at the last pose; default: the robot's",
        unit="m",
        default=None,
        above=0.0,
    )
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration of the drive", unit="s")

    claims = ("base",)
    fails_with = DRIVE_FAILURES
    goal_ports = ("goals",)

    def initialise(self) -> None:
        goals = list(self.goals)
        self._task = (
            self.robot.base.navigate_through(goals, tolerance=self.tolerance) if goals else None
        )
        self._timer = self.start_timer()
        self._trail = OdometryTrail()

    def update(self) -> Status:
        if self._task is None:
            return self.fail(FailureCode.FAILED, "goals is an empty list; give at least one pose")
        self._trail.record(self.robot.time, self.robot.base.odometry)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.time_taken = self._timer.elapsed
        return status
