"""Alignment of poses to the map, and the evidence of the beams for each.

A beam that ends before the mapped wall (short) has met something that is not on the map: common. A
beam that passes through a mapped wall (long) says that the wall is gone: rare. A pose is
therefore ranked by the log-likelihood of its beams, in which a long beam weighs several short ones.
"""

from __future__ import annotations

import numpy as np

from stack.localisation.distance_field import SignedDistanceField, alignment_variance
from stack.localisation.health import VIEW_BEAMS, ScanEvaluator, ScanView, spread
from stack.localisation.planar import as_pose, as_row
from stack.localisation.search.matches import GlobalMatch, Views, beam_points, distinct
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

SHORT_PENALTY = 3.0
"""Evidence against a pose of a beam that ends before the mapped wall (log-likelihood)."""
LONG_PENALTY = 6.0
"""Evidence against a pose of a beam that passes through a mapped wall."""
EVIDENCE_TRUST = 0.2
"""Factor of the evidence of 120 beams; below 1, since beams are not independent."""
RIVAL_DISTANCE = 0.75
"""Distance driven after which a view is new evidence for rivals, m."""
RIVAL_ANGLE = 2.0
"""Angle turned after which a view is new evidence for rivals, rad."""

_EVIDENCE_BEAMS = VIEW_BEAMS
"""Beams of a scan, evenly spread, that count as evidence."""

_ROUGH, _FINE = np.array([0.3, 0.1]), np.array([0.1])
"""Metres; residuals with a quarter of the weight, in successive alignments."""


class MatchEvaluator:
    """Aligns poses to the map and ranks them.

    Args:
        field: the map.
        evaluator: of the same map.
        noise: standard deviation of a range of the lidar, metres.
    """

    def __init__(self, field: SignedDistanceField, evaluator: ScanEvaluator, noise: float) -> None:
        from stack.localisation import kernels
        from stack.localisation.search import kernels as search_kernels

        self._classes, self._kernels = kernels, search_kernels
        self._field, self._evaluator = field, evaluator
        self._variance = alignment_variance(noise)
        self._penalties = np.zeros(7)
        self._penalties[[kernels.SHORT, kernels.MISSING, kernels.BEYOND]] = SHORT_PENALTY
        self._penalties[kernels.LONG] = LONG_PENALTY

    def ranked(
        self, poses: FloatArray, points: FloatArray, views: Views, refined: int
    ) -> list[GlobalMatch]:
        """Return the distinct matches of poses, best first.

        Args:
            poses: (n, 3) map frame.
            points: (m, 2) of the views, base frame.
            views: scans.
            refined: number of the best matches that are aligned again without short beams.
        """
        if poses.shape[0] == 0 or points.shape[0] == 0:
            return []
        aligned, information = self._aligned(poses, points, _ROUGH)
        matches = [
            self._match(as_pose(row), one, views)
            for row, one in zip(aligned, information, strict=True)
        ]
        kept = distinct(sorted(matches, key=_rank))
        again = [self._refined(match, views) for match in kept[:refined]]
        return distinct(sorted([*again, *kept[refined:]], key=_rank))

    def followed(self, pose: Pose2D, scan: Scan, points: FloatArray, reach: float) -> Pose2D:
        """Return a pose aligned with a scan, unless that moves it by more than `reach` metres.

        Args:
            pose: expected, map frame.
            scan: of the estimator's lidar.
            points: (m, 2) of the scan, base frame.
            reach: metres.
        """
        if points.shape[0] == 0:
            return pose
        there = as_pose(self._aligned(as_row(pose)[None], points, _ROUGH)[0][0])
        is_better = self.evidence(there, scan)[0] >= self.evidence(pose, scan)[0]
        return there if is_better and there.distance_to(pose) <= reach else pose

    def evidence(self, pose: Pose2D, scan: Scan) -> tuple[float, ScanView]:
        """Return the log-likelihood of a scan at a pose, and its comparison with the map."""
        view, kinds, credits = self._evaluator.compared(pose, scan)
        matched = kinds == self._classes.MATCHED
        logs = -float(self._penalties[kinds].sum())
        logs += float(np.log(credits[matched]).sum())
        # The evidence must not depend on the number of beams of the lidar.
        share = _EVIDENCE_BEAMS / max(1, kinds.size)
        return EVIDENCE_TRUST * share * logs, view

    def _aligned(
        self, poses: FloatArray, points: FloatArray, deviations: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        aligned, information = self._kernels.align(
            self._field.distances, self._field.placement, np.ascontiguousarray(poses),
            np.ascontiguousarray(points), deviations, 6,
        )  # fmt: skip
        return aligned, information

    def _match(self, pose: Pose2D, information: FloatArray, views: Views) -> GlobalMatch:
        evidence = cost = fits = 0.0
        for (at, scan), share in zip(views, self._news(views), strict=True):
            log, seen = self.evidence(pose.compose(at), scan)
            evidence, cost = evidence + share * log, cost + share * seen.cost
            fits += seen.fit
        # Along a corridor nothing fixes the pose but that other places are other matches.
        weak = np.diag([1.0 / 0.5**2, 1.0 / 0.5**2, 1.0 / 0.5**2])
        covariance = np.linalg.inv(information / self._variance + weak)
        return GlobalMatch(
            pose, fits / len(views), np.asarray(covariance, dtype=np.float64), evidence, cost
        )

    def _news(self, views: Views) -> list[float]:
        """Return the share of each view, in [0, 1], that the views before it do not contain.

        Scans from the same pose repeat the errors of the map there: they are one view.
        """
        shares: list[float] = []
        for n, (at, _) in enumerate(views):
            moves = [
                at.distance_to(other) / RIVAL_DISTANCE
                + abs(wrap_angle(at.heading - other.heading)) / RIVAL_ANGLE
                for other, _ in views[:n]
            ]
            shares.append(min([1.0, *moves]))
        return shares

    def _refined(self, match: GlobalMatch, views: Views) -> GlobalMatch:
        """Align once more, with more beams, but only those that match the map."""
        explained = []
        for at, scan in views:
            beams = spread(scan.ranges.size, _EVIDENCE_BEAMS)
            kinds, _ = self._evaluator.classified(match.pose.compose(at), scan, beams)
            explained.append(at.transform(beam_points(scan, beams[kinds == self._classes.MATCHED])))
        points = np.concatenate(explained)
        if points.shape[0] == 0:
            return match
        aligned, information = self._aligned(as_row(match.pose)[None], points, _FINE)
        again = self._match(as_pose(aligned[0]), information[0], views)
        return again if again.evidence > match.evidence else match


def _rank(match: GlobalMatch) -> float:
    return -match.evidence
