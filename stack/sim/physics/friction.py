"""Friction zones: a wheel in one gets that floor's grip, which equals a real patch."""

from __future__ import annotations

from stack.sim.physics.physics_world import Physics
from stack.sim.worlds.world import World
from stack.types import Pose2D


class FrictionZones:
    """Watches the wheels; where zones overlap the first in the world file counts."""

    def __init__(self, world: World, physics: Physics) -> None:
        self._world, self._physics = world, physics
        self._now = [world.friction] * len(physics.wheel_places)

    def update(self, robot: Pose2D) -> None:
        """Give each wheel the friction of the floor below it."""
        if not self._world.friction_zones:
            return
        places = robot.transform(self._physics.wheel_places).tolist()
        for wheel, (x, y) in enumerate(places):
            friction = self._below(x, y)
            if friction != self._now[wheel]:
                self._now[wheel] = friction
                self._physics.set_wheel_friction(wheel, friction)

    def _below(self, x: float, y: float) -> float:
        for zone in self._world.friction_zones:
            x_min, y_min, x_max, y_max = zone.bounds
            if x_min <= x <= x_max and y_min <= y <= y_max:
                return zone.friction
        return self._world.friction
