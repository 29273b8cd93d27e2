"""Dead reckoning alone: where the robot is when there is no map to find itself on.

The map frame is the odom frame, laid where the robot was believed to stand when it began. The pose
never jumps and drifts for ever; its covariance says by how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import NoReturn

import numpy as np

from stack.errors import NavigationError
from stack.types import FailureCode, FloatArray, Pose2D, PoseEstimate, Scan

DISTANCE_VARIANCE = 2e-4
"""m² of position per metre driven: 1.4 cm after a metre, as good wheels on a clean floor."""

HEADING_VARIANCE_PER_METRE, HEADING_VARIANCE_PER_TURN = 1e-5, 2e-4
"""rad² of heading per metre driven and per radian turned: a gyro whose bias is known."""

NO_PARTICLES: FloatArray = np.empty((0, 3))
NO_PARTICLES.flags.writeable = False


class DeadReckoning:
    """The estimator of missions without a map, with the same face as `Localiser`.

    The covariance follows the first-order propagation P' = F P Fᵀ + Q of a step (S. Thrun,
    W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapter 3.3), Q growing with the way driven
    and turned, so that it does not depend on how finely the way is cut into steps.

    Args:
        pose: where the robot is believed to stand, map frame.
    """

    def __init__(self, pose: Pose2D) -> None:
        self._map_from_odom = pose
        self._odometry: Pose2D | None = None
        self._covariance: FloatArray = np.zeros((3, 3))

    def start(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Be at a pose of the map frame; standard deviations in metres and radians."""
        odometry = self._odometry or Pose2D(0.0, 0.0)
        self._map_from_odom = pose.compose(odometry.inverse())
        deviations = [position_deviation, position_deviation, heading_deviation]
        self._covariance = np.diag(np.square(deviations))

    def update(self, odometry: Pose2D, scan: Scan | None) -> None:
        """Take in the newest dead reckoning; scans say nothing without a map.

        Args:
            odometry: pose in the odom frame.
            scan: taken there, or None.
        """
        if self._odometry is None:
            self._map_from_odom = self._map_from_odom.compose(odometry.inverse())
        elif odometry != self._odometry:
            before = self.estimate.pose
            self._spread(before, odometry.relative_to(self._odometry))
        self._odometry = odometry

    @property
    def estimate(self) -> PoseEstimate:
        """The dead-reckoned pose in the map frame; of health 1, since no scan can contradict."""
        pose = self._map_from_odom.compose(self._odometry or Pose2D(0.0, 0.0))
        return PoseEstimate(pose, self._covariance, 1.0)

    @property
    def map_from_odom(self) -> Pose2D:
        """The odom frame's pose in the map frame."""
        return self._map_from_odom

    @property
    def particles(self) -> FloatArray:
        """(0, 3): there is one pose, not a cloud."""
        return NO_PARTICLES

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """0: no scan fits a pose better than another without a map."""
        return 0.0

    def relocalise_globally(
        self, scan: Scan, earlier: Sequence[tuple[Pose2D, Scan]] = ()
    ) -> NoReturn:
        """Fail: there is nothing to compare the scans with.

        Raises:
            NavigationError: LOST, always.
        """
        raise NavigationError(
            FailureCode.LOST,
            "this mission drives without a map (`map: none`), so there is none to find the place "
            "on; give it a map, or set the pose",
        )

    def _spread(self, before: Pose2D, moved: Pose2D) -> None:
        """Let the covariance grow by one step, `moved` in the frame of the pose before."""
        c, s = cos(before.heading), sin(before.heading)
        step = np.eye(3)
        step[0, 2] = -s * moved.x - c * moved.y
        step[1, 2] = c * moved.x - s * moved.y
        way = float(np.hypot(moved.x, moved.y))
        turned = abs(moved.heading)
        noise = np.diag([
            DISTANCE_VARIANCE * way,
            DISTANCE_VARIANCE * way,
            HEADING_VARIANCE_PER_METRE * way + HEADING_VARIANCE_PER_TURN * turned,
        ])  # fmt: skip
        self._covariance = step @ self._covariance @ step.T + noise
