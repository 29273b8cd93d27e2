"""Modes: the places where the robot may be, each with a particle set of its own.

One particle set for several places loses all but one of them by the chance of resampling. Here each
place (mode) is filtered by itself, and its probability follows from evidence that is summed over
different views: which unmapped or missing objects it needs to explain the scans, compared with the
other modes. Places that look the same keep their share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np

from stack.localisation.particle_filter.particles import ParticleSet, summarise
from stack.localisation.particle_filter.uncertainty import LeastCovariance
from stack.localisation.search.rivals import EVIDENCE_CAP, RIVAL_DEAD_ZONE, RIVAL_SHARE
from stack.types import FloatArray, Pose2D, RivalPose, wrap_angle

SETTLED_DEVIATION = 0.25
"""A pose whose deviation is smaller is settled, m: about the radius of a robot."""
RIVAL_LEAD = 2.0
"""A mode becomes the estimate when it is this many times as probable: two equal ones do not
alternate."""
MAX_MODES = 20
"""Number of places that are followed at a time."""

SAME_DISTANCE, SAME_ANGLE = 0.25, pi / 12
"""Metres, radians; modes closer than both are one."""

HEADING_OF_METRE = 0.6
"""Radians of heading deviation that are equivalent to a metre of position deviation."""
_SCAN_SHARE = 0.25
"""Largest share of a view's evidence that one scan adds."""


@dataclass
class Mode:
    """One place where the robot may be.

    Attributes:
        particle_set: at the reference pose of odometry.
        pose: estimate there, map frame.
        covariance: (3, 3) of x, y, heading.
        log_weight: logarithm of its probability, up to a constant.
        news: in [0, 1]: how much of a view is evidence that the weight does not contain yet.
        weighed: views that its weight contains; a mode is reported as a rival from one view on.
        least: covariance that the particles must have at least; None until they have moved.
    """

    particle_set: ParticleSet
    pose: Pose2D
    covariance: FloatArray
    log_weight: float = 0.0
    news: float = 1.0
    weighed: float = 1.0
    least: LeastCovariance | None = None

    @staticmethod
    def of(particle_set: ParticleSet, log_weight: float = 0.0) -> Mode:
        """Return a mode with the mean and covariance of a particle set."""
        pose, covariance = summarise(particle_set)
        return Mode(particle_set, pose, covariance, log_weight)

    def summarise(self) -> None:
        """Set pose and covariance to those of the particles."""
        self.pose, self.covariance = summarise(self.particle_set)

    @property
    def position_deviation(self) -> float:
        """Standard deviation of the position in its most uncertain direction, metres."""
        return largest_deviation(self.covariance)

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


class ModeSet:
    """The modes of a filter, and which of them is the estimate.

    Attributes:
        modes: the first one is the estimate.
    """

    def __init__(self) -> None:
        self.modes: list[Mode] = []

    @property
    def best(self) -> Mode:
        """The estimate."""
        return self.modes[0]

    @property
    def shares(self) -> FloatArray:
        """(n,) probabilities of the modes."""
        if len(self.modes) == 1:
            return np.ones(1)
        logs = np.array([mode.log_weight for mode in self.modes])
        likelihoods = np.exp(logs - logs.max())
        total: FloatArray = likelihoods / likelihoods.sum()
        return total

    def replace(self, modes: Sequence[Mode]) -> None:
        """Restart with these modes, the first one as the estimate."""
        self.modes = list(modes)

    def add(self, mode: Mode) -> bool:
        """Add a mode; return whether it is another place than all others."""
        if any(same_place(mode.pose, other.pose) for other in self.modes):
            return False
        self.modes.append(mode)
        return True

    def travel(self, share: float) -> None:
        """Let the views become new again by a share in [0, 1], since the robot has moved."""
        for mode in self.modes:
            mode.news = min(1.0, mode.news + share)

    def weigh(self, costs: Sequence[float]) -> None:
        """Add the evidence of a scan to the modes' weights, relative to the estimate.

        Args:
            costs: of each mode: minus the log-likelihood of the objects that it has to assume.
        """
        for mode, cost in zip(self.modes[1:], costs[1:], strict=True):
            difference = cost - costs[0]
            beyond = max(0.0, abs(difference) - RIVAL_DEAD_ZONE)
            share = min(_SCAN_SHARE, mode.news)
            mode.news -= share
            mode.weighed += share
            mode.log_weight -= share * float(np.copysign(min(EVIDENCE_CAP, beyond), difference))

    def hold_back(self, fitting: Sequence[bool]) -> None:
        """Keep modes that do not fit well themselves from taking over.

        Where a mapped thing is missing, a wrong pose may need fewer assumptions than the right one.

        Args:
            fitting: for each mode but the estimate, whether the scan fits it well.
        """
        for mode, fits in zip(self.modes[1:], fitting, strict=True):
            if not fits:
                mode.log_weight = min(mode.log_weight, self.modes[0].log_weight - log(2.0))

    def tidy(self) -> bool:
        """Merge, drop and sort modes; return whether another mode is the estimate now."""
        if len(self.modes) == 1:
            return False
        self._merge()
        shares, before = self.shares, self.modes[0]
        best = int(np.argmax(shares))
        if shares[best] < RIVAL_LEAD * shares[0]:
            best = 0
        if best != 0:
            before.weighed, before.news = 0.0, 1.0
        order = [best, *(i for i in np.argsort(-shares, kind="stable").tolist() if i != best)]
        kept = [i for i in order if i == best or shares[i] >= RIVAL_SHARE * shares[best]]
        self.modes = [self.modes[i] for i in self._chosen(kept)]
        top = self.modes[0].log_weight
        for mode in self.modes:
            mode.log_weight -= top
        return self.modes[0] is not before

    def _chosen(self, kept: list[int]) -> list[int]:
        """Return the modes that are not too many, of some in the order of their probabilities.

        Half of the places are for those that no view has compared yet, so that they are not left
        out for others that were found before.
        """
        new = [i for i in kept[1:] if not self.modes[i].is_compared][: MAX_MODES // 2]
        others = [i for i in kept if i not in new][: MAX_MODES - len(new)]
        return [i for i in kept if i in new or i in others]

    def rivals(self, moved: Pose2D) -> tuple[RivalPose, ...]:
        """Return the other modes, most probable first, moved by odometry."""
        if len(self.modes) == 1:
            return ()
        pairs = zip(self.modes[1:], self.shares[1:].tolist(), strict=True)
        found = [
            RivalPose(mode.pose.compose(moved), share) for mode, share in pairs if mode.is_compared
        ]
        return tuple(sorted(found, key=lambda rival: -rival.share))

    @property
    def share_among_rivals(self) -> float:
        """Probability of the estimate among itself and its rivals.

        Places that a search has just found count when a view has compared them.
        """
        if len(self.modes) == 1:
            return 1.0
        compared = [mode is self.best or mode.is_compared for mode in self.modes]
        shares = self.shares
        return float(shares[0] / shares[compared].sum())

    def covariance(self) -> FloatArray:
        """Return the (3, 3) covariance about the estimate, rivals included."""
        known = [mode is self.best or mode.is_compared for mode in self.modes]
        if sum(known) == 1:
            return self.best.covariance
        shares = np.where(known, self.shares, 0.0)
        total = np.zeros((3, 3))
        for mode, share in zip(self.modes, (shares / shares.sum()).tolist(), strict=True):
            turn = wrap_angle(mode.pose.heading - self.best.pose.heading)
            off = np.array([mode.pose.x - self.best.pose.x, mode.pose.y - self.best.pose.y, turn])
            total += share * (mode.covariance + np.outer(off, off))
        return total

    def _merge(self) -> None:
        kept: list[Mode] = []
        for mode in self.modes:
            twin = next((one for one in kept if same_place(one.pose, mode.pose)), None)
            if twin is None:
                kept.append(mode)
            else:
                twin.log_weight = float(np.logaddexp(twin.log_weight, mode.log_weight))
        self.modes = kept


def same_place(one: Pose2D, other: Pose2D) -> bool:
    """Return whether two poses are too close to be two modes."""
    turned = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) < SAME_DISTANCE and turned < SAME_ANGLE
