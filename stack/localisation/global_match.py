"""Global scan matching: exhaustive coarse-to-fine search for the poses that explain a scan.

A lattice of poses over all free space is scored on a blurred likelihood field (correlative scan
matching; E. B. Olson, "Real-Time Correlative Scan Matching", ICRA 2009). The best distinct poses
are aligned to the map's surfaces and ranked by their fit, which also penalises beams that pass
through walls. Rooms that look alike give several candidates; the caller resolves them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from stack.errors import NavigationError
from stack.localisation.distance_field import SignedDistanceField, as_pose, as_row
from stack.localisation.health import FIT_BEAMS, ScanEvaluator, spread
from stack.localisation.parameters import LocaliserParameters
from stack.types import FailureCode, FloatArray, Pose2D, Scan, wrap_angle

HEADINGS = 72
"""Number of headings of the lattice in a full turn (5 degrees apart)."""

DISTINCT_DISTANCE, DISTINCT_ANGLE = 0.5, pi / 6
"""Metres, radians; candidates closer than both are the same place."""

_FINALISTS, _REFINED = 80, 20
_NO_PRIOR = np.zeros((3, 3))

Views = Sequence[tuple[Pose2D, Scan]]
"""Scans, each with the base pose at its stamp in the current base frame."""


@dataclass(frozen=True, slots=True)
class GlobalMatch:
    """Pose in the map frame with its fit, the share of the beams that the map explains there."""

    pose: Pose2D
    fit: float


class GlobalMatcher:
    """Search of a whole map for the poses that explain scans.

    Args:
        field: the map.
        evaluator: of the same map.
        parameters: spacing of the lattice, blur of the likelihood field, beams of a scan.
    """

    def __init__(
        self, field: SignedDistanceField, evaluator: ScanEvaluator, parameters: LocaliserParameters
    ) -> None:
        from stack.localisation import kernels

        self._kernels, self._field, self._evaluator = kernels, field, evaluator
        self.beams = parameters.search_beams
        stride = max(1, round(parameters.search_spacing / field.resolution))
        first = stride // 2
        rows, columns = np.nonzero(field.are_free(0.1, stride, first))
        self._rows, self._columns = rows * stride + first, columns * stride + first
        self._headings = np.arange(HEADINGS) * (2.0 * pi / HEADINGS) - pi
        self._table = field.log_likelihoods(parameters.search_blur, 0.9)

    @property
    def size(self) -> int:
        """Number of poses on the lattice."""
        return int(self._rows.size * HEADINGS)

    def scores(self, points: FloatArray) -> NDArray[np.float32]:
        """Return (size,) log-likelihoods of points (m, 2), base frame, at the lattice poses."""
        c, s = np.cos(self._headings)[:, None], np.sin(self._headings)[:, None]
        x, y = points[:, 0], points[:, 1]
        cells = np.stack([s * x + c * y, c * x - s * y], axis=-1) / self._field.resolution
        offsets = np.rint(cells).astype(np.int32)
        scores: NDArray[np.float32] = self._kernels.score_lattice(
            self._table, self._rows, self._columns, offsets
        ).ravel()
        return scores

    def poses(self, indices: NDArray[np.int64]) -> FloatArray:
        """Return (n, 3) x, y, heading of lattice poses by index."""
        at, heading = np.divmod(indices, HEADINGS)
        columns = self._field.distances.shape[1]
        centres = self._field.centres(self._rows[at] * columns + self._columns[at])
        return np.column_stack([centres, self._headings[heading]])

    def candidates(self, scan: Scan, earlier: Views = ()) -> list[GlobalMatch]:
        """Return distinct poses that explain the scans, best first.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame
                (from odometry).
        """
        views: Views = [(Pose2D(0.0, 0.0), scan), *earlier]
        points = np.concatenate([at.transform(scan_points(s, self.beams)) for at, s in views])
        if self.size == 0 or points.shape[0] == 0:
            return []
        coarse = self._distinct_best(self.scores(points))
        matches = [self._aligned(row, views, points) for row in coarse]
        matches.sort(key=lambda match: -match.fit)
        refined = [self._refined(match, views) for match in matches[:_REFINED]]
        matches = sorted([*refined, *matches[_REFINED:]], key=lambda match: -match.fit)
        kept: list[GlobalMatch] = []
        for match in matches:
            if all(is_distinct(match.pose, other.pose) for other in kept):
                kept.append(match)
        return kept

    def _distinct_best(self, scores: NDArray[np.float32]) -> FloatArray:
        """Return the (k, 3) best lattice poses that do not converge to a better one."""
        many = min(scores.size, 4000)
        best = np.argpartition(-scores, many - 1)[:many]
        # Ties are broken by index, so that the order does not depend on the partition.
        best = best[np.lexsort((best, -scores[best]))]
        remaining = self.poses(best)
        kept: list[FloatArray] = []
        while remaining.shape[0] and len(kept) < _FINALISTS:
            first = remaining[0]
            kept.append(first)
            off = np.abs((remaining[:, 2] - first[2] + pi) % (2.0 * pi) - pi)
            far = np.hypot(remaining[:, 0] - first[0], remaining[:, 1] - first[1]) > 0.4
            remaining = remaining[far | (off > pi / 9)]
        return np.array(kept)

    def _aligned(self, row: FloatArray, views: Views, points: FloatArray) -> GlobalMatch:
        for deviation in (0.3, 0.1):
            row = self._kernels.refine_pose(
                self._field.distances, *self._field.placement, row, _NO_PRIOR, points, deviation
            )
        pose = as_pose(row)
        fits = [self._evaluator.fit(pose.compose(at), scan) for at, scan in views]
        return GlobalMatch(pose, sum(fits) / len(fits))

    def _refined(self, match: GlobalMatch, views: Views) -> GlobalMatch:
        """Align once more, with more beams, but only those that match the map."""
        explained = []
        for at, scan in views:
            beams = returned_beams(scan, FIT_BEAMS)
            kinds = self._evaluator.classify(match.pose.compose(at), scan, beams)
            kept = beams[kinds == self._kernels.MATCHED]
            explained.append(at.transform(beam_points(scan, kept)))
        again = self._aligned(as_row(match.pose), views, np.concatenate(explained))
        return again if again.fit > match.fit else match


def is_distinct(one: Pose2D, other: Pose2D) -> bool:
    """Return whether two poses are different places."""
    turned = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) >= DISTINCT_DISTANCE or turned >= DISTINCT_ANGLE


def decide(candidates: Sequence[GlobalMatch], least_fit: float, ratio: float) -> GlobalMatch:
    """Return the first candidate if it fits well and no other fits nearly as well.

    Args:
        candidates: distinct poses, best first.
        least_fit: smallest accepted fit.
        ratio: of the second fit to the first, from which the pose is ambiguous.

    Raises:
        NavigationError: LOST if no candidate fits, AMBIGUOUS if several do.
    """
    if not candidates or candidates[0].fit < least_fit:
        fit = candidates[0].fit if candidates else 0.0
        raise NavigationError(
            FailureCode.LOST,
            f"the best place on the map explains {fit:.0%} of the scan, below {least_fit:.0%}; "
            "drive to a place where more of the map is visible",
        )
    best, second = candidates[0], candidates[1] if len(candidates) > 1 else None
    if second is not None and second.fit > ratio * best.fit:
        raise NavigationError(
            FailureCode.AMBIGUOUS,
            f"({best.pose.x:.2f}, {best.pose.y:.2f}) explains {best.fit:.0%} of the scan, but "
            f"({second.pose.x:.2f}, {second.pose.y:.2f}) explains {second.fit:.0%}; "
            "look for a marker or drive to a place where they differ",
        )
    return best


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
