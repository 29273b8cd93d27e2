"""Poses found by a search, and the points of the scans that it looks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi

import numpy as np
from numpy.typing import NDArray

from stack.localisation.health import spread
from stack.localisation.planar import are_near
from stack.types import FloatArray, Pose2D, Scan

DISTINCT_DISTANCE, DISTINCT_ANGLE = 0.5, pi / 6
"""Metres, radians; poses closer than both are the same place."""

Views = Sequence[tuple[Pose2D, Scan]]
"""Scans, each with the base pose at its stamp in the current base frame."""


@dataclass(frozen=True, slots=True)
class GlobalMatch:
    """A pose that explains scans.

    Attributes:
        pose: map frame.
        fit: share of the beams that the map explains there, in [0, 1].
        covariance: (3, 3) of x, y, heading: how well the scans fix the pose about this place.
        evidence: log-likelihood of the scans at the pose; 0 if each beam ends where the map says.
            It ranks poses; half a cell of the map's error at a wall lowers it for every beam there.
        cost: minus the log-likelihood of the unmapped and missing objects that explain the rest
            (`ScanView.cost`); decides which places remain rivals.
    """

    pose: Pose2D
    fit: float
    covariance: FloatArray = field(default_factory=lambda: np.diag([0.01, 0.01, 0.0025]))
    evidence: float = 0.0
    cost: float = 0.0


def distinct(matches: Sequence[GlobalMatch]) -> list[GlobalMatch]:
    """Return the matches, best first, that are distinct from all better ones."""
    kept: list[GlobalMatch] = []
    for match in matches:
        near = (are_near(match.pose, k.pose, DISTINCT_DISTANCE, DISTINCT_ANGLE) for k in kept)
        if not any(near):
            kept.append(match)
    return kept


def view_points(views: Views, wanted: int) -> FloatArray:
    """Return (m, 2) end points of the views, current base frame, `wanted` beams of each view."""
    if not views:
        return np.empty((0, 2))
    return np.concatenate([at.transform(scan_points(scan, wanted)) for at, scan in views])


def returned_beams(scan: Scan, wanted: int) -> NDArray[np.int64]:
    """Return the indices of at most `wanted` beams with a return, evenly chosen."""
    returned = np.flatnonzero(np.isfinite(scan.ranges))
    chosen: NDArray[np.int64] = returned[spread(returned.size, wanted)]
    return chosen


def scan_points(scan: Scan, wanted: int) -> FloatArray:
    """Return (m, 2) end points, base frame, of at most `wanted` beams with a return."""
    return beam_points(scan, returned_beams(scan, wanted))


def beam_points(scan: Scan, beams: NDArray[np.int64]) -> FloatArray:
    """Return (m, 2) end points of beams by index, base frame, metres."""
    ranges = scan.ranges[beams].astype(np.float64)
    angles = scan.angles[beams]
    return scan.mount.transform(np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)]))
