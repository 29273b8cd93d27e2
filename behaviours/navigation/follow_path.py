"""Driving along a path."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import RobotBehaviour, output, port
from stack.errors import EvaluationError
from stack.types import Path


class FollowPath(RobotBehaviour):
    """Drive along a path, without replanning.

    If `path` is a key that changes during the drive, the robot follows the new path from then on:
    run `compute_path` beside it. If the key is unset, it stays on the last path. Fails with the
    code of the drive: NO_PROGRESS, COLLISION_AHEAD and others.
    """

    claims = ("base",)

    path: Path = port("path to follow, from `compute_path`")
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration of the drive", unit="s")

    def initialise(self) -> None:
        self._timer, self._trail = self.start_timer(), OdometryTrail()
        self._follow(self.path)

    def update(self) -> Status:
        """Return the status of the drive; change to a new path."""
        self._trail.record(self.robot.time, self.robot.base.odometry)
        path = self._newest()
        if path is not self._path:
            self._follow(path)
        status = self.follow(self._task)
        if status is not Status.RUNNING:
            self.path_length = self._trail.distance
            self.time_taken = self._timer.elapsed
        return status

    def _newest(self) -> Path:
        """Return the newest path; the one that is followed while a failed plan leaves none."""
        try:
            return self.path
        except EvaluationError:
            return self._path

    def _follow(self, path: Path) -> None:
        self._path, self._task = path, self.robot.base.follow_path(path)
