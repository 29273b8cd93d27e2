"""Estimator: base class of what estimates the robot's pose in the map frame."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from stack.compilation import KernelTypes
from stack.errors import NavigationError
from stack.frames.buffer import TransformBuffer
from stack.types import FailureCode, FloatArray, Observation, Pose2D, PoseEstimate, Scan

NO_PARTICLES: FloatArray = np.empty((0, 3))
NO_PARTICLES.flags.writeable = False


class Match(Protocol):
    """A pose that explains scans."""

    @property
    def pose(self) -> Pose2D:
        """Map frame."""
        ...

    @property
    def fit(self) -> float:
        """Share of the scans explained, in [0, 1]."""
        ...


class Estimator(ABC):
    """Estimates map -> odom from the measurements of each step."""

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the numba functions that the estimator calls, with the types of their arguments.

        They are compiled before the first step; others are when the run first calls them.
        """
        return ()

    @abstractmethod
    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Process the measurements of a step; return the estimate at the observation's time.

        Args:
            observation: new measurements, scans deskewed.
            frames: with the odometry up to the observation's time; `frames.pose_at("odom", stamp)`
                is the pose at which a measurement was taken.
        """

    @property
    @abstractmethod
    def estimate(self) -> PoseEstimate:
        """The newest estimate."""

    @abstractmethod
    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Restart around a pose.

        Args:
            pose: of the base now, map frame.
            position_deviation: standard deviation, metres.
            heading_deviation: standard deviation, radians.
        """

    @property
    def particles(self) -> FloatArray:
        """(n, 3) x, y, heading of hypotheses in the map frame, for displays; may be empty."""
        return NO_PARTICLES

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose; 0 without a map."""
        return 0.0

    def localise_globally(self, scan: Scan, earlier: Sequence[tuple[Pose2D, Scan]] = ()) -> Match:
        """Restart at the only pose on the map that explains the scans.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame.

        Raises:
            NavigationError: LOST if no pose fits or the estimator cannot search a map, AMBIGUOUS
                if several poses fit.
        """
        raise NavigationError(
            FailureCode.LOST,
            "global relocalisation needs a map, and this mission has `map: none`; add a map, or "
            "set the pose",
        )
