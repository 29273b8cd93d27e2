"""Rotation between two observations by the gyro, and standstill by the wheels."""

from __future__ import annotations

from math import inf

from stack.localisation.parameters import OdometryFusionParameters
from stack.types import Imu, Twist

STILL_SPEED, STILL_TURN = 0.003, 0.005
"""Speeds of the wheels below which the robot is at standstill, m/s and rad/s."""


class GyroIntegral:
    """Trapezoidal integral of the gyro's yaw rate, its bias included.

    Samples do not end at the observation's time: the last rate is held until then, and the next
    call subtracts what was held.
    """

    def __init__(self) -> None:
        self._stamp = 0.0
        self._rate: float | None = None
        self._ahead = 0.0

    @property
    def is_silent(self) -> bool:
        """Whether there are no samples to integrate."""
        return self._rate is None

    def begin(self, now: float) -> None:
        """Start at the time of the first observation, seconds."""
        self._stamp, self._rate, self._ahead = now, None, 0.0

    def rotation(self, imu: Imu | None, now: float, timeout: float) -> float | None:
        """Return the rotation since the last call, radians; None after `timeout` without samples.

        Args:
            imu: the samples since the last call; None without any.
            now: time of the observation, seconds.
            timeout: seconds.
        """
        if imu is None or imu.stamps.size == 0:
            if self._rate is None or now - self._stamp > timeout + 1e-9:
                self.begin(now)
                return None
            return self._until(now, 0.0)
        rates, stamps = imu.angular_velocity[:, 2].tolist(), imu.stamps.tolist()
        turned, before = 0.0, rates[0] if self._rate is None else self._rate
        for stamp, rate in zip(stamps, rates, strict=True):
            turned += 0.5 * (before + rate) * (stamp - self._stamp)
            self._stamp, before = stamp, rate
        self._rate = before
        return self._until(now, turned)

    def _until(self, now: float, measured: float) -> float:
        held = (self._rate or 0.0) * (now - self._stamp)
        rotation = measured + held - self._ahead
        self._ahead = held
        return rotation


class Standstill:
    """Whether the wheels have been at rest for `settling_time`.

    A robot that is at rest at the beginning has been so before.
    """

    def __init__(self) -> None:
        self._stood_for, self._watched = inf, 0.0

    def lasts(self, twist: Twist, elapsed: float, parameters: OdometryFusionParameters) -> bool:
        """Return whether the wheels are and were at rest.

        Args:
            twist: measured by the wheels.
            elapsed: seconds since the last call.
            parameters: time of settling.
        """
        self._watched += elapsed
        still = max(abs(twist.linear), abs(twist.lateral)) < STILL_SPEED
        still = still and abs(twist.angular) < STILL_TURN
        self._stood_for = self._stood_for + elapsed if still else 0.0
        return self._stood_for >= parameters.settling_time

    def first_is_over(self, gyro: GyroIntegral, parameters: OdometryFusionParameters) -> bool:
        """Return whether the gyro was measured at rest for `settling_time`, or delivers nothing."""
        if self._watched >= parameters.settling_time - 1e-9:
            return True
        return self._watched > 0.0 and gyro.is_silent
