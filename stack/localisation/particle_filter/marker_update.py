"""Markers in the particle filter: weights of the particles, evidence of the modes, new modes."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.localisation.distance_field import SignedDistanceField, as_row
from stack.localisation.marker_mixture import Mixture, components_of
from stack.localisation.particle_filter.beam_model import weighted
from stack.localisation.particle_filter.filter import ParticleFilter
from stack.localisation.particle_filter.modes import Mode
from stack.localisation.particle_filter.particles import ParticleSet
from stack.localisation.particle_filter.uncertainty import stretch, widened
from stack.types import FloatArray, MarkerFix, Pose2D

MARKER_EVIDENCE = 3.0
"""Largest evidence of the markers in one picture for or against a mode."""

_FEWEST = 30.0
"""Effective particles after weighting, below which they are drawn from the posterior instead."""

_FALSE = 0.5
"""Probability of a false measurement from which on it says nothing of where in a mode the robot is.
"""

_LEAST_COVARIANCE = np.diag([0.03**2, 0.03**2, 0.02**2])
"""Covariance that is added to that of a new mode: cells and noise."""

_ELSEWHERE = -4.0
"""Log-weight of a new mode relative to the estimate: a marker that was moved is about as frequent
as a robot that was."""


class MarkerUpdate:
    """Adds the poses that markers give to the modes of a particle filter.

    Args:
        field: the map.
        particle_filter: its modes are changed.
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
        carried = [one.carried(since, noise) for one in components_of(fix.candidates)]
        return Mixture(carried, self._volume)

    def apply(self, likelihood: Mixture) -> bool:
        """Update all modes; return whether another one is the estimate now.

        A mode that the markers contradict keeps its particles. If they contradict all modes, their
        candidates become modes, and further pictures and scans decide.
        """
        modes, cap = self._filter.modes, MARKER_EVIDENCE
        found = [likelihood.evidence(mode.pose, mode.covariance) for mode in modes.modes]
        for mode, (evidence, shares) in zip(modes.modes, found, strict=True):
            mode.log_weight += float(np.clip(evidence - found[0][0], -cap, cap))
            if shares[-1] < _FALSE:
                self._weigh(mode, likelihood, shares)
        if all(shares[-1] >= _FALSE for _, shares in found):
            self._add(likelihood)
        return modes.tidy()

    def modes_of(self, likelihood: Mixture) -> list[Mode]:
        """Return a mode at each candidate, weighted by its share."""
        return [
            self._filter.around(
                one.pose, one.covariance + _LEAST_COVARIANCE, float(np.log(max(one.share, 1e-9)))
            )
            for one in likelihood.components
        ]

    def _add(self, likelihood: Mixture) -> None:
        weight = self._filter.modes.best.log_weight + _ELSEWHERE
        for mode in self.modes_of(likelihood):
            mode.log_weight += weight
            mode.weighed = 0.0
            self._filter.modes.add(mode)

    def _weigh(self, mode: Mode, likelihood: Mixture, shares: FloatArray) -> None:
        """Weight the particles of a mode, and move its pose by the gain of a Kalman filter."""
        mean, covariance = likelihood.posterior(mode.pose, mode.covariance)
        poses = mode.particle_set.poses
        weights = weighted(mode, likelihood.log_likelihoods(poses))
        mode.particle_set = ParticleSet(poses, weights)
        if 1.0 / float(weights @ weights) < _FEWEST:
            drawn = self._filter.around(mean, covariance)
            mode.particle_set = drawn.particle_set
        self._filter.resample(mode)
        mode.summarise()
        shift = mode.pose
        mode.pose = mean
        information = likelihood.information(shares)
        if mode.least is None:
            return
        mode.least = mode.least.observed(information)
        matrix = stretch(mode.covariance, mode.least.pose, information)
        if matrix is not None:
            widened_poses = widened(mode.particle_set.poses, as_row(shift), matrix)
            mode.particle_set = ParticleSet(widened_poses, mode.particle_set.weights)
            mode.covariance = matrix @ mode.covariance @ matrix.T
