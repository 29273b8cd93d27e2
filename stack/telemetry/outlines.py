"""Outlines on the floor, as points in space."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.types import FloatArray, Pose2D

ELLIPSE_POINTS = 24
DEVIATIONS = 2.0
"""Half axes of the uncertainty ellipse in standard deviations: 86 % of a 2-D normal."""


def lifted(points: FloatArray, height: float) -> FloatArray:
    """(n, 3) of the (n, 2) points, all at one height."""
    raised = np.full((len(points), 3), height)
    raised[:, :2] = points
    return raised


def outline(pose: Pose2D, corners: FloatArray, height: float = 0.03) -> FloatArray:
    """(n + 1, 3) closed outline of (n, 2) corners given in the frame of the pose."""
    closed = np.concatenate([corners, corners[:1]])
    return lifted(pose.transform(closed), height)


def uncertainty_ellipse(pose: Pose2D, covariance: FloatArray, height: float = 0.03) -> FloatArray:
    """(ELLIPSE_POINTS + 1, 3) where the position is likely to be.

    Args:
        pose: its middle.
        covariance: (3, 3) of x, y, heading.
        height: metres.
    """
    variances, axes = np.linalg.eigh(covariance[:2, :2])
    angles = np.linspace(0.0, 2.0 * pi, ELLIPSE_POINTS + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    half_axes = DEVIATIONS * np.sqrt(np.maximum(variances, 0.0))
    return lifted((circle * half_axes) @ axes.T + (pose.x, pose.y), height)
