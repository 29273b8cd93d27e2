"""Clouds of weighted poses: moving, summarising and sizing them. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.localisation.distance_field import as_pose
from stack.types import FloatArray, Pose2D, wrap_angle

_BIN = np.array([0.5, 0.5, pi / 18])
"""Metres, metres, radians: AMCL's histogram bins for KLD sampling."""

_KEY = np.array([1, 100_003, 100_003**2])
"""Makes one number of three bin indices."""


@dataclass(frozen=True, slots=True)
class ParticleSet:
    """Weighted poses.

    Attributes:
        poses: (n, 3) x, y, heading.
        weights: (n,), sum 1.
    """

    poses: FloatArray
    weights: FloatArray

    @staticmethod
    def uniform(poses: FloatArray) -> ParticleSet:
        """The poses with equal weights."""
        return ParticleSet(poses, np.full(poses.shape[0], 1.0 / poses.shape[0]))


def move(poses: FloatArray, by: Pose2D) -> FloatArray:
    """(n, 3) poses composed with one displacement in their own frames."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack(
        [
            poses[:, 0] + c * by.x - s * by.y,
            poses[:, 1] + s * by.x + c * by.y,
            poses[:, 2] + by.heading,
        ]
    )


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """The odometry motion model's alphas; variances as in AMCL."""

    alpha_1: float
    alpha_2: float
    alpha_3: float
    alpha_4: float

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """(n, 3) poses moved by a displacement as odometry has it, each with its own error.

        Probabilistic Robotics, 2005, table 5.6: turn, go, turn.
        """
        distance = hypot(moved.x, moved.y)
        first = atan2(moved.y, moved.x)
        second = wrap_angle(moved.heading - first)
        # Driving backwards is not a half turn, a drive and a half turn.
        turn_1, turn_2 = (min(abs(a), pi - abs(a)) for a in (first, second))
        if distance < 0.01:
            # A direction of travel read from less than a centimetre is noise.
            turn_1, turn_2 = 0.0, abs(moved.heading)
        go = self.alpha_3 * distance**2 + self.alpha_4 * (turn_1**2 + turn_2**2)
        deviations = [
            sqrt(self.alpha_1 * turn_1**2 + self.alpha_2 * distance**2),
            sqrt(go),
            sqrt(self.alpha_1 * turn_2**2 + self.alpha_2 * distance**2),
        ]
        errors = generator.normal(0.0, deviations, (poses.shape[0], 3))
        leaving = poses[:, 2] + first + errors[:, 0]
        gone = distance + errors[:, 1]
        return np.column_stack(
            [
                poses[:, 0] + gone * np.cos(leaving),
                poses[:, 1] + gone * np.sin(leaving),
                leaving + second + errors[:, 2],
            ]
        )


@dataclass(frozen=True, slots=True)
class OmniMotionNoise:
    """The same for robots that go any way without turning first, as AMCL's omnidirectional model.

    Turn, go, turn would take every sideways step for two quarter turns and blur the heading. Here
    the error lies along the way gone, across it, and in the heading.
    """

    alpha_1: float
    alpha_2: float
    alpha_3: float
    alpha_4: float
    alpha_5: float

    def sample(
        self, poses: FloatArray, moved: Pose2D, generator: np.random.Generator
    ) -> FloatArray:
        """(n, 3) poses moved by a displacement as odometry has it, each with its own error."""
        way, turn = moved.x**2 + moved.y**2, moved.heading**2
        deviations = [
            sqrt(self.alpha_3 * way + self.alpha_4 * turn),
            sqrt(self.alpha_5 * way + self.alpha_4 * turn),
            sqrt(self.alpha_1 * turn + self.alpha_2 * way),
        ]
        errors = generator.normal(0.0, deviations, (poses.shape[0], 3))
        going = poses[:, 2] + atan2(moved.y, moved.x)
        c, s = np.cos(going), np.sin(going)
        along, across = sqrt(way) + errors[:, 0], errors[:, 1]
        return np.column_stack(
            [
                poses[:, 0] + along * c - across * s,
                poses[:, 1] + along * s + across * c,
                poses[:, 2] + moved.heading + errors[:, 2],
            ]
        )


def summarise(cloud: ParticleSet) -> tuple[Pose2D, FloatArray]:
    """The mean of the heaviest cluster and the whole cloud's (3, 3) covariance about it."""
    mean = _mean(cloud.poses, cloud.weights)
    covariance = _covariance(cloud, mean)
    if covariance[0, 0] + covariance[1, 1] > 0.5**2 or covariance[2, 2] > 0.5**2:
        # Between two clusters there may be a wall.
        near = _heaviest_cluster(cloud)
        mean = _mean(cloud.poses[near], cloud.weights[near])
        covariance = _covariance(cloud, mean)
    return as_pose(mean), covariance


def _mean(poses: FloatArray, weights: FloatArray) -> FloatArray:
    x, y = weights @ poses[:, :2] / weights.sum()
    heading = atan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2]))
    return np.array([x, y, heading])


def _offsets(poses: FloatArray, centre: FloatArray) -> FloatArray:
    off: FloatArray = poses - centre
    off[:, 2] = (off[:, 2] + pi) % (2.0 * pi) - pi
    return off


def _covariance(cloud: ParticleSet, centre: FloatArray) -> FloatArray:
    off = _offsets(cloud.poses, centre)
    covariance: FloatArray = (off * cloud.weights[:, None]).T @ off
    return covariance


def _heaviest_cluster(cloud: ParticleSet) -> NDArray[np.bool_]:
    """(n,) which particles lie round the mean of the heaviest bin of 1 m by 1 m by 45 degrees."""
    keys = np.floor(cloud.poses / np.array([1.0, 1.0, pi / 4])).astype(np.int64)
    keys[:, 2] %= 8
    _, which = np.unique(keys @ _KEY, return_inverse=True)
    inside = which == np.bincount(which, weights=cloud.weights).argmax()
    centre = _mean(cloud.poses[inside], cloud.weights[inside])
    off = _offsets(cloud.poses, centre)
    near: NDArray[np.bool_] = (np.hypot(off[:, 0], off[:, 1]) < 0.7) & (np.abs(off[:, 2]) < 0.7)
    return near if near.any() else inside


def kld_bound(poses: FloatArray) -> int:
    """Particles needed for an error of 0.05 with probability 0.99, given bins they occupy.

    Fox 2003, equation 7.

    Args:
        poses: (n, 3) equally weighted.
    """
    keys = np.floor(poses / _BIN).astype(np.int64)
    keys[:, 2] %= 36
    occupied = np.unique(keys @ _KEY).size
    if occupied <= 1:
        return 1
    a = 2.0 / (9.0 * (occupied - 1))
    return int((occupied - 1) / (2.0 * 0.05) * (1.0 - a + sqrt(a) * 2.33) ** 3)
