"""Forget obstacles that were sensed."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class ClearCostmap(RobotBehaviour):
    """Forget sensed obstacles; what the map shows stays."""

    can_fail = False

    which: str = port("which costmap", default="both", one_of=("local", "global", "both"))
    radius: float = port(
        "forget only this far round the robot; 0 is everywhere", unit="m", default=0.0, at_least=0.0
    )
    layer: str = port("the one layer that is to forget; empty is every one", default="")

    def update(self) -> Status:
        """Clear at once."""
        self.robot.clear_costmap(self.which, radius=self.radius or None, layer=self.layer or None)
        return Status.SUCCESS
