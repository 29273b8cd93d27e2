"""Forget obstacles that were sensed near the robot."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class ClearCostmapAroundRobot(RobotBehaviour):
    """Forget sensed obstacles near the robot, by one layer or all; what lies farther off stays."""

    radius: float = port("how far from the robot", unit="m", above=0.0)
    which: str = port("which costmap", default="both", one_of=("local", "global", "both"))
    layer: str = port("the one layer that is to forget; empty is every one", default="")

    def update(self) -> Status:
        """Clear at once."""
        self.robot.clear_costmap(self.which, radius=self.radius, layer=self.layer or None)
        return Status.SUCCESS
