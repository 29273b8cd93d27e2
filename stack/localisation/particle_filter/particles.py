"""Particle sets: mean and covariance, clusters, KLD bound. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.localisation.planar import as_pose
from stack.types import FloatArray, Pose2D

_BIN = np.array([0.5, 0.5, pi / 18])
"""Metres, metres, radians: AMCL's histogram bins for KLD sampling."""

_KEY = np.array([1, 100_003, 100_003**2])
"""Factors that combine three bin indices into one key."""


@dataclass(frozen=True, slots=True)
class ParticleSet:
    """Particle filter state: poses and weights.

    Attributes:
        poses: (n, 3) x, y, heading; map frame.
        weights: (n,), sum 1.
    """

    poses: FloatArray
    weights: FloatArray

    @staticmethod
    def uniform(poses: FloatArray) -> ParticleSet:
        """Return a set of poses (n, 3) with equal weights."""
        return ParticleSet(poses, np.full(poses.shape[0], 1.0 / poses.shape[0]))


def resampled(weights: FloatArray, count: int, offset: float) -> NDArray[np.int64]:
    """Return the indices (count,) of particles drawn with low variance.

    S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, table 4.4.

    Args:
        weights: (n,), sum 1.
        count: number of particles to draw.
        offset: one uniform draw from [0, 1).
    """
    targets = (np.arange(count) + offset) * (1.0 / count)
    return np.minimum(np.searchsorted(np.cumsum(weights), targets), weights.size - 1)


def move(poses: FloatArray, by: Pose2D) -> FloatArray:
    """Return (n, 3) poses composed with one displacement in the frame of each pose."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    moved = np.empty((len(poses), 3))
    moved[:, 0] = poses[:, 0] + c * by.x - s * by.y
    moved[:, 1] = poses[:, 1] + s * by.x + c * by.y
    moved[:, 2] = poses[:, 2] + by.heading
    return moved


def summarise(particle_set: ParticleSet) -> tuple[Pose2D, FloatArray]:
    """Return the mean of the heaviest cluster and the (3, 3) covariance of all particles."""
    mean = _mean(particle_set.poses, particle_set.weights)
    covariance = _covariance(particle_set, mean)
    if covariance[0, 0] + covariance[1, 1] > 0.5**2 or covariance[2, 2] > 0.5**2:
        # The overall mean of two clusters may be inside a wall.
        near = _heaviest_cluster(particle_set)
        mean = _mean(particle_set.poses[near], particle_set.weights[near])
        covariance = _covariance(particle_set, mean)
    return as_pose(mean), covariance


def _mean(poses: FloatArray, weights: FloatArray) -> FloatArray:
    x, y = weights @ poses[:, :2] / weights.sum()
    heading = atan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2]))
    return np.array([x, y, heading])


def _offsets(poses: FloatArray, centre: FloatArray) -> FloatArray:
    off: FloatArray = poses - centre
    turns = off[:, 2] + pi
    if turns.min() < 0.0 or turns.max() >= 2.0 * pi:  # rare, and the remainder is slow
        turns %= 2.0 * pi
    off[:, 2] = turns - pi
    return off


def _covariance(particle_set: ParticleSet, centre: FloatArray) -> FloatArray:
    off = _offsets(particle_set.poses, centre)
    covariance: FloatArray = (off * particle_set.weights[:, None]).T @ off
    return covariance


def _heaviest_cluster(particle_set: ParticleSet) -> NDArray[np.bool_]:
    """Return the (n,) particles around the mean of the heaviest bin (1 m by 1 m by 45 degrees)."""
    keys = np.floor(particle_set.poses / np.array([1.0, 1.0, pi / 4])).astype(np.int64)
    keys[:, 2] %= 8
    _, which = np.unique(keys @ _KEY, return_inverse=True)
    inside = which == np.bincount(which, weights=particle_set.weights).argmax()
    centre = _mean(particle_set.poses[inside], particle_set.weights[inside])
    off = _offsets(particle_set.poses, centre)
    near: NDArray[np.bool_] = (np.hypot(off[:, 0], off[:, 1]) < 0.7) & (np.abs(off[:, 2]) < 0.7)
    return near if near.any() else inside


def kld_bound(poses: FloatArray, error: float, quantile: float) -> int:
    """Return the number of particles that keeps the error of their distribution small.

    D. Fox 2003, equation 7, with the number of occupied bins.

    Args:
        poses: (n, 3) equally weighted.
        error: bound of the Kullback-Leibler divergence from the true distribution.
        quantile: of the standard normal distribution for the probability that it is kept.
    """
    bins = np.floor(poses / _BIN)
    headings = bins[:, 2] - 36.0 * np.floor(bins[:, 2] / 36.0)
    # Exact up to 2**53, as integers are, and faster.
    keys = bins[:, 0] + _KEY[1] * bins[:, 1] + _KEY[2] * headings
    keys.sort()
    occupied = 1 + int(np.count_nonzero(keys[1:] != keys[:-1]))
    if occupied <= 1:
        return 1
    a = 2.0 / (9.0 * (occupied - 1))
    return int((occupied - 1) / (2.0 * error) * (1.0 - a + sqrt(a) * quantile) ** 3)
