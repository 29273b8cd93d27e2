"""From the poses of a search to a path: smoothed between the turning points, and checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.planning.kinematic.search import Drive, Ground
from stack.planning.smoothers.choice import shape
from stack.planning.smoothing import SPACING
from stack.types import FloatArray, Path

_ROUNDING = 1.05  # chords of an arc bend this much more than the arc, where they are uneven
_PINNED = 2  # points at each end of a stretch that keep its heading
_SAME_PLACE = 1e-9  # m


@dataclass(frozen=True)
class Shaping:
    """Smooths what can be smoothed and still be driven.

    Attributes:
        smoother: one of SMOOTHERS.
        radius: least turning radius, metres.
        traverse: (256,) cost of a straight step by cell cost, 0 for no way.
    """

    smoother: str
    radius: float
    traverse: NDArray[np.int64]

    def path(self, ground: Ground, drive: Drive) -> Path:
        """The path along a drive; each stretch in one direction smoothed by itself.

        A smoothed stretch is taken when the footprint touches nothing along it and no bend is
        tighter than the turning radius; else the stretch stays as it was found. A turn in place
        shows as a corner: only its last pose is kept.
        """
        poses = drive.poses.copy()
        if self.smoother != "none":
            ends = np.flatnonzero(np.diff(drive.ways) != 0)
            for first, last in zip([0, *ends], [*ends, len(poses) - 1], strict=True):
                way = int(drive.ways[last])
                if way != 0 and last - first > 2 * _PINNED:
                    poses[first : last + 1] = self._stretch(ground, poses[first : last + 1], way)
        steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        return Path(poses[np.append(steps > _SAME_PLACE, True)])

    def _stretch(self, ground: Ground, poses: FloatArray, way: int) -> FloatArray:
        points = poses[:, :2]
        if self.smoother == "simple":
            shaped = self._rounded(ground, points)
        else:
            shaped = shape(self.smoother, ground.costs, points, self.radius, _PINNED)
        moved = _with_headings(shaped, poses, way)
        if not bends_within(moved, way, self.radius * (1.0 / _ROUNDING)):
            return poses
        return moved if ground.weight(moved) > 0.0 else poses

    def _rounded(self, ground: Ground, points: FloatArray) -> FloatArray:
        from stack.planning import kernels

        pull: Any = kernels.round_corners
        scale, origin = ground.costs.resolution, np.array(ground.costs.origin)
        data = 0.3 * (SPACING / 0.3) ** 2
        inner = (points[1:-1] - origin) / scale
        moved = pull(ground.costs.cells, self.traverse, inner, data, 0.3, self.traverse[160], 80)
        shaped = points.copy()
        shaped[1:-1] = moved * scale + origin
        return shaped


def bends_within(poses: FloatArray, way: int, radius: float) -> bool:
    """Whether a vehicle of a turning radius can follow poses (n, 3) driven in one direction.

    On an arc chords turn by step / radius from one to the next, and leave the heading at its ends
    by half of that.
    """
    runs, rises = np.diff(poses[:, :2], axis=0).T * way
    lengths, directions = np.hypot(runs, rises), np.arctan2(rises, runs)
    if np.any(lengths < _SAME_PLACE):
        return False
    turns = np.abs(_wrapped(np.diff(directions)))
    if np.any(turns > 0.5 * (lengths[1:] + lengths[:-1]) / radius + 1e-3):
        return False
    ends = np.abs(_wrapped(directions[[0, -1]] - poses[[0, -1], 2]))
    return bool(np.all(ends <= 0.5 * lengths[[0, -1]] / radius + 1e-3))


def _with_headings(points: FloatArray, poses: FloatArray, way: int) -> FloatArray:
    """Poses along points (n, 2) driven forward or backward; the headings at the ends stay."""
    moved = poses.copy()
    moved[:, :2] = points
    runs, rises = (points[2:] - points[:-2]).T * way
    moved[1:-1, 2] = np.arctan2(rises, runs)
    return moved


def _wrapped(angles: FloatArray) -> FloatArray:
    turned: FloatArray = (angles + np.pi) % (2.0 * np.pi) - np.pi
    return turned
