"""Telling rival poses apart by driving."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import DRIVE_FAILURES, RobotBehaviour, output


class Disambiguate(RobotBehaviour):
    """Drive to where the possible poses of the robot differ, until one is left.

    The possible poses are the estimate and its rivals (`localisation.ambiguous`). Each view is the
    nearest place that is free at all of them and from which a scan tells them apart. Succeeds at
    once without rivals; fails with AMBIGUOUS when no reachable place shows a difference.
    """

    rivals: int = output("number of rivals that are left")

    needs = ("lidar",)
    claims = ("base",)
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._task = self.robot.base.disambiguate()

    def update(self) -> Status:
        self.rivals = len(self.robot.localisation.estimate.rivals)
        return self.follow(self._task)
