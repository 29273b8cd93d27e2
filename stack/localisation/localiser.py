"""Monte-Carlo localisation: where the robot is on a known map, as a cloud of weighted poses.

S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, chapters 5, 6.4 and 8.3; the number of
particles follows D. Fox, "Adapting the Sample Size in Particle Filters Through KLD-Sampling",
IJRR 22(12), 2003. Unlike AMCL there is no random injection: a filter that was carried off stays
where it is, says so by its health, and leaves finding the place to the global search.
"""

from __future__ import annotations

from math import pi

import numpy as np

from stack.localisation.distance_field import as_pose, as_row, surface_field
from stack.localisation.global_match import (
    HEADINGS,
    LATTICE_BEAMS,
    SPACING,
    GlobalMatch,
    GlobalMatcher,
    Views,
    beam_points,
    decide,
    returned_beams,
    scan_points,
)
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
from stack.streams import stream
from stack.types import FloatArray, OccupancyGrid, Pose2D, PoseEstimate, Scan

_HEADING_OF_METRE = 0.6
"""Radians that count as a metre where one figure must say how spread out a cloud is."""

_POINT_VARIANCE = 0.05**2
"""m² of a return about the map's surface, for aligning a scan; its beams are not independent."""

_HOPELESS = 0.5
"""Share of the fit at health 0.3 below which a scan tells nothing about a pose near by."""

_STILL_UPDATES = 2
"""Scans weighed without moving while unsure: the same view again is hardly new evidence."""


class Localiser:
    """A particle filter on a likelihood field, with a health that tells when it is wrong.

    Begins scattered over the free space; `start` or `scatter` say otherwise.

    Args:
        grid: the map.
        parameters: of the filter.
        seed: of its random streams.
        sideways: whether the robot can go any way without turning first.
    """

    def __init__(
        self, grid: OccupancyGrid, parameters: LocaliserParameters, seed: int, *,
        sideways: bool = False,
    ) -> None:  # fmt: skip
        from stack.localisation import kernels

        self.parameters = parameters
        self._kernels = kernels
        self._generator = stream(seed, "localisation")
        self._calibration = stream(seed, "localisation calibration")
        self._field = surface_field(grid)
        self._table = self._field.log_likelihoods(parameters.hit_deviation, parameters.hit_share)
        self._evaluator = ScanEvaluator(self._field)
        self._matcher = GlobalMatcher(self._field, self._evaluator)
        self._scale: FitScale | None = None
        self._fits = RecentMedian(parameters.health_window)
        p = parameters
        alphas = p.alpha_1, p.alpha_2, p.alpha_3, p.alpha_4
        self._noise = OmniMotionNoise(*alphas, p.alpha_5) if sideways else MotionNoise(*alphas)
        self._odometry: Pose2D | None = None
        self._fit: float | None = None
        self.scatter()

    def start(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Be around a pose of the map frame; standard deviations in metres and radians."""
        deviations = [position_deviation, position_deviation, heading_deviation]
        poses = self._generator.normal(as_row(pose), deviations, (self.parameters.max_particles, 3))
        self._begin(ParticleSet.uniform(poses[: self._enough(poses)]))
        self._map_from_odom = pose.compose(self._reference.inverse())

    def scatter(self) -> None:
        """Be anywhere: particles uniform over the free space."""
        cells = self._field.free_cells(0.0)
        count = self.parameters.max_particles
        poses = self._generator.uniform(-pi, pi, (count, 3))
        if cells.shape[0]:
            shift = self._generator.uniform(-0.5, 0.5, (count, 2)) * self._field.resolution
            chosen = cells[self._generator.integers(0, cells.shape[0], count)]
            poses[:, :2] = self._field.centres(chosen) + shift
        self._begin(ParticleSet.uniform(poses))
        self._scattered = True

    def update(self, odometry: Pose2D, scan: Scan | None) -> None:
        """Take in the newest dead reckoning and, when there is one, a scan taken there.

        Args:
            odometry: pose in the odom frame.
            scan: a new scan, or None. Each is judged; it weighs the particles only when the robot
                has moved since the last that did, or while the pose is not yet known.
        """
        if self._odometry is None:
            self._reference = odometry
            self._map_from_odom = self._map_from_odom.compose(odometry.inverse())
        self._odometry = odometry
        if scan is None:
            return
        if self._scattered:
            self._seed(scan)
        elif self._due():
            self._drift() if self._carried_off(scan) else self._weigh(scan)
        self._fit = self._evaluator.fit(self._pose, scan)
        self._fits.add(scan.stamp, self._fit)
        self._scaled(scan)

    @property
    def estimate(self) -> PoseEstimate:
        """The best pose, carried on by odometry since the last scan, its spread and health.

        Until the first scan after a start its pose is believed (health 0.8, that of an ordinary
        true pose), so that starting raises no alarm; scattered particles have health 0.
        """
        fit = self._fits.value
        if fit is None or self._scale is None:
            return PoseEstimate(self._pose, self._covariance, 0.0 if self._scattered else 0.8)
        return PoseEstimate(self._pose, self._covariance, self._scale.health(fit))

    @property
    def map_from_odom(self) -> Pose2D:
        """The odom frame's pose in the map frame."""
        return self._map_from_odom

    @property
    def particles(self) -> FloatArray:
        """(n, 3) x, y, heading of the cloud in the map frame, carried on by odometry."""
        return move(self._cloud.poses, self._moved)

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """The health in [0, 1] that this one scan has at another pose."""
        return self._scaled(scan).health(self._evaluator.fit(pose, scan))

    def match_globally(self, scan: Scan, earlier: Views = ()) -> list[GlobalMatch]:
        """Distinct poses anywhere on the map that explain the scans, best first.

        Args:
            scan: the newest.
            earlier: scans from before, each with the base's pose when it was taken, given in the
                base's frame of now (from odometry). They settle what one view leaves open.
        """
        return self._matcher.candidates(scan, earlier)

    def relocalise_globally(self, scan: Scan, earlier: Views = ()) -> GlobalMatch:
        """Start anew at the one place on the map that explains the scans.

        Args:
            scan: the newest.
            earlier: as for `match_globally`.

        Raises:
            NavigationError: LOST when no place fits, AMBIGUOUS when several do. The cloud is left
                as it was.
        """
        candidates = self.match_globally(scan, earlier)
        best = decide(candidates, self._scaled(scan).low, self.parameters.ambiguity_ratio)
        self.start(best.pose, 0.1, 0.05)
        return best

    @property
    def _pose(self) -> Pose2D:
        return self._map_from_odom.compose(self._odometry or self._reference)

    @property
    def _moved(self) -> Pose2D:
        return (self._odometry or self._reference).relative_to(self._reference)

    def _scaled(self, scan: Scan) -> FitScale:
        """What fits are worth on this map, measured once a scan has shown what the lidar is."""
        if self._scale is None:
            noise = self.parameters.range_noise
            self._scale = calibrate(self._evaluator, self._field, scan, noise, self._calibration)
        return self._scale

    def _begin(self, cloud: ParticleSet) -> None:
        self._cloud = cloud
        self._reference = self._odometry or Pose2D(0.0, 0.0)
        self._stills = 0
        self._scattered = False
        self._fits.clear()
        self._fit = None
        self._conclude()

    def _settled(self) -> bool:
        position = float(np.sqrt(max(0.0, np.linalg.eigvalsh(self._covariance[:2, :2])[-1])))
        heading = float(np.sqrt(self._covariance[2, 2]))
        limit = self.parameters.settled_deviation
        return position < limit and heading < limit * _HEADING_OF_METRE

    def _due(self) -> bool:
        moved = self._moved
        if (
            moved.distance_to(Pose2D(0.0, 0.0)) >= self.parameters.update_distance
            or abs(moved.heading) >= self.parameters.update_angle
        ):
            self._stills = 0
            return True
        self._stills += 1
        return self._stills <= 1 or (self._stills <= _STILL_UPDATES and not self._settled())

    def _carried_off(self, scan: Scan) -> bool:
        """Whether it was sure of a pose where the last scan did not fit at all.

        Scans from elsewhere must not drag the cloud to where they happen to fit a little.
        """
        hopeless = _HOPELESS * self._scaled(scan).low
        return self._fit is not None and self._fit < hopeless and self._settled()

    def _drift(self) -> None:
        """Follow odometry alone; the cloud grows until it is unsure and weighs again."""
        self._move()
        _, self._covariance = summarise(self._cloud)

    def _move(self) -> None:
        poses = self._noise.sample(self._cloud.poses, self._moved, self._generator)
        self._cloud = ParticleSet(poses, self._cloud.weights)
        self._reference = self._odometry or self._reference

    def _weigh(self, scan: Scan) -> None:
        """One round of the filter: move, weigh by the scan, conclude, resample."""
        settled = self._settled()
        points = self._evidence(scan, settled)
        self._move()
        scores = self._kernels.score_poses(
            self._table, self._field.occupancy, *self._field.placement, self._cloud.poses, points,
            float(self._table.min()),
        )  # fmt: skip
        logs = np.log(self._cloud.weights) + self.parameters.trust * scores
        weights = np.exp(logs - logs.max())
        self._cloud = ParticleSet(self._cloud.poses, weights / weights.sum())
        self._conclude()
        if self._settled():
            self._refine(points)
        self._resample()

    def _seed(self, scan: Scan) -> None:
        """Draw a scattered cloud anew, from where this scan could have been taken.

        Particles scattered over a whole building would be too far apart to have one at the robot:
        dual sampling as in S. Thrun et al., "Robust Monte Carlo Localization for Mobile Robots",
        Artificial Intelligence 128, 2001.
        """
        points = scan_points(scan, LATTICE_BEAMS)
        if self._matcher.size == 0 or points.shape[0] == 0:
            return
        scores = self._matcher.scores(points).astype(np.float64)
        weights = np.exp(0.5 * self.parameters.trust * (scores - scores.max()))
        limit = self.parameters.max_particles
        draw = self._kernels.resample(weights / weights.sum(), limit, self._generator.random())
        within = np.array([SPACING, SPACING, 2.0 * pi / HEADINGS]) / 2.0
        poses = self._matcher.poses(draw) + self._generator.uniform(-within, within, (limit, 3))
        self._begin(ParticleSet.uniform(poses))

    def _evidence(self, scan: Scan, settled: bool) -> FloatArray:
        """(m, 2) end points, base frame, of beams to weigh by.

        Once the pose is known, beams that something unmapped has cut short are left out.
        """
        beams = returned_beams(scan, self.parameters.beams)
        if settled and beams.size:
            kinds = self._evaluator.evaluator(self._pose, scan, beams)
            explained = beams[kinds != self._kernels.SHORT]
            if explained.size >= beams.size // 2:
                beams = explained
        return beam_points(scan, beams)

    def _conclude(self) -> None:
        pose, self._covariance = summarise(self._cloud)
        self._map_from_odom = pose.compose(self._reference.inverse())

    def _refine(self, points: FloatArray) -> None:
        """Align the scan itself to the map, the cloud's mean and covariance being the prior."""
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
        weights = self._cloud.weights
        if 1.0 / float(weights @ weights) > 0.5 * weights.size:
            return
        limit = self.parameters.max_particles
        draw = self._kernels.resample(weights, limit, self._generator.random())
        count = self._enough(self._cloud.poses[draw])
        chosen = self._kernels.resample(weights, count, self._generator.random())
        self._cloud = ParticleSet.uniform(self._cloud.poses[chosen])

    def _enough(self, poses: FloatArray) -> int:
        wanted = max(kld_bound(poses), self.parameters.min_particles)
        return min(wanted, int(poses.shape[0]))
