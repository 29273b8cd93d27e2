"""Six-axis IMU with white noise and a constant bias on each axis."""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import ImuDescription
from stack.sim.physics.physics_robot import BaseState
from stack.sim.physics.physics_world import GRAVITY
from stack.streams import stream
from stack.types import Imu as ImuReading

_GRAVITY = np.array([0.0, 0.0, GRAVITY])

_Sample = tuple[float, ...]
"""Time, velocity before and now, spin, and the nine numbers of the rotation."""


class Imu:
    """Collects samples. The accelerometer measures the specific force: acceleration minus g."""

    def __init__(self, description: ImuDescription, seed: int) -> None:
        self._description = description
        self._random = stream(seed, "imu")
        self._gyro_bias = self._random.normal(0.0, description.gyro_bias, 3)
        self._accelerometer_bias = self._random.normal(0.0, description.accelerometer_bias, 3)
        self._velocity: tuple[float, float, float] | None = None
        self._samples: list[_Sample] = []

    def sample(self, time: float, state: BaseState) -> None:
        """Take one sample; call at the sensor's rate."""
        before = state.velocity if self._velocity is None else self._velocity
        self._velocity = state.velocity
        self._samples.append((time, *before, *state.velocity, *state.spin, *state.rotation))

    def reset_velocity(self) -> None:
        """Forget the last velocity, so that a lifted robot measures no jump of it."""
        self._velocity = None

    def take(self) -> ImuReading | None:
        """Return the samples since the last call, or None without any."""
        if not self._samples:
            return None
        d, rows = self._description, np.array(self._samples)
        self._samples = []
        noise = self._random.standard_normal((len(rows), 6))
        force = (rows[:, 4:7] - rows[:, 1:4]) * d.rate + _GRAVITY
        rotations = rows[:, 10:].reshape(-1, 3, 3)
        gyro = np.matmul(rows[:, None, 7:10], rotations)[:, 0]
        gyro += self._gyro_bias
        gyro += d.gyro_noise * noise[:, :3]
        accelerometer = np.matmul(force[:, None, :], rotations)[:, 0]
        accelerometer += self._accelerometer_bias
        accelerometer += d.accelerometer_noise * noise[:, 3:]
        return ImuReading(rows[:, 0].copy(), gyro, accelerometer)
