"""Drive past several poses without stopping in between."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._odometry_trail import OdometryTrail
from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode, Pose2D


class NavigateThrough(RobotBehaviour):
    """Drive past poses in turn to the last one, without stopping in between.

    The planners hybrid_astar and lattice pass each pose with its heading, astar and theta_star at
    whatever heading the way has there.
    """

    goals: list[Pose2D] = port("poses to pass, the last is where to stop, map frame")
    tolerance: float | None = port(
        "how near the last pose counts as there; the robot's own when left out",
        unit="m",
        default=None,
        above=0.0,
    )
    path_length: float = output("length of the way driven", unit="m")
    time_taken: float = output("from the start to the end of the drive", unit="s")

    uses_wheels = True

    def initialise(self) -> None:
        """Send the robot off; there is nothing to send it to when the list is empty."""
        goals = list(self.goals)
        self._task = self.robot.navigate_through(goals, tolerance=self.tolerance) if goals else None
        self._started = self.robot.time
        self._trail = OdometryTrail()

    def update(self) -> Status:
        """Report on the drive; how far and how long it was is known when it ends."""
        if self._task is None:
            return self.fail(FailureCode.FAILED, "goals is an empty list; give at least one pose")
        self._trail.record(self.robot.time, self.robot.odometry)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.time_taken = self.robot.time - self._started
        return status
