"""Clearing sensed obstacles near the robot."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class ClearCostmapAroundRobot(RobotBehaviour):
    """Remove sensed obstacles near the robot, from one layer or from all layers."""

    needs = ("base",)
    fails_with = ()

    radius: float = port("clear within this distance of the robot", unit="m", above=0.0)
    which: str = port("costmap to clear", default="both", one_of=("local", "global", "both"))
    layer: str = port("layer to clear; empty: all layers", default="")

    def update(self) -> Status:
        self.robot.map.clear_costmap(self.which, radius=self.radius, layer=self.layer or None)
        return Status.SUCCESS
