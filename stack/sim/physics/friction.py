"""Friction zones: a wheel inside a zone gets the friction of that zone.

Changing the wheel's friction gives the same motion as a patch of other floor would.
"""

from __future__ import annotations

from stack.sim.physics.engine import PhysicsRobot
from stack.sim.worlds.world import World
from stack.types import Pose2D


class FrictionZones:
    """Sets the friction of each wheel by its position.

    Where zones overlap, the first one in the world file applies.
    """

    def __init__(self, world: World, physics: PhysicsRobot) -> None:
        self._world, self._physics = world, physics
        self._frictions = [world.friction, *(zone.friction for zone in world.friction_zones)]
        self._now = [world.friction] * len(physics.wheel_places)

    def update(self, robot: Pose2D) -> None:
        """Set the friction of each wheel to that of the floor below it."""
        if not self._world.friction_zones:
            return
        places = robot.transform(self._physics.wheel_places).tolist()
        for wheel, (x, y) in enumerate(places):
            friction = self._frictions[self.floor_at(x, y)]
            if friction != self._now[wheel]:
                self._now[wheel] = friction
                self._physics.set_wheel_friction(wheel, friction)

    def floor_at(self, x: float, y: float) -> int:
        """Number of the friction zone at a point, from 1 on; 0 for the floor outside of them."""
        for number, zone in enumerate(self._world.friction_zones, 1):
            x_min, y_min, x_max, y_max = zone.bounds
            if x_min <= x <= x_max and y_min <= y <= y_max:
                return number
        return 0
