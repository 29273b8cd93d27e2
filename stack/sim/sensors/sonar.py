"""Sonar: distance to the nearest obstacle in a cone, by a fan of rays, with noise."""

from __future__ import annotations

from math import inf, nan

import numpy as np

from stack.compilation import KernelTypes
from stack.drivetrain.description import SonarDescription
from stack.sim.scene_state import SceneState
from stack.sim.sensors.lidar import SensedScene
from stack.sim.worlds.world import World
from stack.streams import stream
from stack.types import FloatArray, Pose2D, RangeReading

RAYS = 9
"""Rays in the fan; at a range of 2.5 m and 25 degrees they are 14 cm apart."""


class Sonar:
    """Takes readings from the sensor's true pose, in the horizontal plane at its height.

    A real cone is as high as it is wide; obstacles below or above the plane are not measured
    here. The noise depends only on (seed, "sonar:" + name, step).
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels that the readings call."""
        from stack.sim.sensors.kernels import CAST

        return CAST

    def __init__(self, description: SonarDescription, world: World, seed: int, name: str) -> None:
        from stack.sim.sensors.kernels import cast  # imports numba

        self._cast = cast
        self._description, self._name, self._seed = description, name, seed
        self._apart = description.field_of_view / (RAYS - 1) * np.arange(RAYS)
        self._scene = SensedScene(world, description.height, glass=True)

    def reading(self, robot: Pose2D, scene: SceneState, step: int, time: float) -> RangeReading:
        """Measure one distance; arguments as in `Lidar.scan`."""
        d = self._description
        sensor = robot.compose(d.mount)
        origins = np.full((RAYS, 2), (sensor.x, sensor.y))
        directions = sensor.heading - d.field_of_view / 2.0 + self._apart
        measured: FloatArray = self._cast(origins, directions, *self._scene.outlines(scene))
        noise = stream(self._seed, f"sonar:{self._name}", step).normal(0.0, d.noise)
        distance = min(measured.tolist()) + noise
        if distance > d.range_max:
            distance = inf
        elif distance < d.range_min:
            distance = nan
        return RangeReading(
            time, distance, d.field_of_view, d.range_min, d.range_max, d.mount, self._name
        )
