"""Localisation on a drawn map: search of the whole map, rivals, calibrated health.

The methods and thresholds are those of Monte-Carlo localisation (stack/localisation). Each
hypothesis is one pose instead of a particle set; scan matching follows the estimate.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from stack.localisation.health import RecentViews, ScanView
from stack.localisation.health_model import HealthFeatures, health
from stack.localisation.known_map import UNTESTED_HEALTH, KnownMap
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.hypotheses import Hypotheses, Hypothesis
from stack.localisation.particle_filter.particles import ParticleSet
from stack.localisation.planar import as_row
from stack.localisation.search.evaluation import RIVAL_ANGLE, RIVAL_DISTANCE
from stack.localisation.search.matches import GlobalMatch, Views, scan_points
from stack.localisation.search.rivals import resolve
from stack.localisation.view_planner import ViewPlanner
from stack.streams import stream
from stack.types import FloatArray, OccupancyGrid, Pose2D, RivalPose, Scan, View

REACH = 0.15
"""Metres by which the alignment of a rival with a scan moves it, at most."""

BEAMS = 60
"""Beams of a scan with which rivals are aligned."""

MATCH_DEVIATION = 0.03
"""Metres; standard deviation of a pose that scan matching follows."""


class GlobalLocalisation:
    """Hypotheses on one map; the first one is the estimate.

    Args:
        grid: the map.
        noise: standard deviation of a range of the lidar, metres.
        seed: of the run.
    """

    def __init__(self, grid: OccupancyGrid, noise: float, seed: int) -> None:
        self._map = KnownMap(
            grid, noise, LocaliserParameters().health_obstacles, stream(seed, "slam health")
        )
        self._views = RecentViews()
        self._hypotheses = Hypotheses()
        self._odometry = Pose2D(0.0, 0.0)

    def search(self, scan: Scan, earlier: Views = ()) -> list[GlobalMatch]:
        """Return the best pose on the map that explains the scans, and its rivals.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame.

        Raises:
            NavigationError: LOST if no pose fits.
        """
        found = self._map.search.everywhere(scan, earlier)
        return [match for match, _ in resolve(found, self._map.scale_for(scan).low)]

    def restart(self, matches: Sequence[GlobalMatch], odometry: Pose2D) -> None:
        """Follow these matches from now on, the first one as the estimate.

        Args:
            matches: poses now, map frame; the most probable one first.
            odometry: pose now, odom frame.
        """
        best = matches[0].evidence
        self._hypotheses.replace([_hypothesis(one, one.evidence - best) for one in matches])
        self._views.clear()
        self._odometry = odometry

    def add(self, pose: Pose2D, odometry: Pose2D, scan: Scan) -> Pose2D | None:
        """Compare a scan with the map at all hypotheses.

        Args:
            pose: of the estimate at the scan, map frame.
            odometry: at the scan, odom frame.
            scan: deskewed.

        Returns:
            The pose of another one that is the estimate now; None if it did not change.
        """
        moved = odometry.relative_to(self._odometry)
        self._odometry = odometry
        self._hypotheses.best.follow(pose)
        view = self._map.evaluator.view(pose, scan)
        taken = self._compare(view, moved, scan) if len(self._hypotheses) > 1 else None
        if taken is not None:
            self._views.clear()
            view = self._map.evaluator.view(taken, scan)
        self._map.scale_for(scan)
        self._views.add(scan.stamp, view)
        return taken

    @property
    def health(self) -> float:
        """The calibrated probability in [0, 1] that the estimate is right."""
        now, median = self._views.newest, self._views.median
        if now is None or median is None or self._map.scale is None:
            return UNTESTED_HEALTH
        share = float(self._hypotheses.shares[0])
        return health(HealthFeatures(now, median, self._map.scale, MATCH_DEVIATION, 1.0, share))

    @property
    def rivals(self) -> tuple[RivalPose, ...]:
        """The other hypotheses at the newest scan, most probable first."""
        return self._hypotheses.rivals(Pose2D(0.0, 0.0))

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose."""
        return self._map.fit_at(pose, scan, MATCH_DEVIATION)

    def best_view(self, scan: Scan, clearance: float, avoided: Sequence[Pose2D]) -> View | None:
        """Return the view that best tells the hypotheses apart; None with a single one.

        Args:
            scan: the newest scan.
            clearance: of the base from obstacles on the way, metres.
            avoided: places to which it may not lead, current base frame.
        """
        if len(self._hypotheses) == 1:
            return None
        planner = ViewPlanner(self._map.field, clearance)
        poses = [one.pose for one in self._hypotheses]
        return planner.best_view(poses, self._hypotheses.shares.tolist(), scan, avoided)

    def _compare(self, view: ScanView, moved: Pose2D, scan: Scan) -> Pose2D | None:
        hypotheses = self._hypotheses
        driven = hypot(moved.x, moved.y)
        hypotheses.travel(driven / RIVAL_DISTANCE + abs(moved.heading) / RIVAL_ANGLE)
        points, costs = scan_points(scan, BEAMS), [view.cost]
        for hypothesis in hypotheses.others:
            expected = hypothesis.pose.compose(moved)
            hypothesis.follow(self._map.search.ranking.followed(expected, scan, points, REACH))
            costs.append(self._map.evaluator.view(hypothesis.pose, scan).cost)
        hypotheses.weigh(costs)
        return hypotheses.best.pose if hypotheses.tidy() else None


def _hypothesis(match: GlobalMatch, log_weight: float) -> Hypothesis:
    row: FloatArray = as_row(match.pose)[None]
    return Hypothesis(ParticleSet(row, np.ones(1)), match.pose, match.covariance, log_weight)
