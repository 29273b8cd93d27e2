"""Loading of a saved map."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.errors import NavigationError
from stack.types import FailureCode, Pose2D


class LoadMap(RobotBehaviour):
    """Load a saved map; the robot localises itself on it from now on.

    If the pose in that map is not given, `relocalise` can find it. Fails with UNSUPPORTED if the
    estimator cannot change its map.
    """

    path: str = port(
        "folder of a saved map, or a map.yaml; relative to the run folder or else the mission's"
    )
    pose: Pose2D | None = port("the robot's pose in that map; default: unknown", default=None)

    needs = ("base",)
    fails_with = (FailureCode.UNSUPPORTED,)

    def update(self) -> Status:
        try:
            self.robot.map.load(self.path, self.pose)
        except NavigationError as error:
            return self.fail(error.failure.code, error.failure.sentence)
        return Status.SUCCESS
