"""Searches of the map that give the filter new hypotheses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stack.localisation.health import ScanView
from stack.localisation.known_map import KnownMap
from stack.localisation.mcl.confidence import MANY_LONG
from stack.localisation.mcl.recovery import Search
from stack.localisation.mcl.trusted_pose import TrustedPose
from stack.localisation.particle_filter.filter import ParticleFilter
from stack.localisation.particle_filter.hypotheses import MAX_HYPOTHESES, Hypothesis, same_place
from stack.localisation.planar import are_near
from stack.localisation.search.matches import GlobalMatch, Views
from stack.localisation.search.rivals import resolve, weighed
from stack.types import Pose2D, Scan

_LEAST_COVARIANCE = np.diag([0.03**2, 0.03**2, 0.02**2])
"""Covariance that is added to that of a match: cells and noise."""

_BETTER_FIT = 0.05
"""Gain of the fit from which on a match near the estimate replaces it."""

_GAIN = 3.0
"""Evidence by which a match near the estimate must lead it, and one elsewhere may trail it."""

_FITS_FAR_BETTER = 0.12
"""Gain of the fit that replaces _GAIN of a match near the estimate: after a push of 0.2 m the scans
end beside walls, neither far behind nor far before them."""

_PLAUSIBLE = 0.7
"""Share of the 5th percentile of the fits at true poses that a match on the whole map needs."""

_NOT_WRONG = 0.5
"""Likewise for a match near the estimate."""

_FAR = 0.5
"""Metres from the estimate beyond which a match is to be verified on the whole map."""


_UNCONFIRMED, _PUSHED, _TOUCHED, _MOVED, _UNMOVED = -0.5, -1.0, -3.0, -6.0, -10.0
"""Log-weights of a pose that a search found, relative to the estimate: while the estimate itself
came from a search and is not confirmed; after a push that odometry states; with scans that pass
through mapped walls, after a touch and without one; with scans that only meet unmapped things."""

_SAME_MATCH, _SAME_TURN, _SECOND_LOOK = 0.05, 0.05, 2.0
"""Metres, radians, seconds; two searches within this time that agree confirm a small correction."""


def prior_of(view: ScanView, *, confirmed: bool, disturbed: bool, touched: bool) -> float:
    """Return the log-weight of a new pose relative to the estimate, before its evidence.

    Args:
        view: of the estimate.
        confirmed: whether the estimate is trusted.
        disturbed: whether odometry stated a disturbance.
        touched: whether something touched the robot.
    """
    if not confirmed:
        return _UNCONFIRMED
    if disturbed:
        return _PUSHED
    if touched and view.long >= MANY_LONG:
        return _TOUCHED
    return _MOVED if view.long >= MANY_LONG else _UNMOVED


class PoseSearch:
    """Searches the map near the estimate or as a whole, and adds what fits to the hypotheses.

    Args:
        known_map: that is searched.
        particle_filter: whose hypotheses are added to.
    """

    def __init__(self, known_map: KnownMap, particle_filter: ParticleFilter) -> None:
        self._map, self._filter = known_map, particle_filter
        self._last: tuple[float, Pose2D] | None = None

    def run(  # noqa: PLR0913 - what a search depends on
        self, search: Search, scan: Scan, view: ScanView, moved: Pose2D, odometry: Pose2D,
        prior: float, trusted: TrustedPose,
    ) -> bool:  # fmt: skip
        """Run a search; return whether it found a place that is far from the estimate.

        Args:
            search: what to search.
            scan: the newest scan.
            view: comparison of the scan with the map at the estimate.
            moved: odometry since the hypotheses' reference pose.
            odometry: pose at the scan, odom frame.
            prior: log-weight of a new hypothesis relative to the estimate.
            trusted: how probable places are after a push.
        """
        hypotheses, low = self._filter.hypotheses, self._map.scale_for(scan).low
        here = hypotheses.best.pose.compose(moved)
        if search.is_global:
            found = self._map.search.everywhere(scan)
        else:
            found = self._map.search.near(here, scan, search.distance, search.angle)
        far = False
        near, *places = trusted.log_priors([here, *(m.pose for m in found)], odometry)
        for match, place in zip(found[:MAX_HYPOTHESES], places, strict=False):
            seen = self._map.evaluator.view(match.pose, scan)
            if search.is_global:
                plausible = seen.fit >= _PLAUSIBLE * low and seen.cost < view.cost + _GAIN
            else:
                better = seen.fit > view.fit + _BETTER_FIT and seen.fit >= _NOT_WRONG * low
                fits_far_better = seen.fit > view.fit + _FITS_FAR_BETTER and seen.cost <= view.cost
                plausible = better and (seen.cost < view.cost - _GAIN or fits_far_better)
            if not plausible:
                continue
            at_reference = match.pose.compose(moved.inverse())
            covariance = match.covariance + _LEAST_COVARIANCE
            if not same_place(match.pose, here):
                weight = hypotheses.best.log_weight + (prior + place - near)
                added = hypotheses.add(self._filter.around(at_reference, covariance, weight))
                far = far or (added and match.pose.distance_to(here) > _FAR)
            elif seen.fit > view.fit + _BETTER_FIT:
                doubtful = prior > _TOUCHED
                if self._is_found_again(scan.stamp, match.pose, odometry) or doubtful:
                    weight = hypotheses.best.log_weight
                    hypotheses.replace_best(self._filter.around(at_reference, covariance, weight))
        return far

    def _is_found_again(self, stamp: float, pose: Pose2D, odometry: Pose2D) -> bool:
        """Return whether the search before has found the same pose, propagated by odometry.

        Where a mapped thing is missing, a single scan may fit better at a shifted pose; the next
        one, from elsewhere, does not at the same.
        """
        before, self._last = self._last, (stamp, pose.compose(odometry.inverse()))
        if before is None or stamp - before[0] > _SECOND_LOOK:
            return False
        return are_near(before[1].compose(odometry), pose, _SAME_MATCH, _SAME_TURN)

    def anywhere(self, scan: Scan) -> list[Hypothesis]:
        """Return hypotheses on the whole map, weighted by the objects that each needs."""
        return self._followed(weighed(self._map.search.everywhere(scan)))

    def resolved(
        self, scan: Scan, earlier: Views, odometry: Pose2D, trusted: TrustedPose
    ) -> tuple[GlobalMatch, list[Hypothesis]]:
        """Return the best match on the whole map, and it and its rivals as hypotheses.

        Args:
            scan: the newest scan.
            earlier: as for `MapSearch.everywhere`.
            odometry: pose at the scan, odom frame.
            trusted: how probable places are after a push.

        Raises:
            NavigationError: LOST if no pose fits.
        """
        found, low = self._map.search.everywhere(scan, earlier), self._map.scale_for(scan).low
        priors = trusted.log_priors([match.pose for match in found], odometry)
        least = min(priors, default=0.0)  # a place near the trusted pose must fit, too
        fitting = [
            prior if match.fit >= low else least for match, prior in zip(found, priors, strict=True)
        ]
        resolved = resolve(found, low, fitting)
        return resolved[0][0], self._followed(resolved)

    def _followed(self, matches: Sequence[tuple[GlobalMatch, float]]) -> list[Hypothesis]:
        """Return the first matches, with their log-weights, as hypotheses at the reference pose."""
        return [
            self._filter.around(match.pose, match.covariance + _LEAST_COVARIANCE, weight)
            for match, weight in matches[:MAX_HYPOTHESES]
        ]
