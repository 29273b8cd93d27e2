"""Odometry and pose of a robot that cannot move: both are known."""

from __future__ import annotations

import numpy as np

from stack.components import Estimator, OdometryFusion
from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.localisation.parameters import DeadReckoningParameters
from stack.types import STANDSTILL, Observation, Odometry, Pose2D, PoseEstimate


class FixedOdometry(OdometryFusion):
    """A pose that stays at the origin of the odom frame, without error."""

    def update(self, observation: Observation) -> Odometry:
        """Return the odometry at the time of the observation."""
        return Odometry(observation.time, Pose2D(0.0, 0.0), STANDSTILL)


class KnownPose(Estimator):
    """The pose that the mission begins with; at the map's origin if that is unknown."""

    parameters: DeadReckoningParameters

    def __init__(self, robot: RobotDescription) -> None:
        super().__init__(DeadReckoningParameters(), robot, None, 0)
        self.start(None)

    def start(self, pose: Pose2D | None) -> None:
        """Take a pose, map frame."""
        at = pose or Pose2D(0.0, 0.0)
        self._estimate = PoseEstimate(at, np.zeros((3, 3)), 1.0, at)

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Return the pose."""
        return self._estimate

    @property
    def estimate(self) -> PoseEstimate:
        """The pose, without doubt."""
        return self._estimate

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Take a pose, map frame; it has no deviation."""
        self.start(pose)
