"""Outlines on the floor as 3-D points."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.types import FloatArray, Pose2D

ELLIPSE_POINTS = 24
DEVIATIONS = 2.0
"""Half axes of the uncertainty ellipse in standard deviations: 86 % of a 2-D normal."""


def at_height(points: FloatArray, height: float) -> FloatArray:
    """Add a z coordinate to points: (n, 2) to (n, 3), metres."""
    spatial = np.full((len(points), 3), height)
    spatial[:, :2] = points
    return spatial


def outline(pose: Pose2D, corners: FloatArray, height: float = 0.03) -> FloatArray:
    """Closed outline (n + 1, 3) of corners (n, 2) in the frame of a pose."""
    closed = np.concatenate([corners, corners[:1]])
    return at_height(pose.transform(closed), height)


def uncertainty_ellipse(pose: Pose2D, covariance: FloatArray, height: float = 0.03) -> FloatArray:
    """Ellipse (ELLIPSE_POINTS + 1, 3) of the position's covariance, at DEVIATIONS sigma.

    Args:
        pose: centre of the ellipse.
        covariance: (3, 3) of x, y, heading; or (n, n) with x and y first.
        height: metres.
    """
    variances, axes = np.linalg.eigh(covariance[:2, :2])
    angles = np.linspace(0.0, 2.0 * pi, ELLIPSE_POINTS + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    half_axes = DEVIATIONS * np.sqrt(np.maximum(variances, 0.0))
    return at_height((circle * half_axes) @ axes.T + (pose.x, pose.y), height)
