"""Planning without driving."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode, Path, Pose2D


class ComputePath(RobotBehaviour):
    """Plan a path to a pose without driving, for `follow_path`.

    Fails with the code of the planner: NO_VALID_PATH, GOAL_OCCUPIED, START_OCCUPIED and others.
    """

    also_known_as = ("ComputePathToPose", "ComputePathThroughPoses", "ComputeRoute")
    takes_time = True
    needs = ("base",)
    goal_ports = ("goal",)

    goal: Pose2D = port("goal pose, map frame")
    start: Pose2D | None = port("start pose, map frame; default: the robot's pose", default=None)
    path: Path = output("the path")
    length: float = output("length of the path", unit="m")

    def initialise(self) -> None:
        self._task = self.robot.base.plan(self.goal, self.start)

    def update(self) -> Status:
        status = self.follow(self._task)
        if status is not Status.SUCCESS:
            return status
        path = self._task.path
        if path is None:
            return self.fail(FailureCode.NO_VALID_PATH, "the planner returned no path")
        self.path, self.length = path, path.length
        return Status.SUCCESS
