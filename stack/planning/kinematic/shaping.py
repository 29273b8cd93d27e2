"""Smoothing of searched poses between cusps, with collision and curvature checks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.planning.kinematic.search import CollisionChecker, PoseDrive
from stack.planning.smoothers.choice import shape
from stack.planning.smoothing import POSE_SPACING, PathCosts
from stack.types import FloatArray, Path

_ROUNDING = 1.05  # uneven chords of an arc bend up to this factor more than the arc
_SHARES = (1.0, 0.6, 0.3)  # shares of the displacement to the smooth line, tried in this order
_PINNED = 2  # fixed points at each end of a segment, which keep its heading
_ROUNDED = 0.3  # m; rounding changes about this length on both sides of a corner
_SAME_PLACE = 1e-9  # m


@dataclass(frozen=True)
class Shaping:
    """Smoothing of a pose path within the robot's limits.

    Attributes:
        smoother: one of SMOOTHERS.
        radius: minimum turning radius, metres.
        traverse: (256,) cost of a straight step by cell cost, 0 if impassable.
    """

    smoother: str
    radius: float
    traverse: NDArray[np.int64]

    def path(self, checker: CollisionChecker, drive: PoseDrive) -> Path:
        """Return the path along a drive, with each segment of one direction smoothed separately.

        A segment is moved towards its smooth line by the largest of three shares at which the
        footprint is clear, no bend is tighter than the turning radius and the segment costs no
        more, by interpolated cell costs; else it stays unchanged.
        Of a turn in place only the last pose is kept, so that it is a corner of the path.
        """
        poses, directions = drive.poses, drive.directions
        segments = [poses[:1]]
        ends = np.flatnonzero(np.diff(directions) != 0)
        for first, last in zip([0, *ends], [*ends, len(poses) - 1], strict=True):
            segment = poses[first : last + 1]
            if directions[last] != 0 and self.smoother != "none":
                segment = self._smooth_segment(checker, segment, int(directions[last]))
            segments.append(segment[1:])
        found = np.vstack(segments)
        steps = np.hypot(*np.diff(found[:, :2], axis=0).T)
        return Path(found[np.append(steps > _SAME_PLACE, True)])

    def _smooth_segment(
        self, checker: CollisionChecker, poses: FloatArray, direction: int
    ) -> FloatArray:
        even = evenly(poses, direction)
        if len(even) <= 2 * _PINNED + 1:
            return poses
        points, on = even[:, :2], PathCosts(checker.costs, self.traverse)
        if self.smoother == "simple":
            shaped = points.copy()
            shaped[1:-1] = on.in_metres(on.rounded(on.in_cells(points[1:-1]), _ROUNDED))
        else:
            shaped = shape(self.smoother, checker.costs, points, self.radius, _PINNED)
        dearest = on.of(on.in_cells(points))
        for share in _SHARES:
            moved = _with_headings(points + share * (shaped - points), even, direction)
            if (
                bends_within(moved, direction, self.radius / _ROUNDING)
                and checker.weight(moved) > 0.0
                and on.of(on.in_cells(moved[:, :2])) <= dearest
            ):
                return moved
        return poses


def evenly(poses: FloatArray, direction: int) -> FloatArray:
    """Resample poses (n, 3) evenly along cubic Hermite curves with the poses' headings."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    keep = np.append(True, steps > _SAME_PLACE)
    poses, steps = poses[keep], steps[keep[1:]]
    along = np.append(0.0, np.cumsum(steps))
    at = np.linspace(0.0, along[-1], max(1, round(float(along[-1]) / POSE_SPACING)) + 1)
    before = np.clip(np.searchsorted(along, at, side="right") - 1, 0, max(len(steps) - 1, 0))
    if not len(steps):
        return poses
    t = ((at - along[before]) / steps[before])[:, None]
    tangents = direction * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    begin, end = poses[before, :2], poses[before + 1, :2]
    leave, arrive = (tangents[index] * steps[before, None] for index in (before, before + 1))
    points = (
        (1 + 2 * t) * (1 - t) ** 2 * begin + t * (1 - t) ** 2 * leave
        + t**2 * (3 - 2 * t) * end + t**2 * (t - 1) * arrive
    )  # fmt: skip
    turn = _wrapped(poses[before + 1, 2] - poses[before, 2])
    even = np.column_stack([points, poses[before, 2] + t[:, 0] * turn])
    even[0], even[-1] = poses[0], poses[-1]
    return even


def bends_within(poses: FloatArray, direction: int, radius: float) -> bool:
    """Return whether a vehicle with a turning radius can follow poses (n, 3) in one direction.

    On an arc, successive chords turn by step / radius; at the ends, chord and heading differ by
    half of that.
    """
    runs, rises = np.diff(poses[:, :2], axis=0).T * direction
    lengths, directions = np.hypot(runs, rises), np.arctan2(rises, runs)
    if np.any(lengths < _SAME_PLACE):
        return False
    turns = np.abs(_wrapped(np.diff(directions)))
    if np.any(turns > 0.5 * (lengths[1:] + lengths[:-1]) / radius + 1e-3):
        return False
    ends = np.abs(_wrapped(directions[[0, -1]] - poses[[0, -1], 2]))
    return bool(np.all(ends <= 0.5 * lengths[[0, -1]] / radius + 1e-3))


def _with_headings(points: FloatArray, poses: FloatArray, direction: int) -> FloatArray:
    """Return poses along points (n, 2) driven forward or backward; end headings are unchanged."""
    moved = poses.copy()
    moved[:, :2] = points
    runs, rises = (points[2:] - points[:-2]).T * direction
    moved[1:-1, 2] = np.arctan2(rises, runs)
    return moved


def _wrapped(angles: FloatArray) -> FloatArray:
    turned: FloatArray = (angles + np.pi) % (2.0 * np.pi) - np.pi
    return turned
