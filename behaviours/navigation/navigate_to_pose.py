"""Navigation to one pose."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, RobotBehaviour, output, port
from behaviours.timer import Timer
from stack.robot import Task
from stack.types import FailureCode, Pose2D, TaskStatus

GOAL_PERIOD = 1.0
"""Least time between two changes of the goal, seconds: each one plans a new drive."""


class NavigateToPose(RobotBehaviour):
    """Drive to a pose in the map frame; replans when the world changes.

    If `goal` is a key that changes during the drive, the robot drives to the new pose, at most one
    change a second.

    Fails with the failure code of the drive: NO_VALID_PATH, GOAL_OCCUPIED, NO_PROGRESS and others.
    If the goal cannot be reached, the robot stays where it is. With `partial`, or with
    `allow_partial` of the planner, it drives to the nearest reachable pose instead. With `partial`
    this is a success, and `remaining` is the distance left to the goal; without, it fails with
    NO_VALID_PATH.

    The robot tries to meet `tolerance`. With `accept`, a coarser one is enough in the end: when it
    has been within it for `accept_after`, or cannot meet the finer one there, it only turns to the
    goal's heading.
    """

    also_known_as = (
        "go_to", "move", "move_to", "drive", "drive_to", "navigate", "go_to_place", "go_to_pose",
        "drive_to_pose", "MoveBase",
    )  # fmt: skip

    goal: Pose2D = port("goal pose, map frame")
    tolerance: float | None = port(
        "goal tolerance; default: the robot's",
        unit="m",
        default=None,
        above=0.0,
    )
    partial: bool = port("accept the nearest reachable pose", default=False)
    accept: float | None = port(
        "tolerance that is accepted when the finer one is not met in time; default: none",
        unit="m",
        default=None,
        above=0.0,
    )
    accept_after: float = port(
        "time within `accept` after which it is accepted", unit="s", default=5.0, at_least=0.0
    )
    remaining: float = output("straight-line distance left to the goal", unit="m")
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration of the drive", unit="s")

    claims = ("base",)
    fails_with = DRIVE_FAILURES
    goal_ports = ("goal",)
    arrival_port = "goal"

    def initialise(self) -> None:
        self._timer, self._since_goal = self.start_timer(), self.start_timer()
        self._trail = OdometryTrail()
        self._near: Timer | None = None
        self._drive_to(self.goal)

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        goal = self.goal
        if goal != self._goal and self._since_goal.is_over(GOAL_PERIOD):
            self._drive_to(goal)
        if self._accepts():
            self._task = self._drive(goal, self.accept)
        status = self.follow(self._task)
        if status is Status.SUCCESS and goal != self._goal:
            status = Status.RUNNING  # at the former goal; the next change is due soon
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.remaining = self.robot.localisation.pose.distance_to(self.goal)
            self.time_taken = self._timer.elapsed
        return status

    def terminate(self, new_status: Status) -> None:
        """Cancel the drive; a halted one still has its distance."""
        super().terminate(new_status)
        if new_status is Status.INVALID:
            self._trail.record(self.robot.time, self.robot.base.odometry)
            self.path_length = self._trail.distance

    def _drive_to(self, goal: Pose2D) -> None:
        self._goal, self._coarse = goal, False
        self._since_goal.restart()
        self._task = self._drive(goal, self.tolerance)

    def _drive(self, goal: Pose2D, tolerance: float | None) -> Task:
        return self.robot.base.navigate_to(goal, tolerance=tolerance, partial=self.partial)

    def _accepts(self) -> bool:
        """Whether to drive with the coarser tolerance from now on."""
        task, accept = self._task, self.accept
        if accept is None or self._coarse or task.status is TaskStatus.SUCCEEDED:
            return False
        near = self.robot.localisation.pose.distance_to(self._goal) <= accept
        if not near:
            self._near = None
        elif self._near is None:
            self._near = self.start_timer()
        occupied = task.failure is not None and task.failure.code == FailureCode.GOAL_OCCUPIED
        failed = task.status is TaskStatus.FAILED and (near or occupied)
        waited = self._near is not None and self._near.is_over(self.accept_after)
        self._coarse = failed or (waited and task.status is TaskStatus.RUNNING)
        return self._coarse
