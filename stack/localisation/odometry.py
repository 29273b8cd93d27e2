"""Odometry fusion: translation from the wheels, rotation from the gyro.

The base is assumed to move on an arc during a step. The closed-form logarithm of SE(2) decomposes
the wheels' displacement, the gyro's rotation replaces theirs, and the exponential composes both:
exact for any constant twist. The gyro's bias is its mean rate while the wheels are at rest (a
zero-velocity update; P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated
Navigation Systems, 2013, chapter 15).
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from stack.errors import BodyError
from stack.localisation.parameters import OdometryFusionParameters
from stack.types import FloatArray, Imu, Observation, Odometry, Pose2D, Twist, wrap_angle

DEFAULTS = OdometryFusionParameters()


class OdometryFusion:
    """Fusion of wheel translation and gyro rotation into a pose in the odom frame.

    Without inertial samples for `gyro_timeout`, the wheels measure the rotation. Until the first
    standstill of `settling_time`, the gyro's bias is assumed to be zero.
    """

    def __init__(self, parameters: OdometryFusionParameters = DEFAULTS) -> None:
        self.parameters = parameters
        self._fused: Odometry | None = None
        self._wheels = Pose2D(0.0, 0.0)
        self._bias = _GyroBias(parameters)
        self._gyro_stamp = 0.0
        self._gyro_rate: float | None = None
        self._ahead = 0.0

    def configure(self, parameters: OdometryFusionParameters) -> None:
        """Apply new parameters; pose and bias stay."""
        self.parameters = self._bias.parameters = parameters

    @property
    def gyro_bias(self) -> float:
        """The bias subtracted from the gyro's yaw rate, rad/s."""
        return self._bias.value

    def update(self, observation: Observation) -> Odometry:
        """Process one observation; return pose (odom frame) and measured twist (base frame).

        Raises:
            BodyError: the observation has no wheel odometry.
        """
        wheels = observation.wheels
        if wheels is None:
            raise BodyError("the robot delivers no wheel odometry")
        if self._fused is None:
            self._fused, self._wheels = wheels, wheels.pose
            self._gyro_stamp = observation.time
            self._gyro_rotation(observation, wheels, 0.0)
            return wheels
        elapsed = observation.time - self._fused.stamp
        if elapsed <= 0.0:
            return self._fused
        moved = wheels.pose.relative_to(self._wheels)
        rotation = self._gyro_rotation(observation, wheels, elapsed)
        angular = moved.heading if rotation is None else rotation
        pose = self._fused.pose.compose(_with_rotation(moved, angular))
        twist = Twist(wheels.twist.linear, angular / elapsed, wheels.twist.lateral)
        if rotation is None:
            twist = wheels.twist
        self._wheels = wheels.pose
        self._fused = Odometry(observation.time, pose, twist)
        return self._fused

    def _gyro_rotation(
        self, observation: Observation, wheels: Odometry, elapsed: float
    ) -> float | None:
        """Return the gyro's rotation since the last observation, radians; None without samples."""
        imu, now, p = observation.imu, observation.time, self.parameters
        standing = self._bias.is_at_rest(wheels.twist, elapsed)
        if imu is None or imu.stamps.size == 0:
            silence = now - self._gyro_stamp
            if self._gyro_rate is None or silence > p.gyro_timeout + 1e-9:
                self._gyro_stamp, self._gyro_rate, self._ahead = now, None, 0.0
                return None
            return self._until(now, 0.0)
        rates = imu.angular_velocity[:, 2]
        rotated_by_hand = abs(float(rates.mean()) - self._bias.value) > p.bias_tolerance
        if standing and not rotated_by_hand:
            self._bias.learn(rates)
        rotation = self._until(now, self._integrate(imu, rates))
        at_rest = wheels.twist == Twist() and not rotated_by_hand
        return 0.0 if at_rest else rotation

    def _integrate(self, imu: Imu, rates: FloatArray) -> float:
        """Trapezoidal integral of the yaw rate from the last sample on, bias removed, radians."""
        first = rates[0] if self._gyro_rate is None else self._gyro_rate
        stamps = np.concatenate([[self._gyro_stamp], imu.stamps])
        values = np.concatenate([[first], rates])
        self._gyro_stamp, self._gyro_rate = float(stamps[-1]), float(rates[-1])
        return float(np.trapezoid(values - self._bias.value, stamps))

    def _until(self, now: float, measured: float) -> float:
        """Return the rotation since the last observation, radians.

        Samples do not end at the observation's time. The last rate is held until then; the next
        call subtracts what was held.
        """
        held = ((self._gyro_rate or 0.0) - self._bias.value) * (now - self._gyro_stamp)
        rotation = measured + held - self._ahead
        self._ahead = held
        return rotation


class _GyroBias:
    """Mean yaw rate of the gyro at standstill: a plain mean at first, then an exponential mean."""

    def __init__(self, parameters: OdometryFusionParameters) -> None:
        self.parameters = parameters
        self.value = 0.0
        self._samples = 0
        self._stood_for = 0.0

    def is_at_rest(self, twist: Twist, elapsed: float) -> bool:
        """Return whether the wheels have been at rest for `settling_time`.

        Args:
            twist: measured by the wheels.
            elapsed: seconds since the last call.
        """
        p = self.parameters
        still = max(abs(twist.linear), abs(twist.lateral)) < p.still_speed
        still = still and abs(twist.angular) < p.still_turn
        self._stood_for = self._stood_for + elapsed if still else 0.0
        return self._stood_for >= p.settling_time

    def learn(self, rates: FloatArray) -> None:
        """Update the bias with yaw rates (n,) measured at rest, rad/s."""
        self._samples = min(self._samples + rates.size, self.parameters.bias_samples)
        gain = min(1.0, rates.size / self._samples)
        self.value += gain * (float(rates.mean()) - self.value)


def _with_rotation(moved: Pose2D, rotation: float) -> Pose2D:
    """Return the displacement of the same arc length with another rotation in radians."""
    a, b = _arc(moved.heading)
    norm = a * a + b * b
    forward = (a * moved.x + b * moved.y) / norm
    left = (a * moved.y - b * moved.x) / norm
    a, b = _arc(rotation)
    return Pose2D(a * forward - b * left, b * forward + a * left, wrap_angle(rotation))


def _arc(angle: float) -> tuple[float, float]:
    """Return sin(angle) / angle and (1 - cos(angle)) / angle: chord of a unit arc, x and y."""
    if abs(angle) < 1e-6:
        return 1.0 - angle * angle / 6.0, angle / 2.0
    return sin(angle) / angle, (1.0 - cos(angle)) / angle
