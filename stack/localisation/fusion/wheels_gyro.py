"""Odometry of wheels and gyro: translation from the wheels, rotation from the gyro.

The base is assumed to move on an arc during a step. The closed-form logarithm of SE(2) decomposes
the wheels' displacement, the gyro's rotation replaces theirs, and the exponential composes both:
exact for any constant twist. The gyro's bias is its mean rate while the wheels are at rest (a
zero-velocity update; P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated
Navigation Systems, 2013, chapter 15).
"""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np

from stack.components import OdometryFusion
from stack.drivetrain.description import ImuDescription, RobotDescription
from stack.drivetrain.drivetrain import Drivetrain
from stack.errors import BodyError
from stack.localisation.fusion.gyro import GyroIntegral, Standstill
from stack.localisation.parameters import OdometryFusionParameters
from stack.types import FloatArray, Observation, Odometry, Pose2D, Twist, wrap_angle

BIAS_DEVIATIONS = 5.0
"""At standstill, a rate farther than this from the bias is a rotation by hand; in deviations of the
bias, or of a sample if these are larger."""
LEAST_SLIP = 0.005
"""Of a wheel on its first metre, metres: no floor is even."""
BIAS_SAMPLES = 1000
"""Number of samples over which the bias is averaged."""


class WheelGyroOdometry(OdometryFusion):
    """Translation of the wheels and rotation of the gyro; no other sensor corrects them.

    Without inertial samples for `gyro_timeout`, the wheels measure the rotation, and the error by
    their slip is stated; with a gyro none is. The robot stands for the first `settling_time`, in
    which the gyro's bias is measured.
    """

    Parameters = OdometryFusionParameters
    parameters: OdometryFusionParameters

    def __init__(self, parameters: OdometryFusionParameters, robot: RobotDescription) -> None:
        super().__init__(parameters, robot)
        self._fused: Odometry | None = None
        self._wheels = Pose2D(0.0, 0.0)
        self._bias, self._gyro, self._standstill = 0.0, GyroIntegral(), Standstill()
        self._samples, self._has_gyro = 0, robot.imu is not None
        imu = robot.imu or ImuDescription()
        self._bias_tolerance = BIAS_DEVIATIONS * max(imu.gyro_bias, imu.gyro_noise)
        self._slip = wheel_slip(robot)

    @property
    def is_ready(self) -> bool:
        """Whether the gyro's bias has been measured; always without a gyro."""
        return not self._has_gyro or self._standstill.first_is_over(self._gyro, self.parameters)

    @property
    def gyro_bias(self) -> float:
        """The bias subtracted from the gyro's yaw rate, rad/s."""
        return self._bias

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
            self._gyro.begin(observation.time)
            self._gyro_rotation(observation, wheels, 0.0)
            return wheels
        elapsed = observation.time - self._fused.stamp
        if elapsed <= 0.0:
            return self._fused
        moved = wheels.pose.relative_to(self._wheels)
        rotation = self._gyro_rotation(observation, wheels, elapsed)
        angular = moved.heading if rotation is None else rotation
        pose = self._fused.pose.compose(with_rotation(moved, angular))
        self._wheels = wheels.pose
        if rotation is None:
            error = self._slip.covariance(moved)
            self._fused = Odometry(observation.time, pose, wheels.twist, error)
        else:
            twist = Twist(wheels.twist.linear, angular / elapsed, wheels.twist.lateral)
            self._fused = Odometry(observation.time, pose, twist)
        return self._fused

    def _gyro_rotation(
        self, observation: Observation, wheels: Odometry, elapsed: float
    ) -> float | None:
        """Return the gyro's rotation since the last observation, radians; None without samples."""
        imu, p = observation.imu, self.parameters
        raw = self._gyro.rotation(imu, observation.time, p.gyro_timeout)
        standing = self._standstill.lasts(wheels.twist, elapsed, p)
        if raw is None:
            return None
        by_hand = False
        if imu is not None and imu.stamps.size:
            rates = imu.angular_velocity[:, 2]
            mean = float(rates.sum()) / rates.size
            by_hand = abs(mean - self._bias) > self._bias_tolerance
            if standing and not by_hand:
                self._learn_bias(mean, rates.size)
            if wheels.twist == Twist() and not by_hand:
                return 0.0
        return raw - self._bias * elapsed

    def _learn_bias(self, mean: float, samples: int) -> None:
        """Update the bias with the mean of some yaw rates at rest: a plain mean at first."""
        self._samples = min(self._samples + samples, BIAS_SAMPLES)
        self._bias += min(1.0, samples / self._samples) * (mean - self._bias)


class WheelSlip:
    """Covariance of a displacement measured by wheels that slip independently.

    A wheel that rolls r metres slips by a distance of the variance slip² r. The heading error is
    the larger, the narrower the track: slip sqrt(2) / track radians on the first metre of a
    differential robot.

    Args:
        drivetrain: of the robot.
        slip: standard deviation of the slip of a wheel on its first metre, metres.
    """

    def __init__(self, drivetrain: Drivetrain, slip: float) -> None:
        count = drivetrain.encoders
        moved = [drivetrain.from_wheels([0.0] * count, unit.tolist()) for unit in np.eye(count)]
        self._gains = slip * np.array([(pose.x, pose.y, pose.heading) for pose in moved]).T
        turns = np.array([abs(pose.heading) for pose in moved])
        self._levers = 1.0 / (count * turns)

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of a displacement, in its frame: m, m, rad.

        Each wheel is taken to roll the whole distance, and the arc of the turn.
        """
        rolled = hypot(moved.x, moved.y) + abs(moved.heading) * self._levers
        total: FloatArray = (self._gains * rolled) @ self._gains.T
        return total


def wheel_slip(robot: RobotDescription) -> WheelSlip:
    """Return the slip of a robot's wheels, as its file states it."""
    return WheelSlip(robot.drivetrain, max(robot.odometry.slip, LEAST_SLIP))


def with_rotation(moved: Pose2D, rotation: float) -> Pose2D:
    """Return the displacement of the same arc length with another rotation in radians."""
    forward, left = arc_lengths(moved)
    a, b = arc(rotation)
    return Pose2D(a * forward - b * left, b * forward + a * left, wrap_angle(rotation))


def arc_lengths(moved: Pose2D) -> tuple[float, float]:
    """Return the lengths forward and to the left of the arc that leads to a displacement."""
    a, b = arc(moved.heading)
    norm = a * a + b * b
    return (a * moved.x + b * moved.y) / norm, (a * moved.y - b * moved.x) / norm


def arc(angle: float) -> tuple[float, float]:
    """Return sin(angle) / angle and (1 - cos(angle)) / angle: chord of a unit arc, x and y."""
    if abs(angle) < 1e-6:
        return 1.0 - angle * angle / 6.0, angle / 2.0
    return sin(angle) / angle, (1.0 - cos(angle)) / angle
