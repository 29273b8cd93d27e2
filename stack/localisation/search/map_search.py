"""Search of a map for the poses that explain scans: near an expected pose, or everywhere.

A branch-and-bound search gives the distinct lattice poses with the best scores. They are aligned to
the map's surfaces and ranked by their evidence, which tells beams that end too early from beams
that pass through walls. Rooms that look alike give several matches.
"""

from __future__ import annotations

from functools import cached_property

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.health import ScanEvaluator
from stack.localisation.search.evaluation import MatchEvaluator
from stack.localisation.search.lattice_search import LatticeSearch, SearchLimits, SearchWindow
from stack.localisation.search.matches import GlobalMatch, Views, scan_points, view_points
from stack.types import Pose2D, Scan

SEARCH_SPACING = 0.05
"""Distance between the positions that a search of the map tries, m."""
SEARCH_BLUR = 0.12
"""Standard deviation of a return in that search, m: above the spacing, so that no pose falls
between two."""
SEARCH_HEADING_STEP = 0.035
"""Angle between the headings that a search of the map tries, rad: 2 degrees."""
SEARCH_BEAMS = 60
"""Beams of each scan in that search."""

_NEAR, _EVERYWHERE = SearchLimits(most=12), SearchLimits(most=80)
_REFINED_NEAR, _REFINED_EVERYWHERE = 3, 20


class MapSearch:
    """Search of one map.

    Args:
        field: the map.
        evaluator: of the same map.
        noise: standard deviation of a range of the lidar, metres.

    Attributes:
        ranking: aligns and ranks poses on the map.
    """

    def __init__(self, field: SignedDistanceField, evaluator: ScanEvaluator, noise: float) -> None:
        self._field = field
        self.ranking = MatchEvaluator(field, evaluator, noise)

    @cached_property
    def _lattice(self) -> LatticeSearch:
        logs = self._field.log_likelihoods(SEARCH_BLUR, 0.9)
        values = 1.0 - logs / min(float(logs.min()), -1e-6)
        return LatticeSearch(
            values, self._field.are_free(0.1), self._field.resolution, self._field.origin,
            SEARCH_SPACING,
        )  # fmt: skip

    def near(self, pose: Pose2D, scan: Scan, distance: float, angle: float) -> list[GlobalMatch]:
        """Return the distinct poses within a window that explain a scan, best first.

        The caller decides by their fits whether one is good enough, and widens the window.

        Args:
            pose: expected pose of the base at the scan's stamp, map frame.
            scan: of the estimator's lidar.
            distance: half the side of the window, metres.
            angle: largest difference of the headings, radians.
        """
        points = scan_points(scan, SEARCH_BEAMS)
        window = SearchWindow(pose, distance, angle)
        found = self._lattice.search(points, SEARCH_HEADING_STEP, _NEAR, window)
        views: Views = [(Pose2D(0.0, 0.0), scan)]
        return self.ranking.ranked(found.poses, points, views, _REFINED_NEAR)

    def everywhere(self, scan: Scan, earlier: Views = ()) -> list[GlobalMatch]:
        """Return the distinct poses on the map that explain the scans, best first.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame
                (from odometry).
        """
        views: Views = [(Pose2D(0.0, 0.0), scan), *earlier]
        points = view_points(views, SEARCH_BEAMS)
        found = self._lattice.search(points, SEARCH_HEADING_STEP, _EVERYWHERE)
        return self.ranking.ranked(found.poses, points, views, _REFINED_EVERYWHERE)
