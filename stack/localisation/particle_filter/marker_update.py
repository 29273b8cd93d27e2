"""Markers in the particle filter: weights of particles, evidence, new hypotheses."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.marker_mixture import Mixture, carried
from stack.localisation.particle_filter.filter import ParticleFilter
from stack.localisation.particle_filter.hypotheses import Hypothesis
from stack.types import FloatArray, MarkerFix, Pose2D

MARKER_EVIDENCE = 3.0
"""Largest evidence of the markers in one picture for or against a hypothesis."""

_FEWEST = 30.0
"""Effective particles after weighting, below which they are drawn from the posterior instead."""

_FALSE = 0.5
"""Probability of a false measurement from which on it does not weight the particles."""

_LEAST_COVARIANCE = np.diag([0.03**2, 0.03**2, 0.02**2])
"""Covariance that is added to that of a new hypothesis: cells and noise."""

_ELSEWHERE = -4.0
"""Log-weight of a new hypothesis relative to the estimate: a marker that was moved is about as
frequent as a robot that was."""


class MarkerUpdate:
    """Adds the poses that markers give to the hypotheses of a particle filter.

    Args:
        field: the map.
        particle_filter: its hypotheses are changed.
    """

    def __init__(self, field: SignedDistanceField, particle_filter: ParticleFilter) -> None:
        self._filter = particle_filter
        self._volume = max(1.0, field.free_cells(0.0).size * field.resolution**2) * 2.0 * pi

    def likelihood(self, fix: MarkerFix, since: Pose2D, stated: FloatArray) -> Mixture:
        """Return the likelihood of the pose at the filter's reference.

        Args:
            fix: markers of a picture.
            since: the reference in the base frame at the picture's stamp, by odometry.
            stated: (3, 3) covariance that odometry states of it.
        """
        noise = self._filter.noise(since) + stated
        return Mixture([carried(one, since, noise) for one in fix.candidates], self._volume)

    def apply(self, likelihood: Mixture) -> bool:
        """Update all hypotheses; return whether another one is the estimate now.

        A hypothesis that the markers contradict keeps its particles. If they contradict all, their
        candidates become hypotheses, and further pictures and scans decide.
        """
        hypotheses = self._filter.hypotheses
        found = [likelihood.evidence(one.pose, one.covariance) for one in hypotheses]
        hypotheses.add_evidence([evidence for evidence, _ in found], MARKER_EVIDENCE)
        for hypothesis, (_, shares) in zip(hypotheses, found, strict=True):
            if shares[-1] < _FALSE:
                self._weigh(hypothesis, likelihood, shares)
        if all(shares[-1] >= _FALSE for _, shares in found):
            for added in self.hypotheses_of(likelihood, hypotheses.best.log_weight + _ELSEWHERE):
                hypotheses.add(added)
        return hypotheses.tidy()

    def hypotheses_of(self, likelihood: Mixture, log_weight: float = 0.0) -> list[Hypothesis]:
        """Return one at each candidate, weighted by its share and by a common log-weight."""
        return [
            self._filter.around(
                one.pose, one.covariance + _LEAST_COVARIANCE,
                float(np.log(max(one.share, 1e-9))) + log_weight,
            )
            for one in likelihood.components
        ]  # fmt: skip

    def _weigh(self, hypothesis: Hypothesis, likelihood: Mixture, shares: FloatArray) -> None:
        """Weight the particles, and move the pose by the gain of a Kalman filter."""
        mean, covariance = likelihood.posterior(hypothesis.pose, hypothesis.covariance)
        weights = hypothesis.weight(likelihood.log_likelihoods(hypothesis.particle_set.poses))
        if 1.0 / float(weights @ weights) < _FEWEST:
            hypothesis.replace_particles(self._filter.around(mean, covariance).particle_set.poses)
        self._filter.resample(hypothesis)
        centre = hypothesis.summarise()
        hypothesis.follow(mean)
        hypothesis.observe(likelihood.information(shares), centre)
