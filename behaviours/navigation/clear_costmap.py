"""Clearing sensed obstacles."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class ClearCostmap(RobotBehaviour):
    """Remove sensed obstacles from the costmaps; obstacles of the map remain."""

    also_known_as = ("ClearEntireCostmap", "ClearCostmapExceptRegion")
    can_fail = False
    needs = ("base",)
    fails_with = ()

    which: str = port("costmap to clear", default="both", one_of=("local", "global", "both"))

    def update(self) -> Status:
        self.robot.map.clear_costmap(self.which)
        return Status.SUCCESS
