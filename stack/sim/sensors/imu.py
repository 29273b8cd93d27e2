"""Six-axis IMU with white noise and a constant bias on each axis."""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import ImuDescription
from stack.sim.physics.physics_robot import BaseState
from stack.sim.physics.physics_world import GRAVITY
from stack.streams import stream
from stack.types import FloatArray
from stack.types import Imu as ImuReading


class Imu:
    """Collects samples. The accelerometer measures the specific force: acceleration minus g."""

    def __init__(self, description: ImuDescription, seed: int) -> None:
        self._description = description
        self._random = stream(seed, "imu")
        self._gyro_bias = self._random.normal(0.0, description.gyro_bias, 3)
        self._accelerometer_bias = self._random.normal(0.0, description.accelerometer_bias, 3)
        self._velocity: FloatArray | None = None
        self._stamps: list[float] = []
        self._gyro: list[FloatArray] = []
        self._accelerometer: list[FloatArray] = []

    def sample(self, time: float, state: BaseState) -> None:
        """Take one sample; call at the sensor's rate."""
        d = self._description
        noise = self._random.standard_normal(6)
        before = state.velocity if self._velocity is None else self._velocity
        self._velocity = state.velocity
        acceleration = (state.velocity - before) * d.rate
        acceleration[2] += GRAVITY
        self._stamps.append(time)
        self._gyro.append(state.spin @ state.rotation + self._gyro_bias + d.gyro_noise * noise[:3])
        self._accelerometer.append(
            acceleration @ state.rotation
            + self._accelerometer_bias
            + d.accelerometer_noise * noise[3:]
        )

    def reset_velocity(self) -> None:
        """Forget the last velocity, so that a lifted robot measures no jump of it."""
        self._velocity = None

    def take(self) -> ImuReading | None:
        """Return the samples since the last call, or None without any."""
        if not self._stamps:
            return None
        batch = ImuReading(
            np.array(self._stamps), np.array(self._gyro), np.array(self._accelerometer)
        )
        self._stamps, self._gyro, self._accelerometer = [], [], []
        return batch
