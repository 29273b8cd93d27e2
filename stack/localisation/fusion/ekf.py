"""Odometry by an extended Kalman filter: wheels, gyro, accelerometer, scan matching, other sources.

The filter is planar with eight states: x, y, heading (odom frame); v_x, v_y, yaw rate (base frame);
bias of the gyro; relative error of the wheels' scale. Fifteen states would add height, roll, pitch
and the accelerometer's biases: nothing that a planar stack uses observes them. The pose of the last
keyframe is cloned into the state, so that a scan matched to it is a relative measurement
(S. Roumeliotis, J. Burdick, "Stochastic cloning", ICRA 2002).

Wheels and gyro are the input of the prediction, not measurements of a motion model: their
displacement is integrated in closed form on an arc, exactly for a constant twist and without lag.
All other sources correct it. Where gyro, accelerometer or scan matching contradict the wheels, the
robot slips or is pushed: the filter then predicts with the accelerometer alone from the moment on
when the contradiction began, its velocity is uncertain, and the scan matching carries the pose.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stack.compilation import KernelTypes
from stack.components import OdometryFusion
from stack.drivetrain.description import ImuDescription, RobotDescription
from stack.errors import BodyError
from stack.localisation.fusion.disturbance import Compared, InertialComparison, VelocityGain
from stack.localisation.fusion.gyro import GyroIntegral, Standstill
from stack.localisation.fusion.parameters import EkfParameters
from stack.localisation.fusion.wheels_gyro import BIAS_DEVIATIONS, arc_lengths, wheel_slip
from stack.types import (
    STANDSTILL,
    FloatArray,
    Observation,
    Odometry,
    Pose2D,
    Scan,
    Twist,
    wrap_angle,
)

if TYPE_CHECKING:
    from stack.localisation.fusion.history import History

LATERAL_SHARE = 0.1
"""Variance across the motion as a share of that along it: wheels also slide sideways, which no
encoder shows."""
TIMING_VARIANCE, TIMING_TURN_VARIANCE = 4e-8, 1e-6
"""Added to the variance of the gyro's rotation per second and per radian turned: its stamps and
those of the wheels differ by some milliseconds."""
BIAS_FACTOR = 2.0
"""Deviation of the gyro's bias at the start, in that of the robot file: it was measured at another
temperature."""
BIAS_VARIANCE = 1e-10
"""Growth of the variance of the gyro's bias, rad²/s³: after an hour a few percent of a usual bias,
so that each standstill still counts."""
DISTURBED_TIME = 0.3
"""Wheels are used again after so long without disagreement, s."""
DISTURBED_SPEED = 2.0
"""Standard deviation of the velocity when a disturbance begins; rad/s for rotation, m/s."""
DISTURBED_VARIANCE = 20.0
"""Growth of the variance of the velocity while disturbed, m²/s³."""
DISTURBED_TURN_DEVIATION = 1.0
"""Standard deviation of the gyro while disturbed: it may have been beyond its range, rad/s."""
SLIP_DECAY = 0.3
"""Time constant with which the velocity of a disturbed robot returns to the wheels', s."""

SAMPLES_RELATED = 4.0
"""Factor of the variance of the gyro's mean at standstill: its samples are not independent."""

CORRECTION_SHARE = 0.5
"""Standard deviation of a corrected pose's displacement, as a share of the correction."""


class EkfOdometry(OdometryFusion):
    """Wheels, gyro, accelerometer and scan matching, fused by an extended Kalman filter."""

    Parameters = EkfParameters
    parameters: EkfParameters

    @staticmethod
    def kernels(parameters: EkfParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of the filter and of scan matching."""
        from stack.localisation.fusion import kernels
        from stack.localisation.fusion.scan_matching.kernels import MATCHING

        matched = MATCHING if parameters.scan_matching and robot.all_lidars else ()
        return (*kernels.FUSION, *matched)

    def __init__(self, parameters: EkfParameters, robot: RobotDescription) -> None:
        from stack.localisation.fusion import history, kernels, measurements
        from stack.localisation.fusion.scan_odometry import ScanOdometry
        from stack.localisation.fusion.sources import Source

        super().__init__(parameters, robot)
        self._kernels, self._measurements = kernels, measurements
        self._new_history = history.History
        self._robot = robot
        self._scans = ScanOdometry(robot.range_noise(parameters.lidar))
        self._sources = [Source(source) for source in parameters.sources]
        self._gyro, self._standstill = GyroIntegral(), Standstill()
        self._has_gyro = robot.imu is not None
        self._imu = robot.imu or ImuDescription()
        self._bias_tolerance = BIAS_DEVIATIONS * max(self._imu.gyro_bias, self._imu.gyro_noise)
        self._gain, self._inertial = VelocityGain(), InertialComparison(self._imu)
        self._history: History | None = None
        self._wheels = Pose2D(0.0, 0.0)
        self._fused: Odometry | None = None
        self._disturbed_until = -1.0

    def configure(self, parameters: EkfParameters) -> None:
        """Apply new parameters; the state stays."""
        from stack.localisation.fusion.scan_odometry import ScanOdometry
        from stack.localisation.fusion.sources import Source

        before, self.parameters = self.parameters, parameters
        if parameters.sources != before.sources:
            self._sources = [Source(source) for source in parameters.sources]
        if parameters.lidar != before.lidar:
            self._scans = ScanOdometry(self._robot.range_noise(parameters.lidar))
        if self._history is not None:
            self._history.configure(parameters.history)

    @property
    def gyro_bias(self) -> float:
        """The estimated bias of the gyro's yaw rate, rad/s."""
        return 0.0 if self._history is None else float(self._history.newest.state[6])

    @property
    def is_ready(self) -> bool:
        """Whether the gyro's bias has been measured; always without a gyro."""
        return not self._has_gyro or self._standstill.first_is_over(self._gyro, self.parameters)

    def update(self, observation: Observation) -> Odometry:
        """Process one observation; return pose (odom frame) and twist (base frame).

        Raises:
            BodyError: the observation has no wheel odometry.
        """
        wheels, now = observation.wheels, observation.time
        if wheels is None:
            raise BodyError("the robot delivers no wheel odometry")
        if self._history is None or self._fused is None:
            self._begin(observation, wheels)
            self._fused = wheels
            return wheels
        elapsed = now - self._fused.stamp
        if elapsed <= 0.0:
            return self._fused
        self._move(self._history, observation, wheels, elapsed)
        for source in self._sources:
            source.fuse(observation, self._history)
        self._match(self._history, observation, now)
        self._fused = self._output(self._history, wheels, now)
        return self._fused

    def _begin(self, observation: Observation, wheels: Odometry) -> None:
        p, k = self.parameters, self._kernels
        state, covariance = np.zeros(k.SIZE), np.zeros((k.SIZE, k.SIZE))
        state[:3] = state[k.KEYFRAME :] = wheels.pose.x, wheels.pose.y, wheels.pose.heading
        imu = self._imu
        covariance[k.BIAS, k.BIAS] = max(BIAS_FACTOR * imu.gyro_bias, imu.gyro_noise) ** 2
        covariance[k.SCALE, k.SCALE] = self._robot.odometry.scale_error**2
        now = observation.time
        self._history = self._new_history(now, state, covariance, _noise(self._robot), p.history)
        self._wheels = wheels.pose
        self._gyro.begin(now)
        self._gyro.rotation(observation.imu, now, p.gyro_timeout)
        self._gain.between(observation.imu, now)

    def _move(
        self, history: History, observation: Observation, wheels: Odometry, elapsed: float
    ) -> None:
        """Predict over the step with wheels and inertial sensor; compare them."""
        p, now, imu = self.parameters, observation.time, observation.imu
        moved = wheels.pose.relative_to(self._wheels)
        self._wheels = wheels.pose
        raw = self._gyro.rotation(imu, now, p.gyro_timeout)
        gained = self._gain.between(imu, now)
        standing = self._standstill.lasts(wheels.twist, elapsed, p)
        begin, bias = history.newest.key[0], self.gyro_bias
        samples, rate = 0, 0.0
        if imu is not None and imu.stamps.size:
            samples = imu.stamps.size
            rate = float(np.add.reduce(imu.angular_velocity[:, 2])) / samples
        by_hand = samples > 0 and abs(rate - bias) > self._bias_tolerance
        at_rest = samples > 0 and not by_hand and wheels.twist == STANDSTILL
        rotated = None if raw is None else (0.0 if at_rest else raw - bias * elapsed)
        given = _input(elapsed, moved, raw, gained, at_rest)
        turned = wheels.twist.angular * elapsed
        step = Compared(begin, now, turned, rotated, gained, wheels.twist)
        since = self._inertial.since(step)
        if since is not None:
            history.disturb(since)
            self._disturbed_until = now + DISTURBED_TIME
        history.move(given, disturbed=now <= self._disturbed_until)
        if standing and samples and not by_hand:
            self._learn_bias(history, now, rate, samples)

    def _learn_bias(self, history: History, now: float, rate: float, samples: int) -> None:
        """Measure the bias by the mean rate of some samples at standstill, rad/s."""
        variance = self._imu.gyro_noise**2 / samples * SAMPLES_RELATED
        history.add(
            self._measurements.StateMeasurement(
                now, "standstill", (self._kernels.BIAS,), np.array([rate]), np.array([[variance]])
            )
        )

    def _match(self, history: History, observation: Observation, now: float) -> None:
        """Match a new scan of the lidar; extend the disturbance while the wheels contradict it."""
        p = self.parameters
        name = p.lidar or self._robot.main_lidar
        scan = observation.named(name, Scan) if p.scan_matching and name else None
        if scan is None:
            return
        if self._scans.fuse(scan, history, disturbed=now <= self._disturbed_until):
            self._disturbed_until = now + DISTURBED_TIME

    def _output(self, history: History, wheels: Odometry, now: float) -> Odometry:
        """Return the odometry of this step, with the errors of the motions in it."""
        assert self._fused is not None
        newest = history.newest
        x, y, heading, u, v, rate = newest.state[:6].tolist()
        disturbed = now <= self._disturbed_until
        twist = Twist(u, rate, v)
        if not disturbed:
            turning = wheels.twist.angular if self._gyro.is_silent else rate
            twist = Twist(wheels.twist.linear, turning, wheels.twist.lateral)
        pose = Pose2D(x, y, wrap_angle(heading))
        covariance = self._step_covariance(history, self._fused)
        return Odometry(now, pose, twist, covariance, disturbed)

    def _step_covariance(self, history: History, last: Odometry) -> FloatArray:
        """Return the (3, 3) error of the displacement in this step, base frame at its end.

        It is the error of the motions since the last odometry, reduced by what scan matching knows
        of it. Where a correction moved the pose, the part beyond that error is added.
        """
        total, node = history.motion_error(last.stamp), history.at(last.stamp)
        keep = self._scans.remaining(history.newest.key[0])
        if keep is not None:
            total *= keep[:, None] * keep
        if node is not None and node.pose != last.pose:
            # The displacement of this step contains the corrections of the poses before it.
            shift = node.pose.relative_to(last.pose)
            for axis, jump in enumerate((shift.x, shift.y, shift.heading)):
                total[axis, axis] += (CORRECTION_SHARE * jump) ** 2
        return total


def _noise(robot: RobotDescription) -> FloatArray:
    """Return the noise (11,) of the kernel `predict`."""
    imu, slip = robot.imu or ImuDescription(), wheel_slip(robot)
    metre = slip.covariance(Pose2D(1.0, 0.0)).diagonal()
    radian = slip.covariance(Pose2D(0.0, 0.0, 1.0))[2, 2] + robot.turn_deviation**2
    return np.array([
        metre[0], max(metre[1], LATERAL_SHARE * metre[0]), radian, metre[2],
        imu.gyro_noise**2 / imu.rate + TIMING_VARIANCE,
        imu.gyro_scale_error**2 + TIMING_TURN_VARIANCE, DISTURBED_SPEED**2, DISTURBED_VARIANCE,
        SLIP_DECAY, BIAS_VARIANCE, DISTURBED_TURN_DEVIATION**2,
    ])  # fmt: skip


def _input(
    elapsed: float,
    moved: Pose2D,
    raw: float | None,
    gained: tuple[float, float] | None,
    at_rest: bool,
) -> FloatArray:
    """Return the input (9,) of the kernel `predict`: the wheels' displacement as an arc."""
    return np.array([
        elapsed, *arc_lengths(moved), moved.heading, 0.0 if raw is None else raw,
        *(gained or (0.0, 0.0)), float(raw is not None), float(at_rest),
    ])  # fmt: skip
