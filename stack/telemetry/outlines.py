"""Outlines on the floor as 3-D points."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin

import numpy as np

from stack.types import FloatArray, Pose2D

ELLIPSE_POINTS = 24
DEVIATIONS = 2.448
"""Half axes of the uncertainty ellipse in standard deviations: 95 % of a 2-D normal."""

_ANGLES = np.linspace(0.0, 2.0 * pi, ELLIPSE_POINTS + 1)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


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
    a, b, c = (float(covariance[k]) for k in ((0, 0), (0, 1), (1, 1)))
    angle = 0.5 * atan2(2.0 * b, a - c)
    largest = largest_variance(covariance)
    smallest = a + c - largest
    forward, left = (DEVIATIONS * max(0.0, variance) ** 0.5 for variance in (largest, smallest))
    ellipse = np.full((ELLIPSE_POINTS + 1, 3), height)
    ellipse[:, 0] = pose.x + forward * cos(angle) * _CIRCLE[0] - left * sin(angle) * _CIRCLE[1]
    ellipse[:, 1] = pose.y + forward * sin(angle) * _CIRCLE[0] + left * cos(angle) * _CIRCLE[1]
    return ellipse


def largest_variance(covariance: FloatArray) -> float:
    """Variance of the position along the longer axis of its ellipse.

    Args:
        covariance: (n, n) with x and y first.
    """
    a, b, c = (float(covariance[k]) for k in ((0, 0), (0, 1), (1, 1)))
    return (a + c) / 2.0 + hypot((a - c) / 2.0, b)
