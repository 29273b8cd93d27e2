"""Hypotheses: the places where the robot may be, each with a particle set of its own.

One particle set for several places loses all but one of them by the chance of resampling. Here each
hypothesis is filtered by itself, and its probability follows from evidence that is summed over
different views: which unmapped or missing objects it needs to explain the scans, compared with the
others. Places that look the same keep their share. The first hypothesis is the estimate; the others
are its rivals. Searches return matches; those that are followed become hypotheses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np

from stack.localisation.particle_filter.particles import ParticleSet, summarise
from stack.localisation.particle_filter.uncertainty import LeastCovariance, stretch, widened
from stack.localisation.planar import are_near, as_pose, as_row
from stack.localisation.search.rivals import EVIDENCE_CAP, RIVAL_DEAD_ZONE, RIVAL_SHARE
from stack.types import FloatArray, Pose2D, RivalPose, wrap_angle

SETTLED_DEVIATION = 0.25
"""A pose whose deviation is smaller is settled, m: about the radius of a robot."""
RIVAL_LEAD = 2.0
"""A rival becomes the estimate when it is this many times as probable: two equal ones do not
alternate."""
MAX_HYPOTHESES = 20
"""Number of hypotheses that are followed at a time."""

SAME_DISTANCE, SAME_ANGLE = 0.25, pi / 12
"""Metres, radians; hypotheses closer than both are one."""

HEADING_OF_METRE = 0.6
"""Radians of heading deviation that are equivalent to a metre of position deviation."""
_SCAN_SHARE = 0.25
"""Largest share of a view's evidence that one scan adds."""

_WIDEST = 1.0
"""Metres; particles with a larger deviation are not one place."""


@dataclass
class Hypothesis:
    """One place where the robot may be.

    Attributes:
        particle_set: at the reference pose of odometry.
        pose: estimate there, map frame.
        covariance: (3, 3) of x, y, heading.
        log_weight: logarithm of its probability, up to a constant.
        news: in [0, 1]: how much of a view is evidence that the weight does not contain yet.
        weighed: views that its weight contains; it is reported as a rival from one view on.
        least: covariance that the particles must have at least; None until they have moved.
    """

    particle_set: ParticleSet
    pose: Pose2D
    covariance: FloatArray
    log_weight: float = 0.0
    news: float = 1.0
    weighed: float = 1.0
    least: LeastCovariance | None = None

    def predict(self, poses: FloatArray, moved: Pose2D, least: LeastCovariance) -> None:
        """Move the particles to `poses` (n, 3) by an odometry displacement."""
        self.particle_set = ParticleSet(poses, self.particle_set.weights)
        self.pose, self.least = self.pose.compose(moved), least

    def weight(self, logs: FloatArray) -> FloatArray:
        """Weight the particles by the log-likelihoods (n,) of a measurement; return the weights."""
        total = np.log(self.particle_set.weights) + logs
        weights: FloatArray = np.exp(total - total.max())
        weights /= weights.sum()
        self.particle_set = ParticleSet(self.particle_set.poses, weights)
        return weights

    def summarise(self) -> Pose2D:
        """Set pose and covariance to those of the particles; return the pose."""
        self.pose, self.covariance = summarise(self.particle_set)
        return self.pose

    def spread(self) -> None:
        """Set the covariance to that of the particles; the pose follows odometry."""
        self.covariance = summarise(self.particle_set)[1]

    def observe(self, information: FloatArray, mean: Pose2D) -> None:
        """Reduce the least covariance by a measurement; keep the particles as wide as it.

        Args:
            information: (3, 3) of the measurement.
            mean: of the particles.
        """
        if self.least is None:
            return
        self.least = self.least.observed(information)
        if not self.is_one_place:
            return
        matrix = stretch(self.covariance, self.least.pose, information)
        if matrix is not None:
            poses = widened(self.particle_set.poses, as_row(mean), matrix)
            self.particle_set = ParticleSet(poses, self.particle_set.weights)
            self.covariance = matrix @ self.covariance @ matrix.T

    def replace_particles(self, poses: FloatArray) -> None:
        """Continue with equally weighted particles (n, 3); pose and covariance stay."""
        self.particle_set = ParticleSet.uniform(poses)

    def shift(self, by: FloatArray) -> None:
        """Move pose and particles by a difference (3,) of x, y, heading."""
        self.particle_set = ParticleSet(self.particle_set.poses + by, self.particle_set.weights)
        self.pose = as_pose(as_row(self.pose) + by)

    def follow(self, pose: Pose2D) -> None:
        """Continue at a pose that scan matching has found."""
        self.pose = pose

    @property
    def position_deviation(self) -> float:
        """Standard deviation of the position in its most uncertain direction, metres."""
        return largest_deviation(self.covariance)

    @property
    def is_one_place(self) -> bool:
        """Whether the particles are near enough to each other to be widened."""
        return self.position_deviation <= _WIDEST

    @property
    def is_compared(self) -> bool:
        """Whether a view has compared it with the others."""
        return self.weighed >= 1.0 - 1e-9

    @property
    def is_settled(self) -> bool:
        """Whether position and heading are known better than SETTLED_DEVIATION."""
        heading = sqrt(max(0.0, float(self.covariance[2, 2])))
        limit = SETTLED_DEVIATION
        return self.position_deviation < limit and heading < limit * HEADING_OF_METRE


def largest_deviation(covariance: FloatArray) -> float:
    """Return the standard deviation in the most uncertain direction of x and y, metres."""
    a, b, d = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    mean, difference = 0.5 * (a + d), 0.5 * (a - d)
    return sqrt(max(0.0, float(mean + sqrt(difference * difference + b * b))))


class Hypotheses:
    """The hypotheses of a filter, and which of them is the estimate."""

    def __init__(self) -> None:
        self._all: list[Hypothesis] = []

    def __iter__(self) -> Iterator[Hypothesis]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    @property
    def best(self) -> Hypothesis:
        """The estimate."""
        return self._all[0]

    @property
    def others(self) -> list[Hypothesis]:
        """All but the estimate."""
        return self._all[1:]

    @property
    def shares(self) -> FloatArray:
        """(n,) probabilities of the hypotheses."""
        if len(self) == 1:
            return np.ones(1)
        logs = np.array([hypothesis.log_weight for hypothesis in self])
        likelihoods = np.exp(logs - logs.max())
        total: FloatArray = likelihoods / likelihoods.sum()
        return total

    def replace(self, hypotheses: Sequence[Hypothesis]) -> None:
        """Restart with these hypotheses, the first one as the estimate."""
        self._all = list(hypotheses)

    def replace_best(self, hypothesis: Hypothesis) -> None:
        """Replace the estimate, e.g. by a corrected one."""
        self._all[0] = hypothesis

    def add(self, hypothesis: Hypothesis) -> bool:
        """Add one that no view has compared yet; return whether it is another place than all."""
        if any(same_place(hypothesis.pose, other.pose) for other in self):
            return False
        hypothesis.weighed = 0.0
        self._all.append(hypothesis)
        return True

    def travel(self, share: float) -> None:
        """Let the views become new again by a share in [0, 1], since the robot has moved."""
        for hypothesis in self:
            hypothesis.news = min(1.0, hypothesis.news + share)

    def weigh(self, costs: Sequence[float]) -> None:
        """Add the evidence of a scan to the weights, relative to the estimate.

        Args:
            costs: of each: minus the log-likelihood of the objects that it has to assume.
        """
        for hypothesis, cost in zip(self.others, costs[1:], strict=True):
            difference = cost - costs[0]
            beyond = max(0.0, abs(difference) - RIVAL_DEAD_ZONE)
            share = min(_SCAN_SHARE, hypothesis.news)
            hypothesis.news -= share
            hypothesis.weighed += share
            evidence = float(np.copysign(min(EVIDENCE_CAP, beyond), difference))
            hypothesis.log_weight -= share * evidence

    def add_evidence(self, logs: Sequence[float], most: float) -> None:
        """Add the log-likelihoods of a measurement, relative to the estimate and at most `most`."""
        for hypothesis, log_likelihood in zip(self, logs, strict=True):
            hypothesis.log_weight += float(np.clip(log_likelihood - logs[0], -most, most))

    def hold_back(self, fitting: Sequence[bool]) -> None:
        """Keep hypotheses that do not fit well themselves from taking over.

        Where a mapped thing is missing, a wrong pose may need fewer assumptions than the right one.

        Args:
            fitting: for each hypothesis but the estimate, whether the scan fits it well.
        """
        for hypothesis, fits in zip(self.others, fitting, strict=True):
            if not fits:
                hypothesis.log_weight = min(hypothesis.log_weight, self.best.log_weight - log(2.0))

    def tidy(self) -> bool:
        """Merge, drop and sort them; return whether another one is the estimate now."""
        if len(self) == 1:
            return False
        self._merge()
        shares, before = self.shares, self.best
        best = int(np.argmax(shares))
        if shares[best] < RIVAL_LEAD * shares[0]:
            best = 0
        if best != 0:
            before.weighed, before.news = 0.0, 1.0
        order = [best, *(i for i in np.argsort(-shares, kind="stable").tolist() if i != best)]
        kept = [i for i in order if i == best or shares[i] >= RIVAL_SHARE * shares[best]]
        self._all = [self._all[i] for i in self._chosen(kept)]
        top = self.best.log_weight
        for hypothesis in self:
            hypothesis.log_weight -= top
        return self.best is not before

    def _chosen(self, kept: list[int]) -> list[int]:
        """Return as many as are followed, of some in the order of their probabilities.

        Half of the places are for those that no view has compared yet, so that they are not left
        out for others that were found before.
        """
        new = [i for i in kept[1:] if not self._all[i].is_compared][: MAX_HYPOTHESES // 2]
        others = [i for i in kept if i not in new][: MAX_HYPOTHESES - len(new)]
        return [i for i in kept if i in new or i in others]

    def rivals(self, moved: Pose2D) -> tuple[RivalPose, ...]:
        """Return the other hypotheses, most probable first, moved by odometry."""
        if len(self) == 1:
            return ()
        pairs = zip(self.others, self.shares[1:].tolist(), strict=True)
        found = [
            RivalPose(one.pose.compose(moved), share) for one, share in pairs if one.is_compared
        ]
        return tuple(sorted(found, key=lambda rival: -rival.share))

    @property
    def share_among_rivals(self) -> float:
        """Probability of the estimate among itself and its rivals.

        Places that a search has just found count when a view has compared them.
        """
        if len(self) == 1:
            return 1.0
        shares = self.shares
        return float(shares[0] / shares[self._compared].sum())

    @property
    def _compared(self) -> list[bool]:
        return [one is self.best or one.is_compared for one in self]

    def covariance(self) -> FloatArray:
        """Return the (3, 3) covariance about the estimate, rivals included."""
        known = self._compared
        if sum(known) == 1:
            return self.best.covariance
        shares = np.where(known, self.shares, 0.0)
        total = np.zeros((3, 3))
        best = self.best.pose
        for one, share in zip(self, (shares / shares.sum()).tolist(), strict=True):
            turn = wrap_angle(one.pose.heading - best.heading)
            off = np.array([one.pose.x - best.x, one.pose.y - best.y, turn])
            total += share * (one.covariance + np.outer(off, off))
        return total

    def _merge(self) -> None:
        kept: list[Hypothesis] = []
        for hypothesis in self:
            twin = next((one for one in kept if same_place(one.pose, hypothesis.pose)), None)
            if twin is None:
                kept.append(hypothesis)
            else:
                twin.log_weight = float(np.logaddexp(twin.log_weight, hypothesis.log_weight))
        self._all = kept


def same_place(one: Pose2D, other: Pose2D) -> bool:
    """Return whether two poses are too close to be two hypotheses."""
    return are_near(one, other, SAME_DISTANCE, SAME_ANGLE)
