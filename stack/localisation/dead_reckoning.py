"""Dead reckoning: the estimator of missions without a map.

The map frame is the odom frame, placed at the initial pose. The pose never jumps and drifts without
bound; its covariance states the drift.
"""

from __future__ import annotations

import numpy as np

from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.localisation.fusion.wheels_gyro import wheel_slip
from stack.localisation.marker_mixture import Mixture, carried
from stack.localisation.parameters import DeadReckoningParameters
from stack.localisation.planar import lever
from stack.types import FloatArray, MarkerFix, Observation, OccupancyGrid, Pose2D, PoseEstimate

HEADING_VARIANCE_PER_METRE, HEADING_VARIANCE_PER_RADIAN = 1e-5, 2e-4
"""Variance of the heading per metre driven, rad²/m, and per radian turned, rad²/rad: arcs between
two measurements. The errors of gyro or wheels come in addition."""

_VOLUME = 2000.0
"""m² rad; poses among which a false measurement of markers is: about 18 m by 18 m."""


class DeadReckoning(Estimator):
    """Pose estimate from odometry only; it drifts.

    The covariance follows the first-order propagation P' = F P Fᵀ + Q of a step (S. Thrun,
    W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapter 3.3). Q is proportional to distance
    and rotation, so that the result does not depend on the step size; its factors follow from slip
    and gyro in the robot file.
    """

    Parameters = DeadReckoningParameters
    needs_initial_pose = True
    uses_markers = True
    parameters: DeadReckoningParameters

    def __init__(
        self,
        parameters: DeadReckoningParameters,
        robot: RobotDescription,
        grid: OccupancyGrid | None,
        seed: int,
    ) -> None:
        super().__init__(parameters, robot, grid, seed)
        self._map_from_odom = Pose2D(0.0, 0.0)
        self._odometry: Pose2D | None = None
        self._covariance: FloatArray = np.zeros((3, 3))
        self._slip = wheel_slip(robot)
        self._metre = float(self._slip.covariance(Pose2D(1.0, 0.0))[0, 0])
        self._gyro = robot.imu
        self._time, self._corrected_at = 0.0, 0.0

    def start(self, pose: Pose2D | None) -> None:
        """Place the odom frame at the initial pose; at the map's origin if that is unknown."""
        if pose is not None:
            self._map_from_odom = pose

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Restart at a pose in the map frame; standard deviations in metres and radians."""
        odometry = self._odometry or Pose2D(0.0, 0.0)
        self._map_from_odom = pose.compose(odometry.inverse())
        deviations = [position_deviation, position_deviation, heading_deviation]
        self._covariance = np.diag(np.square(deviations))
        self._corrected_at = self._time

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Update the estimate with odometry; scans have no effect without a map."""
        self._time = observation.time
        self.follow(frames.pose_at("odom", observation.time))
        return self.estimate

    def update_markers(self, fix: MarkerFix, frames: TransformBuffer) -> PoseEstimate:
        """Correct the pose as a Kalman filter does; without markers in view it drifts again."""
        if self._odometry is None or not frames.covers(fix.stamp):
            return self.estimate
        since = frames.motion(fix.stamp, frames.newest)
        noise = frames.motion_covariance(fix.stamp, frames.newest)
        components = [carried(one, since, noise) for one in fix.candidates]
        likelihood = Mixture(components, _VOLUME)
        pose, self._covariance = likelihood.posterior(self.estimate.pose, self._covariance)
        self._map_from_odom = pose.compose(self._odometry.inverse())
        self._corrected_at = max(self._corrected_at, fix.stamp)
        return self.estimate

    def follow(self, odometry: Pose2D) -> None:
        """Update the estimate with a pose of the odom frame."""
        if self._odometry is None:
            self._map_from_odom = self._map_from_odom.compose(odometry.inverse())
        elif odometry != self._odometry:
            before = self.estimate.pose
            self._propagate_covariance(before, odometry.relative_to(self._odometry))
        self._odometry = odometry

    @property
    def estimate(self) -> PoseEstimate:
        """The dead-reckoned pose in the map frame; its health is 1, since no scan is compared."""
        pose = self._map_from_odom.compose(self._odometry or Pose2D(0.0, 0.0))
        return PoseEstimate(pose, self._covariance, 1.0, self._map_from_odom, self._corrected_at)

    def _propagate_covariance(self, before: Pose2D, moved: Pose2D) -> None:
        """Propagate the covariance over one step, `moved` in the frame of the previous pose."""
        step = lever(before.heading, moved)
        distance = float(np.hypot(moved.x, moved.y))
        turned = abs(moved.heading)
        heading = HEADING_VARIANCE_PER_METRE * distance + HEADING_VARIANCE_PER_RADIAN * turned
        if self._gyro is None:
            heading += float(self._slip.covariance(moved)[2, 2])
        else:
            heading += self._gyro.gyro_scale_error**2 * turned
        noise = np.diag([self._metre * distance, self._metre * distance, heading])
        self._covariance = step @ self._covariance @ step.T + noise
