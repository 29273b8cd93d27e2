"""Where the robot is, for behaviours."""

from __future__ import annotations

from typing import Protocol

from stack.robot.task import Task
from stack.types import Pose2D, PoseEstimate


class Localisation(Protocol):
    """Where the robot is, and how it finds its pose."""

    @property
    def estimate(self) -> PoseEstimate:
        """Pose in the map frame with covariance and health of the localisation."""

    @property
    def pose(self) -> Pose2D:
        """Estimated pose of the robot, map frame."""
        return self.estimate.pose

    @property
    def health(self) -> float:
        """Calibrated probability in [0, 1] that the pose is within 0.3 m and 10 degrees."""
        return self.estimate.health

    def fit_at(self, pose: Pose2D) -> float:
        """Health in [0, 1] that localisation would have with the newest scan at this pose."""

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Reset the localisation to a pose with uncertainty.

        Args:
            pose: map frame.
            position_deviation: standard deviation of the position, metres.
            heading_deviation: standard deviation of the heading, radians.
            source: origin of the pose for the report, e.g. `marker`.
        """

    def relocalise(self) -> Task:
        """Find the pose anywhere on the map from the lidar.

        Fails with AMBIGUOUS if other poses explain the scans as well; `estimate.rivals` has them.
        """
