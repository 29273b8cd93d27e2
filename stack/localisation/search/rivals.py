"""Rival poses: which candidates remain beside the best one, and what becomes of them on the way.

A single scan of a corridor with equal rooms fits several places. The candidates with a share of the
probability are kept as hypotheses. Each follows odometry, is aligned to the map with later scans,
and collects their evidence; it is given up when its share becomes small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log

from stack.errors import NavigationError
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.search.evaluation import MatchEvaluator
from stack.localisation.search.matches import GlobalMatch, is_distinct, scan_points
from stack.types import FailureCode, Pose2D, RivalPose, Scan

_REACH = 0.3
"""Metres by which a hypothesis is aligned again after a motion, at most."""

_LEAD = 1.0
"""Log-likelihood by which a rival must lead the estimate to replace it, against flipping."""

_STILL = 0.005
"""Metres, radians; a robot that moved less between two scans stands."""

_OTHER_PLACE = 30.0
"""Log-likelihood that a hypothesis loses at most by one scan."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """Result of a global search: where the robot probably is, and where else it may be.

    Attributes:
        best: the most probable pose.
        rivals: the others, most probable first.
    """

    best: GlobalMatch
    rivals: tuple[GlobalMatch, ...]


def resolve(candidates: Sequence[GlobalMatch], least_fit: float, least_share: float) -> Resolution:
    """Return the best candidate and its rivals.

    Args:
        candidates: distinct poses, best first.
        least_fit: smallest accepted fit of the best one.
        least_share: probability, relative to the best one, below which a candidate is no rival.

    Raises:
        NavigationError: LOST if no candidate fits.
    """
    if not candidates or candidates[0].fit < least_fit:
        fit = candidates[0].fit if candidates else 0.0
        raise NavigationError(
            FailureCode.LOST,
            f"the best place on the map explains {fit:.0%} of the scan, below {least_fit:.0%}; "
            "drive to a place where more of the map is visible",
        )
    best, *others = candidates
    limit = best.evidence + log(least_share)
    return Resolution(best, tuple(other for other in others if other.evidence >= limit))


@dataclass(frozen=True, slots=True)
class _Hypothesis:
    """One of the possible poses: the odom frame's pose in the map frame, and its evidence."""

    map_from_odom: Pose2D
    evidence: float


class RivalTracker:
    """The poses that may be the robot's: the estimate and its rivals.

    Call `start` after a global search, and `update` with each scan while there are rivals. The
    first hypothesis is the estimate; its pose is the filter's.

    Args:
        evaluator: of the map.
        parameters: share below which a rival is given up, and motion between two updates.
    """

    def __init__(self, evaluator: MatchEvaluator, parameters: LocaliserParameters) -> None:
        self._hypotheses: list[_Hypothesis] = []
        self._seen_at = self._last = Pose2D(0.0, 0.0)
        self.configure(evaluator, parameters)

    def configure(self, evaluator: MatchEvaluator, parameters: LocaliserParameters) -> None:
        """Apply new parameters; the rivals stay."""
        self._evaluator, self._parameters = evaluator, parameters

    def start(self, resolution: Resolution, odometry: Pose2D) -> None:
        """Begin with the result of a global search.

        Args:
            resolution: its best pose becomes the estimate.
            odometry: pose of the base at the newest scan, odom frame.
        """
        back = odometry.inverse()
        self._hypotheses = [
            _Hypothesis(match.pose.compose(back), match.evidence)
            for match in (resolution.best, *resolution.rivals)
        ]
        self._seen_at = self._last = odometry

    def clear(self) -> None:
        """Give up all rivals: the pose is known from elsewhere."""
        self._hypotheses = []

    @property
    def ambiguous(self) -> bool:
        """Whether there are rivals."""
        return len(self._hypotheses) > 1

    def rivals(self, odometry: Pose2D) -> tuple[RivalPose, ...]:
        """Return the rivals of the estimate, most probable first.

        Args:
            odometry: pose of the base now, odom frame.
        """
        if not self.ambiguous:
            return ()
        shares = self._shares()
        poses = [one.map_from_odom.compose(odometry) for one in self._hypotheses]
        rivals = [RivalPose(p, s) for p, s in zip(poses[1:], shares[1:], strict=True)]
        return tuple(sorted(rivals, key=lambda rival: -rival.share))

    def update(self, estimate: Pose2D, odometry: Pose2D, scan: Scan) -> Pose2D | None:
        """Weigh the hypotheses by a scan, if the robot has moved since the last one.

        Args:
            estimate: the filter's pose at the scan's stamp, map frame.
            odometry: pose of the base at the scan's stamp, odom frame.
            scan: of the estimator's lidar.

        Returns:
            The pose of a rival that has become more probable than the estimate: restart there.
            None: keep the estimate.
        """
        if not self.ambiguous or not self._is_due(odometry):
            return None
        self._seen_at = odometry
        back = odometry.inverse()
        first = replace(self._hypotheses[0], map_from_odom=estimate.compose(back))
        followed = [self._followed(one, odometry, scan) for one in (first, *self._hypotheses[1:])]
        order = sorted(range(len(followed)), key=lambda k: (-followed[k].evidence, k))
        if followed[order[0]].evidence < followed[0].evidence + _LEAD:
            order = [0, *(k for k in order if k != 0)]
        self._hypotheses = self._surviving([followed[k] for k in order], odometry)
        if order[0] == 0:
            return None
        return self._hypotheses[0].map_from_odom.compose(odometry)

    def _is_due(self, odometry: Pose2D) -> bool:
        """Whether the robot has moved far enough, or stands at another place than last time."""
        step, p = odometry.relative_to(self._last), self._parameters
        stood = step.distance_to(Pose2D(0.0, 0.0)) < _STILL and abs(step.heading) < _STILL
        self._last = odometry
        moved = odometry.relative_to(self._seen_at)
        distance, turn = moved.distance_to(Pose2D(0.0, 0.0)), abs(moved.heading)
        part = 0.25 if stood else 1.0
        return turn >= part * p.rival_angle or distance >= part * p.rival_distance

    def _followed(self, one: _Hypothesis, odometry: Pose2D, scan: Scan) -> _Hypothesis:
        """Return a hypothesis aligned with a scan, with its evidence added."""
        points = scan_points(scan, self._parameters.search_beams)
        match = self._evaluator.followed(one.map_from_odom.compose(odometry), scan, points, _REACH)
        added = max(match.evidence, -_OTHER_PLACE)
        return _Hypothesis(match.pose.compose(odometry.inverse()), one.evidence + added)

    def _surviving(self, ordered: list[_Hypothesis], odometry: Pose2D) -> list[_Hypothesis]:
        """Return the hypotheses, best first, that are distinct and not too improbable."""
        limit = max(one.evidence for one in ordered) + log(self._parameters.rival_share)
        kept: list[_Hypothesis] = []
        for one in ordered:
            pose = one.map_from_odom.compose(odometry)
            others = [other.map_from_odom.compose(odometry) for other in kept]
            if one.evidence >= limit and all(is_distinct(pose, other) for other in others):
                kept.append(one)
        return kept

    def _shares(self) -> list[float]:
        most = max(one.evidence for one in self._hypotheses)
        weights = [exp(one.evidence - most) for one in self._hypotheses]
        return [weight / sum(weights) for weight in weights]
