"""Multi-modal particle filter: predicts, weights, aligns and resamples the set of each mode.

S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapters 5, 6.4 and 8.3; the number of
particles follows D. Fox, "Adapting the Sample Size in Particle Filters Through KLD-Sampling",
IJRR 22(12), 2003.
"""

from __future__ import annotations

import numpy as np

from stack.localisation.distance_field import SignedDistanceField, as_pose, as_row
from stack.localisation.health import ScanEvaluator
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particle_filter.beam_model import TRUST, BeamModel, weighted
from stack.localisation.particle_filter.modes import SETTLED_DEVIATION, Mode, ModeSet
from stack.localisation.particle_filter.motion_models import MotionModel, disturb
from stack.localisation.particle_filter.odometry_since import MotionSince
from stack.localisation.particle_filter.particles import ParticleSet, kld_bound
from stack.localisation.particle_filter.uncertainty import (
    LeastCovariance,
    observable,
    stretch,
    widened,
)
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

_POINT_VARIANCE = 0.05**2
"""m²; variance of a return about the map's surface in scan alignment. Larger than the lidar's,
since beams are not independent."""

_WEIGHT = np.array([0.1])
"""Metres; distance of a point to the surface at which it observes a quarter."""

_LEAST_SPREAD = np.diag([1e-6, 1e-6, 1e-6])
"""Covariance that a prior of an alignment has at least, metres and radians."""

_WIDEST = 1.0
"""Metres; particles with a larger deviation are not one place, and are not widened."""

_NEGLIGIBLE = 1e-4
"""Metres and radians; smaller corrections of a correction are left out."""

_LEAST_PARTICLES = 50
"""Particles of a rival, at least."""


class ParticleFilter:
    """Particle sets of the places where the robot may be.

    Args:
        field: the map.
        evaluator: of the same map.
        motion: motion model of the robot's drive.
        parameters: of the estimator.
        generator: of all samples.

    Attributes:
        modes: the places; the first one is the estimate.
        beams: sensor model.
    """

    def __init__(
        self, field: SignedDistanceField, evaluator: ScanEvaluator, motion: MotionModel,
        parameters: LocaliserParameters, generator: np.random.Generator,
    ) -> None:  # fmt: skip
        from stack.localisation.particle_filter import kernels
        from stack.localisation.search import kernels as search_kernels

        self._kernels, self._field, self._evaluator = kernels, field, evaluator
        self._search_kernels = search_kernels
        self._generator = generator
        self.modes = ModeSet()
        self.configure(motion, parameters)

    def configure(self, motion: MotionModel, parameters: LocaliserParameters) -> None:
        """Apply new parameters; the particles stay."""
        self._parameters, self._motion = parameters, motion
        self.beams = BeamModel(self._field, self._evaluator, parameters)

    @property
    def particles(self) -> FloatArray:
        """(n, 3) poses of all particles at the reference pose, map frame."""
        return np.concatenate([mode.particle_set.poses for mode in self.modes.modes])

    def around(self, pose: Pose2D, covariance: FloatArray, log_weight: float = 0.0) -> Mode:
        """Return a mode of normally distributed particles; a pose at the reference, map frame."""
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        limit = self._parameters.max_particles
        poses = as_row(pose) + self._generator.normal(0.0, 1.0, (limit, 3)) @ root.T
        mode = Mode.of(ParticleSet.uniform(poses[: self._count(poses)]), log_weight)
        mode.pose = pose
        return mode

    def scatter(self) -> None:
        """Restart with one mode, uniform over the free space."""
        cells = self._field.free_cells(0.0)
        count = self._parameters.max_particles
        poses = self._generator.uniform(-np.pi, np.pi, (count, 3))
        if cells.shape[0]:
            shift = self._generator.uniform(-0.5, 0.5, (count, 2)) * self._field.resolution
            chosen = cells[self._generator.integers(0, cells.shape[0], count)]
            poses[:, :2] = self._field.centres(chosen) + shift
        self.modes.replace([Mode.of(ParticleSet.uniform(poses))])

    def predict(self, motion: MotionSince) -> None:
        """Move all particles by an odometry displacement with sampled errors."""
        noise = self._motion.covariance(motion.moved) + motion.covariance
        for mode in self.modes.modes:
            before, p = mode.particle_set.poses, self._parameters
            least = mode.least or LeastCovariance.of(mode.covariance)
            mode.least = least.moved(mode.pose.heading, motion.moved, noise, p.odometry_scale)
            poses = self._motion.sample(before, motion.moved, self._generator)
            if motion.covariance.any():
                poses = disturb(poses, before[:, 2], motion.covariance, self._generator)
            mode.particle_set = ParticleSet(poses, mode.particle_set.weights)
            mode.pose = mode.pose.compose(motion.moved)

    def spread(self, mode: Mode) -> None:
        """Set the covariance of a mode to that of its particles; its pose follows odometry."""
        pose = mode.pose
        mode.summarise()
        mode.pose = pose

    def measure(self, mode: Mode, scan: Scan) -> None:
        """Weight a mode's particles by a scan, estimate, align and resample.

        Call `predict` before.
        """
        points = self.beams.points(mode.pose, scan, skip=mode.is_settled)
        if points.shape[0] == 0:
            self.spread(mode)
            return
        predicted, poses = mode.pose, mode.particle_set.poses
        weights = weighted(mode, self.beams.log_likelihoods(poses, points))
        mode.particle_set = ParticleSet(poses, weights)
        mode.summarise()
        mean = mode.pose
        if mode.is_settled:
            self._align(mode, points)
        self.resample(mode)
        self._observe(mode, predicted, mean, points)

    def _observe(self, mode: Mode, predicted: Pose2D, mean: Pose2D, points: FloatArray) -> None:
        """Undo what the measurement changed in directions that the points do not observe."""
        if mode.least is None:
            return
        _, found = self._search_kernels.align(
            self._field.distances, self._field.placement, as_row(mode.pose)[None],
            np.ascontiguousarray(points), _WEIGHT, 1,
        )  # fmt: skip
        share = TRUST / _POINT_VARIANCE
        information = share * observable(found[0], points.shape[0])
        least, mode.least = mode.least, mode.least.observed(information)
        if mode.position_deviation > _WIDEST:
            return
        poses = mode.particle_set.poses
        matrix = stretch(mode.covariance, mode.least.pose, information)
        if matrix is not None:
            poses = widened(poses, as_row(mean), matrix)
            mode.covariance = matrix @ mode.covariance @ matrix.T
        turn = wrap_angle(mode.pose.heading - predicted.heading)
        by = np.array([mode.pose.x - predicted.x, mode.pose.y - predicted.y, turn])
        back = least.shift(by, information) - by
        if np.abs(back).max() > _NEGLIGIBLE:
            poses = poses + back
            mode.pose = as_pose(as_row(mode.pose) + back)
        mode.particle_set = ParticleSet(poses, mode.particle_set.weights)

    def _align(self, mode: Mode, points: FloatArray) -> None:
        """Align the scan to the map, with the mean and covariance of the particles as prior."""
        spread_out = mode.covariance + _LEAST_SPREAD
        information = _POINT_VARIANCE * np.asarray(np.linalg.inv(spread_out), dtype=np.float64)
        refined = self._kernels.refine_pose(
            self._field.distances, self._field.placement, as_row(mode.pose), information,
            points, 0.1,
        )  # fmt: skip
        aligned = as_pose(refined)
        if aligned.distance_to(mode.pose) < SETTLED_DEVIATION:
            mode.pose = aligned

    def noise(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of an odometry displacement, in the frame before it."""
        return self._motion.covariance(moved)

    def resample(self, mode: Mode) -> None:
        """Resample a mode's particles if few of them carry most of the weight."""
        weights = mode.particle_set.weights
        if 1.0 / float(weights @ weights) > 0.5 * weights.size:
            return
        limit = self._parameters.max_particles // len(self.modes.modes)
        limit = max(limit, _LEAST_PARTICLES)
        poses = mode.particle_set.poses
        draw = self._kernels.resample(weights, limit, self._generator.random())
        count = self._count(poses[draw])
        if count < limit:
            draw = self._kernels.resample(weights, count, self._generator.random())
        mode.particle_set = ParticleSet.uniform(poses[draw])

    def _count(self, poses: FloatArray) -> int:
        p, rivals = self._parameters, len(self.modes.modes) - 1
        least = max(p.min_particles // (1 + max(0, rivals)), _LEAST_PARTICLES)
        return min(max(kld_bound(poses, p.kld_error, p.kld_quantile), least), int(poses.shape[0]))
