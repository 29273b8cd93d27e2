"""Whether the readings of a laser run clockwise: a turn of the robot shifts them the other way."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

import numpy as np

from stack.types import FloatArray, Pose2D, wrap_angle

STILL, LEAST_TURN, MOST_TURN = 0.1, 0.05, 0.8
"""Metres that the robot moves at most between two scans, and radians that it turns."""

CLEAR = 0.5
"""A pair of scans counts if one order leaves this share of the difference of the other one."""

PAIRS, MAJORITY = 5, 5
"""Pairs that must count for clockwise readings, and so many times those that count against."""


def runs_clockwise(scans: Iterable[tuple[FloatArray, Pose2D]], spacing: float) -> bool:
    """Return whether the readings of scans run from left to right.

    Args:
        scans: readings in metres, NaN or inf without return; and the pose of the robot by odometry.
        spacing: between two readings, radians.
    """
    before: tuple[FloatArray, Pose2D] | None = None
    votes = [0, 0]
    for ranges, pose in scans:
        if before is not None and ranges.size == before[0].size:
            turn = wrap_angle(pose.heading - before[1].heading)
            if pose.distance_to(before[1]) <= STILL and LEAST_TURN <= abs(turn) <= MOST_TURN:
                shift = round(turn / spacing)
                usual, other = (_difference(before[0], ranges, s) for s in (shift, -shift))
                votes[0] += usual < CLEAR * other
                votes[1] += other < CLEAR * usual
        before = ranges, pose
    return votes[1] >= PAIRS and votes[1] > MAJORITY * votes[0]


def _difference(before: FloatArray, after: FloatArray, shift: int) -> float:
    """Return the median difference of readings, the later ones shifted; inf without any."""
    count = before.size - abs(shift)
    if count < 1:
        return inf
    one, other = before[max(shift, 0) :][:count], after[max(-shift, 0) :][:count]
    known = np.isfinite(one) & np.isfinite(other)
    return float(np.median(np.abs(one[known] - other[known]))) if known.any() else inf
