"""Monte-Carlo localisation: the robot's pose on a known map by a particle filter.

S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapters 5, 6.4 and 8.3; the number of
particles follows D. Fox, "Adapting the Sample Size in Particle Filters Through KLD-Sampling",
IJRR 22(12), 2003. Unlike AMCL, the filter injects no random particles: after a kidnap its pose
follows odometry, its health drops, and the global search finds the new pose.
"""

from __future__ import annotations

from math import pi

import numpy as np

from stack.compilation import KernelTypes
from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.localisation.distance_field import as_pose, as_row, surface_field
from stack.localisation.health import FitScale, RecentMedian, ScanEvaluator, calibrate
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.particles import (
    MotionNoise,
    OmniMotionNoise,
    ParticleSet,
    kld_bound,
    move,
    summarise,
)
from stack.localisation.search.global_match import HEADINGS, SEED_SPACING, GlobalMatcher, decide
from stack.localisation.search.local_match import LocalMatcher, map_search
from stack.localisation.search.matches import (
    GlobalMatch,
    Views,
    beam_points,
    returned_beams,
    scan_points,
)
from stack.parameters import suggestion
from stack.streams import stream
from stack.types import (
    TYPICAL_HEALTH,
    FloatArray,
    Observation,
    OccupancyGrid,
    Pose2D,
    PoseEstimate,
    Scan,
)

_HEADING_OF_METRE = 0.6
"""Radians of heading deviation that are equivalent to a metre of position deviation."""

_POINT_VARIANCE = 0.05**2
"""m²; variance of a return about the map's surface in scan alignment. Larger than the lidar's,
since beams are not independent."""

_NO_FIT = 0.5
"""Share of the fit at LOST_HEALTH; a lower fit means that the robot is not near the estimate."""

_STILL_UPDATES = 2
"""Largest number of measurement updates at standstill: the same view adds little evidence."""


class Localiser(Estimator):
    """Monte-Carlo localisation: a particle filter on the map with the scans of one lidar.

    It follows the pose on a likelihood field. Its health shows a wrong pose.
    """

    Parameters = LocaliserParameters
    needs_map = True
    parameters: LocaliserParameters

    @staticmethod
    def kernels(parameters: LocaliserParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of the filter and of the search."""
        from stack.localisation import kernels
        from stack.localisation.search import kernels as search_kernels

        return (*kernels.LOCALISATION, *search_kernels.SEARCH)

    def __init__(
        self,
        parameters: LocaliserParameters,
        robot: RobotDescription,
        grid: OccupancyGrid,
        seed: int,
    ) -> None:
        from stack.localisation import kernels

        super().__init__(parameters, robot, grid, seed)
        self._robot, self._kernels = robot, kernels
        self._generator = stream(seed, "localisation")
        self._calibration = stream(seed, "localisation calibration")
        self._field = surface_field(grid)
        self._evaluator = ScanEvaluator(self._field)
        self._scale: FitScale | None = None
        self._fits = RecentMedian(parameters.health_window)
        self._use(parameters)
        self._odometry: Pose2D | None = None
        self._fit: float | None = None
        self._time = self._corrected_at = 0.0
        self._jumps = -1
        self.scatter()

    @staticmethod
    def check(parameters: LocaliserParameters, robot: RobotDescription) -> None:
        """Check that the robot has the lidar.

        Raises:
            InputError: it has none of that name.
        """
        if parameters.lidar and parameters.lidar not in robot.all_lidars:
            hint = suggestion(parameters.lidar, robot.all_lidars)
            raise InputError(f"{robot.name} has no lidar {parameters.lidar!r}; {hint}")

    def configure(self, parameters: LocaliserParameters) -> None:
        """Apply new parameters; the particles stay.

        Raises:
            InputError: the robot has no such lidar.
        """
        self.check(parameters, self._robot)
        p, before = parameters, self.parameters
        if (p.range_noise, p.health_obstacles) != (before.range_noise, before.health_obstacles):
            self._scale = None
        self._use(parameters)

    def _use(self, parameters: LocaliserParameters) -> None:
        """Derive everything that depends on the parameters and the map."""
        p = self.parameters = parameters
        self.lidar = p.lidar or self._robot.main_lidar
        self._table = self._field.log_likelihoods(p.hit_deviation, p.hit_share)
        self._least = float(self._table.min())
        search = map_search(self._field, p)
        self._matcher = GlobalMatcher(self._field, self._evaluator, p, search)
        self._local_matcher = LocalMatcher(self._field, self._evaluator, p, search)
        self._fits.window = p.health_window
        alphas = p.alpha_1, p.alpha_2, p.alpha_3, p.alpha_4
        sideways = self._robot.drivetrain.can_move_sideways
        self._noise = OmniMotionNoise(*alphas, p.alpha_5) if sideways else MotionNoise(*alphas)

    def start(self, pose: Pose2D | None) -> None:
        """Start around the initial pose; if that is unknown, anywhere on the map."""
        if pose is None:
            self.scatter()
        else:
            p = self.parameters
            self.set_pose(pose, p.initial_position_deviation, p.initial_heading_deviation)

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Restart around a pose in the map frame; standard deviations in metres and radians."""
        deviations = [position_deviation, position_deviation, heading_deviation]
        poses = self._generator.normal(as_row(pose), deviations, (self.parameters.max_particles, 3))
        self._reset(ParticleSet.uniform(poses[: self._particle_count(poses)]))
        self._map_from_odom = pose.compose(self._reference.inverse())

    def scatter(self) -> None:
        """Restart with particles uniform over the free space."""
        cells = self._field.free_cells(0.0)
        count = self.parameters.max_particles
        poses = self._generator.uniform(-pi, pi, (count, 3))
        if cells.shape[0]:
            shift = self._generator.uniform(-0.5, 0.5, (count, 2)) * self._field.resolution
            chosen = cells[self._generator.integers(0, cells.shape[0], count)]
            poses[:, :2] = self._field.centres(chosen) + shift
        self._reset(ParticleSet.uniform(poses))
        self._scattered = True

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Process odometry, and a new scan at the pose of its own stamp."""
        self._time = observation.time
        scan = observation.named(self.lidar, Scan)
        if scan is not None:
            self.process(frames.pose_at("odom", scan.stamp), scan)
            self._corrected_at = scan.stamp
        self.process(frames.pose_at("odom", observation.time))
        return self.estimate

    def process(self, odometry: Pose2D, scan: Scan | None = None) -> None:
        """Update the estimate with odometry and an optional scan taken at that pose.

        Args:
            odometry: pose in the odom frame.
            scan: a new scan, or None. Every scan updates the health. It weights the particles only
                if the robot has moved since the last measurement update, or once at standstill
                (twice while the pose is uncertain).
        """
        if self._odometry is None:
            self._reference = odometry
            self._map_from_odom = self._map_from_odom.compose(odometry.inverse())
        self._odometry = odometry
        if scan is None:
            return
        if self._scattered:
            self._seed(scan)
        elif self._is_update_due():
            self._predict_only() if self._is_kidnapped(scan) else self._measurement_update(scan)
        self._fit = self._evaluator.fit(self._pose, scan)
        self._fits.add(scan.stamp, self._fit)
        self._fit_scale(scan)

    @property
    def estimate(self) -> PoseEstimate:
        """The pose, propagated by odometry since the last scan, with covariance and health.

        Until the first scan after a start the health is the median at a true pose, so that
        starting raises no alarm; scattered particles have health 0.
        """
        fit = self._fits.value
        if fit is None or self._scale is None:
            health = 0.0 if self._scattered else TYPICAL_HEALTH
        else:
            health = self._scale.health(fit)
        return PoseEstimate(
            self._pose, self._covariance, health,
            self._map_from_odom, self._corrected_at, self._jumps,
        )  # fmt: skip

    @property
    def map_from_odom(self) -> Pose2D:
        """The odom frame's pose in the map frame."""
        return self._map_from_odom

    @property
    def particles(self) -> FloatArray:
        """(n, 3) x, y, heading of the particles in the map frame, propagated by odometry."""
        return move(self._particle_set.poses, self._moved)

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose, map frame."""
        return self._fit_scale(scan).health(self._evaluator.fit(pose, scan))

    def match_globally(self, scan: Scan, earlier: Views = ()) -> list[GlobalMatch]:
        """Return distinct poses on the whole map that explain the scans, best first.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame
                (from odometry). They resolve ambiguities of a single view.
        """
        return self._matcher.candidates(scan, earlier)

    def localise_globally(self, scan: Scan, earlier: Views = ()) -> GlobalMatch:
        """Restart at the only pose on the map that explains the scans.

        Args:
            scan: the newest scan.
            earlier: as for `match_globally`.

        Raises:
            NavigationError: LOST if no pose fits, AMBIGUOUS if several do. The particles do not
                change then.
        """
        candidates = self.match_globally(scan, earlier)
        best = decide(candidates, self._fit_scale(scan).low, self.parameters.ambiguity_ratio)
        self.set_pose(best.pose, 0.1, 0.05)
        return best

    @property
    def _pose(self) -> Pose2D:
        return self._map_from_odom.compose(self._odometry or self._reference)

    @property
    def _moved(self) -> Pose2D:
        return (self._odometry or self._reference).relative_to(self._reference)

    def _fit_scale(self, scan: Scan) -> FitScale:
        """Return the fit scale of this map; calibrated at the first scan, which shows the lidar."""
        if self._scale is None:
            self._scale = calibrate(
                self._evaluator, self._field, scan, self.parameters, self._calibration
            )
        return self._scale

    def _reset(self, particle_set: ParticleSet) -> None:
        self._particle_set = particle_set
        self._reference = self._odometry or Pose2D(0.0, 0.0)
        self._still_scans = 0
        self._scattered = False
        self._jumps += 1
        self._corrected_at = self._time
        self._fits.clear()
        self._fit = None
        self._update_estimate()

    def _is_settled(self) -> bool:
        position = float(np.sqrt(max(0.0, np.linalg.eigvalsh(self._covariance[:2, :2])[-1])))
        heading = float(np.sqrt(self._covariance[2, 2]))
        limit = self.parameters.settled_deviation
        return position < limit and heading < limit * _HEADING_OF_METRE

    def _is_update_due(self) -> bool:
        moved = self._moved
        if (
            moved.distance_to(Pose2D(0.0, 0.0)) >= self.parameters.update_distance
            or abs(moved.heading) >= self.parameters.update_angle
        ):
            self._still_scans = 0
            return True
        self._still_scans += 1
        if self._still_scans <= 1:
            return True
        return self._still_scans <= _STILL_UPDATES and not self._is_settled()

    def _is_kidnapped(self, scan: Scan) -> bool:
        """Return whether the filter is settled on a pose that the last scan does not fit at all.

        Scans from elsewhere must not pull the particles to a pose with a slightly better fit.
        """
        limit = _NO_FIT * self._fit_scale(scan).low
        return self._fit is not None and self._fit < limit and self._is_settled()

    def _predict_only(self) -> None:
        """Follow odometry only; the particles spread until measurement updates resume."""
        self._move()
        _, self._covariance = summarise(self._particle_set)

    def _move(self) -> None:
        poses = self._noise.sample(self._particle_set.poses, self._moved, self._generator)
        self._particle_set = ParticleSet(poses, self._particle_set.weights)
        self._reference = self._odometry or self._reference

    def _measurement_update(self, scan: Scan) -> None:
        """Run one filter step: predict, weight by the scan, estimate, resample."""
        settled = self._is_settled()
        points = self._evidence(scan, settled)
        self._move()
        scores = self._kernels.score_poses(
            self._table, self._field.occupancy, *self._field.placement, self._particle_set.poses,
            points, self._least,
        )  # fmt: skip
        logs = np.log(self._particle_set.weights) + self.parameters.trust * scores
        weights = np.exp(logs - logs.max())
        self._particle_set = ParticleSet(self._particle_set.poses, weights / weights.sum())
        self._update_estimate()
        if self._is_settled():
            self._refine(points)
        self._resample()

    def _seed(self, scan: Scan) -> None:
        """Sample scattered particles again, from the poses that explain this scan.

        Particles uniform over a building would be too far apart to include the robot's pose. Dual
        sampling as in S. Thrun et al., "Robust Monte Carlo Localization for Mobile Robots",
        Artificial Intelligence 128, 2001.
        """
        points = scan_points(scan, self._matcher.beams)
        if self._matcher.size == 0 or points.shape[0] == 0:
            return
        scores = self._matcher.scores(points).astype(np.float64)
        weights = np.exp(0.5 * self.parameters.trust * (scores - scores.max()))
        limit = self.parameters.max_particles
        draw = self._kernels.resample(weights / weights.sum(), limit, self._generator.random())
        spacing = SEED_SPACING
        within = np.array([spacing, spacing, 2.0 * pi / HEADINGS]) / 2.0
        poses = self._matcher.poses(draw) + self._generator.uniform(-within, within, (limit, 3))
        self._reset(ParticleSet.uniform(poses))

    def _evidence(self, scan: Scan, settled: bool) -> FloatArray:
        """Return (m, 2) end points, base frame, of the beams of a measurement update.

        If the pose is settled, beams shortened by an unmapped obstacle are left out.
        """
        beams = returned_beams(scan, self.parameters.beams)
        if settled and beams.size:
            kinds = self._evaluator.classify(self._pose, scan, beams)
            explained = beams[kinds != self._kernels.SHORT]
            if explained.size >= beams.size // 2:
                beams = explained
        return beam_points(scan, beams)

    def _update_estimate(self) -> None:
        pose, self._covariance = summarise(self._particle_set)
        self._map_from_odom = pose.compose(self._reference.inverse())

    def _refine(self, points: FloatArray) -> None:
        """Align the scan to the map, with the mean and covariance of the particles as prior."""
        spread_out = self._covariance + np.diag([1e-6, 1e-6, 1e-6])
        information = _POINT_VARIANCE * np.asarray(np.linalg.inv(spread_out), dtype=np.float64)
        start = as_row(self._pose)
        refined = self._kernels.refine_pose(
            self._field.distances, *self._field.placement, start, information, points, 0.1
        )
        aligned = as_pose(refined)
        if aligned.distance_to(self._pose) < self.parameters.settled_deviation:
            self._map_from_odom = aligned.compose(self._reference.inverse())

    def _resample(self) -> None:
        weights = self._particle_set.weights
        if 1.0 / float(weights @ weights) > 0.5 * weights.size:
            return
        limit = self.parameters.max_particles
        draw = self._kernels.resample(weights, limit, self._generator.random())
        count = self._particle_count(self._particle_set.poses[draw])
        chosen = self._kernels.resample(weights, count, self._generator.random())
        self._particle_set = ParticleSet.uniform(self._particle_set.poses[chosen])

    def _particle_count(self, poses: FloatArray) -> int:
        p = self.parameters
        wanted = max(kld_bound(poses, p.kld_error, p.kld_quantile), p.min_particles)
        return min(wanted, int(poses.shape[0]))
