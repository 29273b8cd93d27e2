"""A planar lidar: rays into the physics' own shapes, then the sensor's errors."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.description import LidarDescription
from stack.sim.physics import BaseState, Physics
from stack.streams import stream
from stack.types import FloatArray, Scan


class Lidar:
    """Takes scans from the sensor's true pose; all beams of a scan at one instant.

    A range is the true one plus Gaussian noise. A lost beam and one beyond the maximum are +inf,
    one below the minimum NaN. Noise comes from (seed, "lidar", step), whatever was read before.
    """

    def __init__(self, description: LidarDescription, seed: int) -> None:
        self._description, self._seed = description, seed
        n, turn = description.beams, min(description.field_of_view, 2.0 * pi)
        full = turn > 2.0 * pi - 1e-6
        self._increment = turn / n if full else turn / (n - 1)
        self._angle_min = -turn / 2.0
        mount = description.mount
        angles = mount.heading + self._angle_min + self._increment * np.arange(n)
        self._origin = np.array([mount.x, mount.y, description.height])
        self._directions: FloatArray = np.column_stack(
            [np.cos(angles), np.sin(angles), np.zeros(n)]
        )

    def scan(self, physics: Physics, time: float, step: int) -> Scan:
        """What the lidar measures at this physics step."""
        d = self._description
        reach = d.range_max + 5.0 * d.noise
        measured = reach * physics.cast(*self._rays(physics.base_state(), reach))
        missed = measured >= reach
        random = stream(self._seed, "lidar", step)
        measured += random.normal(0.0, d.noise, d.beams)
        lost = random.random(d.beams) < d.dropout
        measured[measured < d.range_min] = np.nan
        measured[missed | lost | (measured > d.range_max)] = np.inf
        return Scan(
            stamp=time,
            ranges=measured.astype(np.float32),
            angle_min=self._angle_min,
            angle_increment=self._increment,
            range_min=d.range_min,
            range_max=d.range_max,
            mount=d.mount,
        )

    def _rays(self, base: BaseState, reach: float) -> tuple[FloatArray, FloatArray]:
        origin = base.position + base.rotation @ self._origin
        starts = np.repeat(origin[None, :], len(self._directions), axis=0)
        return starts, starts + reach * (self._directions @ base.rotation.T)
