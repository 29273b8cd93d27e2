"""Least covariance of a pose: what odometry has added and scans have observed, linearised.

A finite set of particles narrows at random: each resampling loses a share of its spread, also in a
direction that no scan observes. Along a featureless corridor its spread then stays at some
centimetres while the error grows without bound. This covariance grows with the motion until scans
observe the direction; the particles are kept at least as wide (`stretch`).

The scale of odometry (wheel diameters, load) is an error that does not average out with the
distance: its variance is constant, and it is correlated with the pose. It is considered, not
estimated: S. F. Schmidt, "Application of State-Space Methods to Navigation Problems", Advances in
Control Systems 3, 1966.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.localisation.planar import lever, rotation
from stack.types import FloatArray, Pose2D


@dataclass(frozen=True, slots=True)
class LeastCovariance:
    """Covariance of a pose x, y, heading in the map frame, with an unknown scale of odometry.

    Attributes:
        pose: (3, 3), metres and radians.
        scale: (3,) covariance of the pose with the scale of odometry.
    """

    pose: FloatArray
    scale: FloatArray

    @staticmethod
    def of(covariance: FloatArray) -> LeastCovariance:
        """Return one that is not correlated with the scale."""
        return LeastCovariance(covariance.copy(), np.zeros(3))

    def moved(
        self, heading: float, by: Pose2D, noise: FloatArray, deviation: float
    ) -> LeastCovariance:
        """Return the covariance after an odometry displacement.

        Args:
            heading: before it, map frame.
            by: displacement in the base frame before it.
            noise: (3, 3) covariance of its independent errors, in that frame.
            deviation: standard deviation of the scale.
        """
        change, turn = lever(heading, by), rotation(heading)
        along, variance = np.array([change[1, 2], -change[0, 2], 0.0]), deviation**2
        before = change @ self.scale
        cross = np.outer(before, along)
        pose = change @ self.pose @ change.T + cross + cross.T + turn @ noise @ turn.T
        return LeastCovariance(pose + variance * np.outer(along, along), before + variance * along)

    def observed(self, information: FloatArray) -> LeastCovariance:
        """Return the covariance after a measurement with information (3, 3): P⁺ = (P⁻¹ + H)⁻¹.

        With the gain K of the pose, the remaining share of an error is I - K H = P⁺ P⁻¹. The
        variance of the scale does not change.
        """
        remaining = np.asarray(np.linalg.inv(np.eye(3) + self.pose @ information))
        pose = remaining @ self.pose
        return LeastCovariance(0.5 * (pose + pose.T), remaining @ self.scale)

    def shift(self, by: FloatArray, information: FloatArray) -> FloatArray:
        """Return a correction (3,) of the pose without its parts that nothing observes.

        The mean of particles moves at random where all of them explain a scan equally well.

        Args:
            by: the correction, map frame.
            information: (3, 3) of the measurement that it follows from.
        """
        root = np.linalg.cholesky(self.pose + _TINY)
        seen, directions = np.linalg.eigh(root.T @ information @ root)
        kept = np.minimum(np.maximum(seen, 0.0) / _OBSERVED, 1.0)
        allowed: FloatArray = root @ (directions * kept) @ directions.T @ np.linalg.inv(root) @ by
        return allowed


_TINY = np.diag([1e-8, 1e-8, 1e-8])

_NARROWER = 0.05
"""Difference of the ratio of the variances from 1 from which on the particles are changed."""

_LEAST_RATIO = 0.25
"""Least ratio of the variances after a step to those before it."""

_OBSERVED = 0.1
"""Information of a measurement relative to that of the pose before, from which on it counts."""

_NOISE_SHARE = 0.01
"""Share of a scan's information that a direction gets from corners of cells and stray points."""


def observable(information: FloatArray, points: int) -> FloatArray:
    """Return the information (3, 3) of a scan without what cells and stray points add.

    Args:
        information: sum of the outer products of the points' gradients, map frame.
        points: number of points.
    """
    values, vectors = np.linalg.eigh(information[:2, :2])
    kept = np.maximum(values - _NOISE_SHARE * points, 0.0) / np.maximum(values, 1e-9)
    root = (vectors * np.sqrt(kept)) @ vectors.T
    scaled = np.eye(3)
    scaled[:2, :2] = root
    seen: FloatArray = scaled @ information @ scaled
    return seen


def stretch(
    covariance: FloatArray, least: FloatArray, information: FloatArray
) -> FloatArray | None:
    """Return the matrix (3, 3) that makes particles at least as wide as `least`; None if they are.

    With C = L Lᵀ and L⁻¹ P L⁻ᵀ = V D Vᵀ, the matrix L V max(1, √D) Vᵀ L⁻¹ stretches each principal
    direction of P relative to C to at least P. In directions that the measurement does not observe
    particles that have become wider by chance are narrowed as well.

    Args:
        covariance: (3, 3) C of the particles.
        least: (3, 3) P.
        information: (3, 3) of the measurement.
    """
    root = np.linalg.cholesky(covariance + _TINY)
    inverse = np.linalg.inv(root)
    ratios, directions = np.linalg.eigh(inverse @ least @ inverse.T)
    axes = root @ directions
    blind = np.einsum("ij,ik,kj->j", axes, information, axes) < _OBSERVED
    ratios = np.where(blind, ratios, np.maximum(ratios, 1.0))
    if np.abs(ratios - 1.0).max() <= _NARROWER:
        return None
    factors = np.sqrt(np.maximum(ratios, _LEAST_RATIO))
    matrix: FloatArray = root @ (directions * factors) @ directions.T @ inverse
    return matrix


def widened(poses: FloatArray, mean: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return particles (n, 3), near each other, stretched about their mean (3,) by a matrix."""
    off = poses - mean
    off[:, 2] = (off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    stretched: FloatArray = mean + off @ matrix.T
    return stretched
