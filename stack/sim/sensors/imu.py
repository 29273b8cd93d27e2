"""Six-axis IMU: white noise, a constant bias on each axis, an error of the gyro's scale."""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import ImuDescription
from stack.sim.physics.engine import GRAVITY, BaseState
from stack.streams import stream
from stack.types import Imu as ImuReading

Vector = tuple[float, float, float]

_Sample = tuple[float, ...]
"""Time, angular velocity and specific force without errors, base frame."""


class Imu:
    """Collects samples. The accelerometer measures the specific force: acceleration minus g."""

    def __init__(self, description: ImuDescription, seed: int) -> None:
        self._random = stream(seed, "imu")
        gyro_bias = self._random.normal(0.0, description.gyro_bias, 3)
        accelerometer_bias = self._random.normal(0.0, description.accelerometer_bias, 3)
        self._bias = np.concatenate([gyro_bias, accelerometer_bias])
        self._noise = np.repeat([description.gyro_noise, description.accelerometer_noise], 3)
        scale = stream(seed, "imu scale").normal(1.0, description.gyro_scale_error)
        self._scale = np.repeat([scale, 1.0], 3)
        self._velocity: Vector | None = None
        self._samples: list[_Sample] = []

    def sample(self, time: float, state: BaseState, since: float) -> None:
        """Take one sample, `since` seconds after the one before; call at the sensor's rate."""
        (x, y, z), before = state.velocity, self._velocity or state.velocity
        self._velocity = state.velocity
        rate = 1.0 / since
        force = (x - before[0]) * rate, (y - before[1]) * rate, (z - before[2]) * rate + GRAVITY
        turning = _into_base(state.spin, state.rotation)
        self._samples.append((time, *turning, *_into_base(force, state.rotation)))

    def reset_velocity(self) -> None:
        """Forget the last velocity, so that a lifted robot measures no jump of it."""
        self._velocity = None

    def take(self) -> ImuReading | None:
        """Return the samples since the last call, or None without any."""
        if not self._samples:
            return None
        rows, self._samples = np.array(self._samples), []
        measured = rows[:, 1:] * self._scale + self._bias
        measured += self._noise * self._random.standard_normal(measured.shape)
        return ImuReading(rows[:, 0].copy(), measured[:, :3].copy(), measured[:, 3:].copy())


def _into_base(vector: Vector, rotation: tuple[float, ...]) -> Vector:
    """Return a vector of the world frame in the base frame; rotation: `BaseState.rotation`."""
    x, y, z = vector
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation
    return x * xx + y * yx + z * zx, x * xy + y * yy + z * zy, x * xz + y * yz + z * zz
