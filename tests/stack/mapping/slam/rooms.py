"""Scans of drawn rooms: exact ray casts against wall segments."""

import numpy as np

from stack.types import FloatArray, Pose2D, Scan

BEAMS = 180


def box(x: float, y: float, width: float, height: float) -> list[tuple[float, ...]]:
    right, top = x + width, y + height
    return [(x, y, right, y), (right, y, right, top), (right, top, x, top), (x, top, x, y)]


ROOM = np.array(
    [*box(0.0, 0.0, 8.0, 6.0), *box(2.0, 2.0, 1.0, 0.6), *box(5.5, 3.5, 0.5, 1.5),
     (3.0, 6.0, 3.0, 4.6)]
)  # fmt: skip
"""An irregular room of 8 x 6 m."""

RING = np.array(
    [*box(0.0, 0.0, 14.0, 10.0), *box(2.0, 2.0, 10.0, 6.0), *box(0.0, 4.0, 0.4, 0.8),
     *box(6.0, 0.0, 0.8, 0.3), *box(13.6, 6.0, 0.4, 1.2), *box(8.0, 9.5, 1.1, 0.5),
     *box(3.5, 9.7, 0.5, 0.3), *box(10.5, 0.0, 0.4, 0.5)]
)  # fmt: skip
"""A corridor around a block, with pillars."""


def ranges_at(walls: FloatArray, pose: Pose2D, angles: FloatArray) -> FloatArray:
    """Ranges (n,) of beams at angles (n,) from the heading; inf without a wall."""
    directions = np.column_stack([np.cos(angles + pose.heading), np.sin(angles + pose.heading)])
    start, along = walls[:, :2] - (pose.x, pose.y), walls[:, 2:] - walls[:, :2]
    cross = directions[:, 0:1] * along[:, 1] - directions[:, 1:2] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / cross
        u = (start[:, 0] * directions[:, 1:2] - start[:, 1] * directions[:, 0:1]) / cross
    return np.where((t > 0.0) & (u >= 0.0) & (u <= 1.0), t, np.inf).min(axis=1)


def scan_at(walls: FloatArray, pose: Pose2D, stamp: float = 0.0, noise: float = 0.0, seed: int = 0):
    """A scan of 180 beams all around, maximum range 12 m."""
    ranges = ranges_at(walls, pose, -np.pi + 2.0 * np.pi / BEAMS * np.arange(BEAMS))
    if noise:
        ranges = ranges + np.random.default_rng(seed).normal(0.0, noise, BEAMS)
    ranges = np.where(ranges > 12.0, np.inf, ranges).astype(np.float32)
    return Scan(stamp, ranges, -np.pi, 2.0 * np.pi / BEAMS, 0.05, 12.0)
