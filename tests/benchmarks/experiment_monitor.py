"""Compares the estimate with the truth after each step of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, inf, radians

import numpy as np

from stack.types import (
    FloatArray,
    Pose2D,
    PoseEstimate,
    wrap_angle,
)
from tests.benchmarks.experiments import EVENT_TIME, Experiment

SAMPLE_PERIOD = 0.1
"""Seconds between two samples of error and health."""

NEAR = (0.3, radians(10.0))
"""Metres and radians: the health is the probability that the error is below both."""

CORRECTED = 0.1
"""Metres of error below which the pose is right again after a push or a kidnap."""

KEPT = 1.0
"""Seconds for which it must stay right."""

MOVING = 0.05
"""Speed, m/s and rad/s, above which the robot drives."""

BINS = 10
"""Bins of the reliability diagram, over the health from 0 to 1."""

CHI_SQUARE = 5.991
"""95 % quantile of the chi-square distribution with two degrees of freedom."""


@dataclass(frozen=True)
class Sample:
    """State after a step.

    Attributes:
        time: of estimate and truth, seconds.
        speed: true speed, and turning speed times one metre, the larger, m/s.
        disturbed: whether the odometry says that it is disturbed.
    """

    time: float
    estimate: PoseEstimate
    truth: Pose2D
    speed: float
    disturbed: bool = False

    @property
    def error(self) -> float:
        """Distance between estimate and truth, metres."""
        return self.estimate.pose.distance_to(self.truth)

    @property
    def turn(self) -> float:
        """Error of the heading, radians, positive."""
        return abs(wrap_angle(self.estimate.pose.heading - self.truth.heading))

    @property
    def is_near(self) -> bool:
        """Whether the pose is right in the sense of the health."""
        return self.error <= NEAR[0] and self.turn <= NEAR[1]

    @property
    def is_contained(self) -> bool:
        """Whether the 95 % ellipse of the covariance contains the error of the position."""
        pose = self.estimate.pose
        offset = np.array([pose.x - self.truth.x, pose.y - self.truth.y])
        block: FloatArray = self.estimate.covariance[:2, :2] + 1e-9 * np.eye(2)
        return bool(offset @ np.linalg.solve(block, offset) <= CHI_SQUARE)


@dataclass
class LocalisationMonitor:
    """Figures of one run.

    Attributes:
        noticed: seconds from the event until the robot was lost, disturbed or right again.
        corrected: seconds from the event until the pose was right and stayed so.
        driving: seconds of driving until the pose of an unknown start was right and stayed so.
        lost_falsely: times at which the pose became LOST although it was right. A pose with rivals
            is ambiguous: of three equal rooms, each has a probability of a third.
        bins: (BINS, 3): samples, sum of the health, samples with a right pose.
        trace: truth and estimate at each sample, for the picture.
        wrong_claims: seconds with a good health and no rivals at a wrong pose.
    """

    experiment: Experiment
    noticed: float = inf
    corrected: float = inf
    driving: float = inf
    lost_falsely: int = 0
    wrong_claims: float = 0.0
    ambiguous: float = 0.0
    trace: list[tuple[Pose2D, Pose2D]] = field(default_factory=list)
    errors: list[tuple[float, float]] = field(default_factory=list)
    contained: int = 0
    bins: FloatArray = field(default_factory=lambda: np.zeros((BINS, 3)))
    _was_lost: bool = False
    _right_since: float = inf
    _driven: float = 0.0
    _driven_when_right: float = 0.0
    _next: float = 0.0

    def update(self, sample: Sample, period: float) -> None:
        """Add the state after a step of `period` seconds."""
        self._follow_event(sample)
        if sample.speed > MOVING:
            self._driven += period
        estimate = sample.estimate
        is_lost = estimate.health < estimate.thresholds.lost and not estimate.ambiguous
        if is_lost and not self._was_lost and sample.is_near:
            self.lost_falsely += 1
        self._was_lost = is_lost
        if sample.time + 1e-9 >= self._next:
            self._next = sample.time + SAMPLE_PERIOD
            self._record(sample)

    @property
    def is_done(self) -> bool:
        """Whether nothing more can be learnt before the time of the run is over."""
        event = self.experiment.event
        if event in ("push", "kidnap"):
            return self.corrected < inf
        return event == "unknown" and self.experiment.name == "unknown" and self.driving < inf

    def _record(self, sample: Sample) -> None:
        health = sample.estimate.health
        self.errors.append((sample.error, sample.turn))
        self.trace.append((sample.truth, sample.estimate.pose))
        self.contained += sample.is_contained
        row = self.bins[min(BINS - 1, int(health * BINS))]
        row += (1.0, health, float(sample.is_near))
        self.ambiguous += SAMPLE_PERIOD * sample.estimate.ambiguous
        claims = health >= sample.estimate.thresholds.good and not sample.estimate.ambiguous
        self.wrong_claims += SAMPLE_PERIOD * (claims and not sample.is_near)

    def _follow_event(self, sample: Sample) -> None:
        """Follow how soon the pose is right: after an event, or after an unknown start."""
        event = self.experiment.event
        begin = EVENT_TIME if event in ("push", "kidnap") else 0.0
        after = sample.time - begin
        if not event or after <= 0.0:
            return
        is_right = sample.error < CORRECTED if event != "unknown" else sample.is_near
        if not is_right:
            self._right_since = inf
        elif self._right_since == inf:
            self._right_since, self._driven_when_right = after, self._driven
        notices = sample.disturbed or sample.estimate.health < sample.estimate.thresholds.lost
        if self.noticed == inf and notices:
            self.noticed = after
        if self.corrected == inf and after - self._right_since >= KEPT and self._is_after(after):
            self.corrected, self.driving = self._right_since, self._driven_when_right
            self.noticed = min(self.noticed, self._right_since)

    def _is_after(self, after: float) -> bool:
        """Whether the event is over: a push lasts up to 2.3 s, in which the pose may be right."""
        return self.experiment.event != "push" or after > 4.0


def speed_of(linear: float, lateral: float, angular: float) -> float:
    """Return the larger of the speed and the turning speed, m/s and rad/s."""
    return max(hypot(linear, lateral), abs(angular))
