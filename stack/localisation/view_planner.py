"""The nearest place from which a scan would tell rival poses apart.

The same motion leads to another place on the map for each rival. The planner searches the free
space that is reachable at all of them, casts the expected scans at each rival's place, and
maximises the information per metre.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, log, pi

import numpy as np
from numpy.typing import NDArray

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.planar import as_row
from stack.localisation.search.evaluation import EVIDENCE_TRUST, LONG_PENALTY, SHORT_PENALTY
from stack.localisation.search.rivals import RIVAL_SHARE
from stack.types import FloatArray, Pose2D, Scan, View

VIEW_DISTANCE = 15.0
"""How far away a place is looked for at which rivals differ, m."""

CLEARANCE = 0.05
"""Metres between the robot's inscribed circle and surfaces on the way to a view."""

CELL = 0.1
"""Metres; cell of the reachable space."""

SPACING = 4
"""Cells between two view points that are tried."""

_BEAMS = 72
_COMPARED = 8
"""Most probable rivals whose expected scans are compared; the free space is common to all."""

_MARGIN = 0.25
"""Metres by which two ranges must differ, as for a beam that passes a wall."""

_LEAST_EVIDENCE = 1.0
"""Log-likelihood below which a difference is noise."""

_NEARBY = 0.3
"""Metres; nearer places look like the current one."""

_APPROACH = 1.0
"""Metres added to the length of the way, so that a better view is worth some steps."""


class ViewPlanner:
    """Chooses views on one map.

    Args:
        field: the map.
        clearance: needed around the base, metres.
    """

    def __init__(self, field: SignedDistanceField, clearance: float) -> None:
        from stack.localisation import kernels

        self._kernels, self._field, self._clearance = kernels, field, clearance

    def best_view(
        self,
        poses: Sequence[Pose2D],
        shares: Sequence[float],
        scan: Scan,
        avoided: Sequence[Pose2D] = (),
    ) -> View | None:
        """Return the view with the largest gain per metre; None if no reachable one has any.

        If the space that is free at all poses has no such view, that at the estimate is searched:
        the robot sees on the way whether it is there.

        Args:
            poses: of the estimate and of all rivals, map frame; at least two.
            shares: their probabilities.
            scan: of the lidar, for its beams, range and mount.
            avoided: places that could not be reached, current base frame.
        """
        compared = sorted(range(len(poses)), key=lambda k: (-shares[k], k))[:_COMPARED]
        rivals = [poses[k] for k in compared]
        weights = np.maximum([shares[k] for k in compared], 1e-3)
        for free_at in (poses, poses[:1]):
            view = self._best_within(self.reach(free_at), rivals, weights, scan, avoided)
            if view is not None:
                return view
        return None

    def reach(self, poses: Sequence[Pose2D]) -> NDArray[np.int32]:
        """Return the ways to cells around the robot that are free at all poses.

        Near the robot free space needs no clearance.

        Returns:
            (2 n + 1, 2 n + 1) lengths in tenths of a cell, row 0 at the smallest y of the base
            frame; UNREACHED where there is no way.
        """
        from stack.geometry.travel.kernels import travel_distances

        half = round(VIEW_DISTANCE / CELL)
        steps = np.arange(-half, half + 1) * CELL
        x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
        near = x * x + y * y < (2.0 * self._clearance) ** 2
        needed = np.where(near, 0.0, self._clearance)
        free = np.ones(x.size, np.bool_)
        for pose in poses:
            free &= self._field.are_clear(pose.transform(np.column_stack([x, y])), needed)
        passable = free.astype(np.uint8).reshape(steps.size, steps.size)
        ways: NDArray[np.int32] = travel_distances(passable, half, half)
        return ways

    def _best_within(
        self,
        ways: NDArray[np.int32],
        rivals: Sequence[Pose2D],
        weights: FloatArray,
        scan: Scan,
        avoided: Sequence[Pose2D],
    ) -> View | None:
        """Return the view with the largest gain per metre in the reachable space."""
        best: View | None = None
        score = 0.0
        for motion, distance in self._places(ways, avoided):
            if best is not None and 1.0 / (distance + _APPROACH) <= score:
                break  # no gain exceeds 1
            gain, heading = self._gain(rivals, weights, motion, scan)
            if gain / (distance + _APPROACH) > score:
                score = gain / (distance + _APPROACH)
                best = View(Pose2D(motion.x, motion.y, heading), distance, gain)
        return best

    def _places(
        self, ways: NDArray[np.int32], avoided: Sequence[Pose2D]
    ) -> list[tuple[Pose2D, float]]:
        """Return the reachable places on a lattice with their distances, nearest first."""
        half = ways.shape[0] // 2
        lattice = np.arange(half % SPACING, ways.shape[0], SPACING)
        distances = ways[np.ix_(lattice, lattice)] * CELL / 10.0
        rows, columns = np.nonzero(distances <= VIEW_DISTANCE)
        distances = distances[rows, columns]
        x, y = (lattice[columns] - half) * CELL, (lattice[rows] - half) * CELL
        places = []
        for k in np.lexsort((columns, rows, distances)):
            here = Pose2D(float(x[k]), float(y[k]), atan2(y[k], x[k]))
            if distances[k] >= _NEARBY and all(here.distance_to(other) > 1.0 for other in avoided):
                places.append((here, float(distances[k])))
        return places

    def _gain(
        self, rivals: Sequence[Pose2D], weights: FloatArray, motion: Pose2D, scan: Scan
    ) -> tuple[float, float]:
        """Return the gain of a place, and the heading there with the best view."""
        beams = np.arange(_BEAMS, dtype=np.float64) * (2.0 * pi / _BEAMS)
        here = Pose2D(motion.x, motion.y, 0.0)
        mount = Pose2D(scan.mount.x, scan.mount.y, 0.0)
        sensors = np.array([as_row(one.compose(here).compose(mount)) for one in rivals])
        ranges = self._kernels.expected_ranges(
            self._field.occupancy, self._field.placement, sensors, beams, scan.range_max
        )
        evidence = self._evidence(ranges, scan.range_max)
        view = scan.angle_increment * scan.ranges.size
        if view >= 2.0 * pi - 0.1:
            return self._resolved(evidence.sum(axis=2), weights), motion.heading
        middle = scan.mount.heading + scan.angle_min + 0.5 * view
        best = (0.0, motion.heading)
        for heading in np.arange(8) * (pi / 4) + motion.heading:
            off = np.abs((beams - heading - middle + pi) % (2.0 * pi) - pi)
            gain = self._resolved(evidence[:, :, off <= 0.5 * view].sum(axis=2), weights)
            best = max(best, (gain, float(heading)), key=lambda one: one[0])
        return best

    def _evidence(self, ranges: FloatArray, limit: float) -> FloatArray:
        """Return (k, k, m) expected evidence of each beam for pose i against pose j, if i is true.

        Beams differ if no neighbouring beam of the other scan is near: at a grazing angle a small
        error of the pose changes the range much.
        """
        unknown = np.isnan(ranges)
        clipped = np.where(unknown, limit, np.minimum(ranges, limit))
        around = np.stack([np.roll(clipped, side, axis=1) for side in (-1, 0, 1)])
        low, high = around.min(axis=0), around.max(axis=0)
        long = clipped[:, None] > high[None] + _MARGIN
        short = clipped[:, None] < low[None] - _MARGIN
        # A pose in unknown space says nothing about its beams there.
        near = unknown | np.roll(unknown, -1, axis=1) | np.roll(unknown, 1, axis=1)
        said = ~(near[:, None] | near[None])
        each = EVIDENCE_TRUST * 120.0 / ranges.shape[1]
        evidence: FloatArray = each * said * (long * LONG_PENALTY + short * SHORT_PENALTY)
        return evidence

    def _resolved(self, evidence: FloatArray, weights: FloatArray) -> float:
        """Return the share of the ambiguity that evidence (k, k) resolves, in [0, 1]."""
        needed = -log(RIVAL_SHARE)
        resolved = np.where(evidence < _LEAST_EVIDENCE, 0.0, np.minimum(evidence / needed, 1.0))
        pairs = weights[:, None] * weights[None] * (1.0 - np.eye(weights.size))
        return float((pairs * resolved).sum() / pairs.sum())
