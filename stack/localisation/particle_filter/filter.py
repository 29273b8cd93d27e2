"""Particle filter of several hypotheses: predicts, weights, aligns and resamples each set.

S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapters 5, 6.4 and 8.3; the number of
particles follows D. Fox, "Adapting the Sample Size in Particle Filters Through KLD-Sampling",
IJRR 22(12), 2003.
"""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.localisation.distance_field import alignment_variance
from stack.localisation.known_map import KnownMap
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.beam_model import TRUST, BeamModel
from stack.localisation.particle_filter.hypotheses import SETTLED_DEVIATION, Hypotheses, Hypothesis
from stack.localisation.particle_filter.motion_models import disturb, motion_model
from stack.localisation.particle_filter.odometry_since import MotionSince
from stack.localisation.particle_filter.particles import (
    ParticleSet,
    kld_bound,
    resampled,
    summarise,
)
from stack.localisation.particle_filter.uncertainty import LeastCovariance, observable
from stack.localisation.planar import as_pose, as_row
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

_WEIGHT = np.array([0.1])
"""Metres; distance of a point to the surface at which it observes a quarter."""

_LEAST_SPREAD = np.diag([1e-6, 1e-6, 1e-6])
"""Covariance that a prior of an alignment has at least, metres and radians."""

_NEGLIGIBLE = 1e-4
"""Metres and radians; smaller corrections of a correction are left out."""

KLD_ERROR, KLD_QUANTILE = 0.05, 2.33
"""Error of the distribution that sets the number of particles, as AMCL's pf_err, and the normal
quantile of the probability that it is kept: 99 %."""

_LEAST_PARTICLES = 50
"""Particles of a rival, at least."""


class ParticleFilter:
    """Particle sets of the places where the robot may be.

    Args:
        known_map: the map.
        robot: its drive and the errors of its odometry.
        parameters: of the estimator.
        generator: of all samples.

    Attributes:
        hypotheses: the places; the first one is the estimate.
        beams: sensor model.
    """

    def __init__(
        self, known_map: KnownMap, robot: RobotDescription, parameters: LocaliserParameters,
        generator: np.random.Generator,
    ) -> None:  # fmt: skip
        from stack.localisation.search import kernels

        self._kernels, self._map, self._field = kernels, known_map, known_map.field
        self._generator, self._variance = generator, alignment_variance(known_map.noise)
        self.hypotheses = Hypotheses()
        self._motion, self._scale_error = motion_model(robot), robot.odometry.scale_error
        self.configure(parameters)

    def configure(self, parameters: LocaliserParameters) -> None:
        """Apply new parameters; the particles stay."""
        self._parameters = parameters
        self.beams = BeamModel(self._map, parameters)

    @property
    def particles(self) -> FloatArray:
        """(n, 3) poses of all particles at the reference pose, map frame."""
        return np.concatenate([one.particle_set.poses for one in self.hypotheses])

    def around(self, pose: Pose2D, covariance: FloatArray, log_weight: float = 0.0) -> Hypothesis:
        """Return normally distributed particles about a pose at the reference, map frame."""
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        limit = self._parameters.max_particles
        poses = as_row(pose) + self._generator.normal(0.0, 1.0, (limit, 3)) @ root.T
        particles = ParticleSet.uniform(poses[: self._count(poses)])
        return Hypothesis(particles, pose, summarise(particles)[1], log_weight)

    def scatter(self) -> None:
        """Restart with one hypothesis, uniform over the free space."""
        cells = self._field.free_cells(0.0)
        count = self._parameters.max_particles
        poses = self._generator.uniform(-np.pi, np.pi, (count, 3))
        if cells.shape[0]:
            shift = self._generator.uniform(-0.5, 0.5, (count, 2)) * self._field.resolution
            chosen = cells[self._generator.integers(0, cells.shape[0], count)]
            poses[:, :2] = self._field.centres(chosen) + shift
        particles = ParticleSet.uniform(poses)
        self.hypotheses.replace([Hypothesis(particles, *summarise(particles))])

    def predict(self, motion: MotionSince) -> None:
        """Move all particles by an odometry displacement with sampled errors."""
        noise = self._motion.covariance(motion.moved) + motion.covariance
        for hypothesis in self.hypotheses:
            before, heading = hypothesis.particle_set.poses, hypothesis.pose.heading
            least = hypothesis.least or LeastCovariance.of(hypothesis.covariance)
            least = least.moved(heading, motion.moved, noise, self._scale_error)
            poses = self._motion.sample(before, motion.moved, self._generator)
            if motion.covariance.any():
                poses = disturb(poses, before[:, 2], motion.covariance, self._generator)
            hypothesis.predict(poses, motion.moved, least)

    def measure(self, hypothesis: Hypothesis, scan: Scan) -> None:
        """Weight particles by a scan, estimate, align and resample.

        Call `predict` before.
        """
        predicted, settled = hypothesis.pose, hypothesis.is_settled
        points = self.beams.points(predicted, scan, skip=settled)
        if points.shape[0] == 0:
            hypothesis.spread()
            return
        hypothesis.weight(self.beams.log_likelihoods(hypothesis.particle_set.poses, points))
        mean = hypothesis.summarise()
        if hypothesis.is_settled:
            self._align(hypothesis, points)
        self.resample(hypothesis)
        self._observe(hypothesis, predicted, mean, points)

    def _observe(
        self, hypothesis: Hypothesis, predicted: Pose2D, mean: Pose2D, points: FloatArray
    ) -> None:
        """Undo what the measurement changed in directions that the points do not observe."""
        least, pose = hypothesis.least, hypothesis.pose
        if least is None:
            return
        _, found = self._kernels.align(
            self._field.distances, self._field.placement, as_row(pose)[None],
            np.ascontiguousarray(points), _WEIGHT, 1,
        )  # fmt: skip
        share = TRUST / self._variance
        information = share * observable(found[0], points.shape[0])
        turn = wrap_angle(pose.heading - predicted.heading)
        by = np.array([pose.x - predicted.x, pose.y - predicted.y, turn])
        is_one_place = hypothesis.is_one_place
        hypothesis.observe(information, mean)
        back = least.shift(by, information) - by
        if is_one_place and np.abs(back).max() > _NEGLIGIBLE:
            hypothesis.shift(back)

    def _align(self, hypothesis: Hypothesis, points: FloatArray) -> None:
        """Align the scan to the map, with the mean and covariance of the particles as prior."""
        pose, spread_out = hypothesis.pose, hypothesis.covariance + _LEAST_SPREAD
        information = self._variance * np.asarray(np.linalg.inv(spread_out), dtype=np.float64)
        aligned = as_pose(self._kernels.refine_pose(
            self._field.distances, self._field.placement, as_row(pose), information, points, 0.1,
        ))  # fmt: skip
        if aligned.distance_to(pose) < SETTLED_DEVIATION:
            hypothesis.follow(aligned)

    def noise(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of an odometry displacement, in the frame before it."""
        return self._motion.covariance(moved)

    def resample(self, hypothesis: Hypothesis) -> None:
        """Resample the particles if few of them carry most of the weight."""
        weights, poses = hypothesis.particle_set.weights, hypothesis.particle_set.poses
        if 1.0 / float(weights @ weights) > 0.5 * weights.size:
            return
        limit = max(self._parameters.max_particles // len(self.hypotheses), _LEAST_PARTICLES)
        draw = resampled(weights, limit, self._generator.random())
        count = self._count(poses[draw])
        if count < limit:
            draw = resampled(weights, count, self._generator.random())
        hypothesis.replace_particles(poses[draw])

    def _count(self, poses: FloatArray) -> int:
        p, rivals = self._parameters, len(self.hypotheses) - 1
        least = max(p.min_particles // (1 + max(0, rivals)), _LEAST_PARTICLES)
        return min(max(kld_bound(poses, KLD_ERROR, KLD_QUANTILE), least), int(poses.shape[0]))
