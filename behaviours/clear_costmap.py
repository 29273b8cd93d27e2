"""Forget obstacles that were sensed."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class ClearCostmap(RobotBehaviour):
    """Forget sensed obstacles; what the map shows stays."""

    can_fail = False

    which: str = port("which costmap", default="both", one_of=("local", "global", "both"))

    def update(self) -> Status:
        """Clear at once."""
        self.robot.clear_costmap(self.which)
        return Status.SUCCESS
