"""Global scan matching: the poses on the whole map that explain scans.

A branch-and-bound search gives the distinct lattice poses with the best scores. They are aligned to
the map's surfaces and ranked by their evidence, which tells beams that end too early from beams
that pass through walls. Rooms that look alike give several candidates.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.health import ScanEvaluator
from stack.localisation.search.evaluation import MatchEvaluator
from stack.localisation.search.lattice_search import LatticeSearch, SearchLimits
from stack.localisation.search.local_match import SEARCH_BEAMS, SEARCH_HEADING_STEP
from stack.localisation.search.matches import GlobalMatch, Views, view_points
from stack.types import FloatArray, Pose2D, Scan

SEARCH_FRACTION = 0.7
"""The search returns the poses whose score is at least this share of the best one."""
SEARCH_MOST = 80
"""Largest number of poses that the search returns."""

HEADINGS = 72
"""Number of headings of the seeding lattice in a full turn (5 degrees apart)."""

SEED_SPACING, SEED_BLUR = 0.15, 0.2
"""Metres; spacing of the positions of the seeding lattice, and blur of its scores."""

_REFINED = 20


class GlobalMatcher:
    """Search of a whole map for the poses that explain scans.

    `scores` and `poses` are those of a coarser lattice, from which scattered particles are seeded.

    Args:
        field: the map.
        evaluator: of the same map.
        search: lattice search of the same map.
    """

    def __init__(
        self, field: SignedDistanceField, evaluator: ScanEvaluator, search: LatticeSearch
    ) -> None:
        from stack.localisation import kernels

        self._kernels, self._field, self._search = kernels, field, search
        self._ranking = MatchEvaluator(field, evaluator)
        self._limits = SearchLimits(SEARCH_FRACTION, most=SEARCH_MOST)
        stride = max(1, round(SEED_SPACING / field.resolution))
        first = stride // 2
        rows, columns = np.nonzero(field.are_free(0.1, stride, first))
        self._rows, self._columns = rows * stride + first, columns * stride + first
        self._headings = np.arange(HEADINGS) * (2.0 * pi / HEADINGS) - pi
        self._table = field.log_likelihoods(SEED_BLUR, 0.9)

    @property
    def size(self) -> int:
        """Number of poses on the seeding lattice."""
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
        points = view_points(views, SEARCH_BEAMS)
        found = self._search.search(points, SEARCH_HEADING_STEP, self._limits)
        return self._ranking.ranked(found.poses, points, views, _REFINED)
