"""Matching of scans to the last keyframe.

A scan is aligned with the lines of the keyframe from its predicted pose. If that explains too few
of its points, the surroundings of the prediction are searched: a push may have moved the robot
farther than the alignment can bridge. Of several poses that explain the scan about as well none is
returned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, hypot, sqrt

import numpy as np

from stack.localisation.fusion.scan_matching import kernels
from stack.types import FloatArray, Scan, wrap_angle

MATCHING_RANGE = 12.0
"""Longer ranges are not matched, m."""
MATCHING_POINTS = 180
"""Points of a scan that are matched."""
LINE_VARIANCE = 0.015**2 - 0.01**2
"""m²; of a point about the line of a wall, besides the lidar's noise: walls are not straight.
1.5 cm with a noise of 1 cm."""
LINE_RADIUS = 0.2
"""Radius in which the points of a keyframe are joined to a line, m."""
WEAKEST_DEVIATION = 0.05
"""Scans fix no direction, e.g. along a corridor, whose deviation would be larger, m."""
MATCHING_DEVIATION = 0.002
"""Smallest standard deviation of a match, m."""
MATCHING_ANGLE_DEVIATION = 0.001
"""Smallest standard deviation of a match's heading, rad."""
MATCHING_FACTOR = 4.0
"""Factor of a match's variance, since the errors of neighbouring beams are related."""
MATCHING_SHARE = 0.6
"""Share of the points that a match must explain."""
SEARCHED_SHARE = 0.35
"""Share of the points that a match after a push must explain; walls are hidden there."""
MATCHING_MARGIN = 0.08
"""A match explains this share of the points more than other poses nearby."""
CLEAR_SHARE = 0.5
"""A pose found after a push that explains less of a scan must be confirmed."""
CONFIRMATIONS = 3
"""Scans in a row that must agree on a pose that needs confirmation."""
KNOWN_DEVIATION = 0.2
"""A pose found after a push is used if its position is known better than this, m."""
SEARCH_DISTANCE = 2.2
"""Reach of the search after a push, m."""
SEARCH_ANGLE = 1.2
"""Reach of the search in heading, rad."""

ITERATIONS = 20
"""Gauss-Newton steps of one alignment; it converges in 3 to 8."""

CANDIDATES = 8
"""Poses of a search that are aligned."""

SEARCH_POINTS = 60
"""Points of a scan with which poses are searched."""

SEARCH_STEP, SEARCH_TURN = 0.2, 0.1
"""Spacing of the poses of a search, m and rad; the alignment bridges it."""

LEAST_SHARE, USUAL_SHARE = 0.45, 0.85
"""A match must explain this, and this part of what the last one explained."""

DISTINCT_DISTANCE, DISTINCT_ANGLE = 0.3, 0.2
"""Two matches farther apart than this (m or rad) are different poses."""


@dataclass(frozen=True, slots=True)
class ScanMatch:
    """Pose of the base at a scan's stamp, in the frame of the base at the keyframe.

    Attributes:
        pose: (3,) x, y, heading.
        covariance: (3, 3), large in directions without information.
        share: of the scan's points that the pose explains.
        predicted_share: of the points that the predicted pose explains.
        searched: whether the pose was found by a search: the base has jumped.
    """

    pose: FloatArray
    covariance: FloatArray
    share: float
    predicted_share: float
    searched: bool = False


class Keyframe:
    """The points of a scan with their lines, to which later scans are matched.

    Args:
        points: (n, 2) base frame, in the order of the beams.
        deviation: of a point from the line of a wall, metres.
    """

    def __init__(self, points: FloatArray, deviation: float) -> None:
        self.points = points
        self.lines = kernels.fit_lines(points, LINE_RADIUS, deviation)
        cells = 2 * ceil((MATCHING_RANGE + kernels.REACH) / kernels.CELL)
        self.nearest = kernels.nearest_points(points, cells)


class ScanMatcher:
    """Matches scans to a keyframe.

    Args:
        noise: standard deviation of a range of the lidar, metres.

    Attributes:
        keyframe: None before the first scan.
        expected_share: share of the last scan's points that its predicted pose explained.
        last_share: share of the points that the last match explained.
    """

    def __init__(self, noise: float) -> None:
        self._deviation = sqrt(noise**2 + LINE_VARIANCE)
        self.keyframe: Keyframe | None = None
        self.expected_share = self.last_share = 1.0
        self._unconfirmed: tuple[FloatArray, int] | None = None

    def points_of(self, scan: Scan, trail: FloatArray) -> FloatArray:
        """Return the end points (n, 2) of a scan in the base frame at its stamp.

        Args:
            scan: not deskewed.
            trail: (m, 4) stamp and pose of the base around the scan, in the base frame at the
                scan's stamp.
        """
        mount = np.array([scan.mount.x, scan.mount.y, scan.mount.heading])
        begin = scan.stamp - 0.5 * scan.time_increment * (scan.ranges.size - 1)
        return kernels.scan_points(
            scan.ranges, scan.angles, begin, scan.time_increment,
            min(MATCHING_RANGE, scan.range_max), mount, trail,
        )  # fmt: skip

    def set_keyframe(self, points: FloatArray) -> None:
        """Make the points (n, 2) of a scan the keyframe."""
        self.keyframe, self._unconfirmed = Keyframe(points, self._deviation), None
        self.last_share = 1.0

    def match(
        self, points: FloatArray, predicted: FloatArray, by_wheels: Callable[[], FloatArray]
    ) -> ScanMatch | None:
        """Match the points of a scan; None if no single pose explains them.

        Args:
            points: (n, 2), base frame at the scan's stamp.
            predicted: (3,) pose of the base in the frame of the keyframe.
            by_wheels: returns (3,) the pose of the last match, moved as the wheels did since:
                where an alignment also begins, and the centre of a search.
        """
        if self.keyframe is None or points.shape[0] < MATCHING_POINTS // 10:
            return None
        some = _thinned(points, MATCHING_POINTS)
        usual_share = max(LEAST_SHARE, USUAL_SHARE * self.last_share)
        enough = min(MATCHING_SHARE, usual_share)
        start, expected = predicted, self._share(some, predicted)
        if expected < enough:
            usual = self._share(some, by_wheels())
            if usual > expected:
                start, expected = by_wheels(), usual
        self.expected_share = expected
        match = self._aligned(some, start, expected)
        if match is not None and match.share >= max(enough, expected - MATCHING_MARGIN):
            self._unconfirmed = None
        elif expected >= enough:
            return None
        else:
            match = self._searched(some, by_wheels(), expected)
        if match is not None:
            self.last_share = match.share
        return match

    def _share(self, points: FloatArray, pose: FloatArray) -> float:
        k = self.keyframe
        assert k is not None
        tolerance = 3.0 * self._deviation
        return kernels.share_explained(points, k.points, k.lines, k.nearest, pose, tolerance)

    def _aligned(self, points: FloatArray, start: FloatArray, expected: float) -> ScanMatch | None:
        k = self.keyframe
        assert k is not None
        pose, covariance, converged = kernels.align(
            points, k.lines, k.nearest, start, self._deviation, WEAKEST_DEVIATION, ITERATIONS
        )
        if not converged:
            return None
        covariance *= MATCHING_FACTOR
        floor = MATCHING_DEVIATION, MATCHING_DEVIATION, MATCHING_ANGLE_DEVIATION
        for axis, deviation in enumerate(floor):
            covariance[axis, axis] += deviation * deviation
        return ScanMatch(pose, covariance, self._share(points, pose), expected)

    def _searched(
        self, points: FloatArray, centre: FloatArray, expected: float
    ) -> ScanMatch | None:
        """Return the only pose in the window of the search that explains the scan.

        If that is little of the scan, or other poses explain it nearly as well, the best pose must
        be the same in CONFIRMATIONS scans.
        """
        k = self.keyframe
        assert k is not None
        starts = kernels.search(
            _thinned(points, SEARCH_POINTS), k.points, k.nearest, centre,
            SEARCH_DISTANCE, SEARCH_ANGLE, SEARCH_STEP, SEARCH_TURN, CANDIDATES,
        )  # fmt: skip
        tried = [self._aligned(points, start[:3].copy(), expected) for start in starts]
        known = [
            match for match in tried if match is not None and _is_known(match, KNOWN_DEVIATION)
        ]
        found = sorted(known, key=lambda match: -match.share)
        enough = max(SEARCHED_SHARE, expected + MATCHING_MARGIN)
        if not found or found[0].share < enough:
            self._unconfirmed = None
            return None
        best = found[0]
        rivals = [match.share for match in found[1:] if _differ(match.pose, best.pose)]
        clear = not rivals or max(rivals) < best.share - MATCHING_MARGIN
        if (clear and best.share >= CLEAR_SHARE) or self._is_confirmed(best):
            self._unconfirmed = None
            return replace(best, searched=True)
        return None

    def _is_confirmed(self, best: ScanMatch) -> bool:
        """Whether the best pose of the last CONFIRMATIONS searches was the same."""
        before, count = self._unconfirmed or (best.pose, 0)
        count = 1 if _differ(before, best.pose) else count + 1
        self._unconfirmed = best.pose, count
        return count >= CONFIRMATIONS


def _thinned(points: FloatArray, count: int) -> FloatArray:
    """Return at most `count` of the points, evenly chosen."""
    if points.shape[0] <= count:
        return points
    chosen = np.arange(count) * points.shape[0] // count
    return np.ascontiguousarray(points[chosen])


def _is_known(match: ScanMatch, deviation: float) -> bool:
    """Whether the scan fixes the pose in every direction."""
    return float(np.trace(match.covariance[:2, :2])) < deviation**2


def _differ(one: FloatArray, other: FloatArray) -> bool:
    far = hypot(one[0] - other[0], one[1] - other[1]) > DISTINCT_DISTANCE
    return far or abs(wrap_angle(float(one[2] - other[2]))) > DISTINCT_ANGLE
