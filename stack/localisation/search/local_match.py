"""Local scan matching: the poses near one that explain a scan."""

from __future__ import annotations

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.health import ScanEvaluator
from stack.localisation.search.evaluation import MatchEvaluator
from stack.localisation.search.lattice_search import LatticeSearch, SearchLimits, SearchWindow
from stack.localisation.search.matches import GlobalMatch, scan_points
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

_MOST, _REFINED = 12, 3


class LocalMatcher:
    """Search of a window about a pose, for a filter whose scans stopped fitting the map.

    Args:
        field: the map.
        evaluator: of the same map.
        search: of the same map.
    """

    def __init__(
        self, field: SignedDistanceField, evaluator: ScanEvaluator, search: LatticeSearch
    ) -> None:
        self._search = search
        self._ranking = MatchEvaluator(field, evaluator)

    def match(self, pose: Pose2D, scan: Scan, distance: float, angle: float) -> list[GlobalMatch]:
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
        found = self._search.search(points, SEARCH_HEADING_STEP, SearchLimits(most=_MOST), window)
        return self._ranking.ranked(found.poses, points, [(Pose2D(0.0, 0.0), scan)], _REFINED)


def map_search(field: SignedDistanceField) -> LatticeSearch:
    """Return the lattice search of a map."""
    logs = field.log_likelihoods(SEARCH_BLUR, 0.9)
    values = 1.0 - logs / min(float(logs.min()), -1e-6)
    return LatticeSearch(
        values, field.are_free(0.1), field.resolution, field.origin, SEARCH_SPACING
    )
