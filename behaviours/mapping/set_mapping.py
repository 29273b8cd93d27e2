"""Switching between mapping and localising."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.errors import NavigationError
from stack.types import FailureCode


class SetMapping(RobotBehaviour):
    """Begin or cease to change the map; the robot localises itself on it in either case.

    For `localisation: slam` and `pose_graph`. Fails with UNSUPPORTED if the estimator draws no map.
    """

    enabled: bool = port("whether new scans change the map")

    needs = ("base",)
    fails_with = (FailureCode.UNSUPPORTED,)

    def update(self) -> Status:
        try:
            self.robot.map.set_mapping(self.enabled)
        except NavigationError as error:
            return self.fail(error.failure.code, error.failure.sentence)
        return Status.SUCCESS
