"""Monte-Carlo localisation: the robot's pose on a known map by a particle filter.

Unlike AMCL, the filter injects no random particles. Places that explain the scans equally well are
hypotheses, each with particles of its own (particle_filter/hypotheses.py). After a push or a
kidnap the pose follows odometry, its health drops, and searches of the map find the new pose
(recovery.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stack.compilation import KernelTypes
from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.frames.buffer import TransformBuffer
from stack.localisation.health import ScanView
from stack.localisation.health_model import HealthFeatures, health
from stack.localisation.known_map import UNTESTED_HEALTH, KnownMap
from stack.localisation.mcl.confidence import Confidence
from stack.localisation.mcl.pose_search import PoseSearch, prior_of
from stack.localisation.mcl.recovery import RecoverySchedule
from stack.localisation.mcl.touch import TouchSense, pushed
from stack.localisation.mcl.trusted_pose import TrustedPose
from stack.localisation.parameters import LocaliserParameters, check_lidar
from stack.localisation.particle_filter.filter import ParticleFilter
from stack.localisation.particle_filter.hypotheses import Hypothesis
from stack.localisation.particle_filter.marker_update import MarkerUpdate
from stack.localisation.particle_filter.odometry_since import OdometrySince
from stack.localisation.particle_filter.particles import move
from stack.localisation.search.evaluation import RIVAL_ANGLE, RIVAL_DISTANCE
from stack.localisation.search.matches import GlobalMatch, Views
from stack.localisation.view_planner import CLEARANCE, ViewPlanner
from stack.streams import stream
from stack.types import (
    FloatArray,
    HealthThresholds,
    MarkerFix,
    Observation,
    OccupancyGrid,
    Pose2D,
    PoseEstimate,
    Scan,
    View,
)

CELL_DEVIATION = 0.35
"""Standard deviation of the position by errors that all beams share, in cells of the map; a wall is
anywhere within its cell: 0.29."""

_NO_FIT = 0.5
"""Share of the 5th percentile of fits at true poses below which the robot is not near a pose."""

_MATCH_DEVIATION = 0.05
"""Metres; standard deviation of a pose that is compared with a scan."""

_USUAL = 0.25
"""Place of a fit between the 5th percentile (0) and the median (1) at true poses, which another
place needs in a scan to take over from a trusted pose without a disturbance of odometry."""


class Localiser(Estimator):
    """Monte-Carlo localisation: a particle filter on the map with the scans of one lidar.

    It follows the pose on a likelihood field. Its health shows a wrong pose.
    """

    Parameters = LocaliserParameters
    needs = ("lidar",)
    needs_map = True
    uses_markers = True
    parameters: LocaliserParameters

    @staticmethod
    def kernels(parameters: LocaliserParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of the filter and of the search."""
        from stack.geometry.travel.kernels import TRAVEL
        from stack.localisation import kernels
        from stack.localisation.search.kernels import SEARCH

        return (*kernels.LOCALISATION, *SEARCH, *TRAVEL)

    def __init__(
        self,
        parameters: LocaliserParameters,
        robot: RobotDescription,
        grid: OccupancyGrid,
        seed: int,
    ) -> None:
        super().__init__(parameters, robot, grid, seed)
        self._robot = robot
        self._generator = stream(seed, "localisation")
        self._calibration = stream(seed, "localisation calibration")
        self._recovery = RecoverySchedule()
        self._confidence, self._trusted = Confidence(), TrustedPose()
        self.lidar = parameters.lidar or robot.main_lidar
        self._read(grid)
        self._odometry = OdometrySince()
        self._travelled = 0.0
        self._time = self._corrected_at = 0.0
        self.scatter()

    def _read(self, grid: OccupancyGrid) -> None:
        """Derive what depends on the map and the lidar."""
        self._grid = grid
        noise = self._robot.range_noise(self.lidar)
        self.map = KnownMap(grid, noise, self.parameters.health_obstacles, self._calibration)
        self._filter = ParticleFilter(self.map, self._robot, self.parameters, self._generator)
        self._touch = TouchSense(self._robot.footprint, self.map.evaluator)
        self._markers = MarkerUpdate(self.map.field, self._filter)
        self._pose_search = PoseSearch(self.map, self._filter)
        variance = (CELL_DEVIATION * self.map.field.resolution) ** 2
        self._common_errors = np.diag([variance, variance, 0.0])
        self._estimate: PoseEstimate | None = None

    def load_map(self, grid: OccupancyGrid, folder: Path, pose: Pose2D | None) -> None:
        """Use another map from now on; see `Estimator`."""
        self._read(grid)
        self.start(pose)

    @staticmethod
    def check(parameters: LocaliserParameters, robot: RobotDescription) -> None:
        """Check that the robot has the lidar."""
        check_lidar(parameters.lidar, robot)

    def configure(self, parameters: LocaliserParameters) -> None:
        """Apply new parameters; the particles stay.

        Raises:
            InputError: the robot has no such lidar.
        """
        self.check(parameters, self._robot)
        p = self.parameters = parameters
        self.map.expect(p.health_obstacles)
        lidar = p.lidar or self._robot.main_lidar
        if lidar != self.lidar:
            self.lidar, followed = lidar, list(self._filter.hypotheses)
            self._read(self._grid)
            self._filter.hypotheses.replace(followed)
        self._filter.configure(p)
        self._estimate = None

    def start(self, pose: Pose2D | None) -> None:
        """Start around the initial pose; if that is unknown, anywhere on the map."""
        p = self.parameters
        if pose is None:
            self.scatter()
            return
        self.set_pose(pose, p.initial_position_deviation, p.initial_heading_deviation)

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Restart around a pose in the map frame; standard deviations in metres and radians."""
        variances = np.square([position_deviation, position_deviation, heading_deviation])
        self._restart([self._filter.around(pose, np.diag(variances))], confirmed=True)
        self._trusted.forget()

    def scatter(self) -> None:
        """Restart with particles uniform over the free space."""
        self._filter.scatter()
        self._restart(list(self._filter.hypotheses))
        self._trusted.forget()
        self._scattered, self._estimate = True, None

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Process odometry, and a new scan at the pose of its own stamp."""
        self._time = observation.time
        scan = observation.named(self.lidar, Scan)
        if scan is not None:
            covariance, disturbed = self._odometry.stated_errors(frames, scan.stamp)
            self.process(frames.pose_at("odom", scan.stamp), scan, covariance, disturbed=disturbed)
            self._corrected_at = scan.stamp
        self.process(frames.pose_at("odom", observation.time))
        return self.estimate

    def update_markers(self, fix: MarkerFix, frames: TransformBuffer) -> PoseEstimate:
        """Weight the particles by the markers in a picture, at the pose of its own stamp."""
        newest = self._odometry.pose
        if newest is None or not frames.covers(fix.stamp):
            return self.estimate
        reference = newest if self._scattered else self._odometry.reference
        since = reference.relative_to(frames.pose_at("odom", fix.stamp))
        likelihood = self._markers.likelihood(fix, since, self._odometry.stated.covariance)
        self._estimate = None
        if self._scattered:
            self._restart(self._markers.hypotheses_of(likelihood))
        elif self._markers.apply(likelihood):
            self._jumped(confirmed=False)
        self._corrected_at = max(self._corrected_at, fix.stamp)
        return self.estimate

    def process(
        self,
        odometry: Pose2D,
        scan: Scan | None = None,
        covariance: FloatArray | None = None,
        *,
        disturbed: bool = False,
    ) -> None:
        """Update the estimate with odometry and an optional scan taken at that pose.

        Args:
            odometry: pose in the odom frame.
            scan: a new scan, or None. Every scan updates the health. It weights the particles only
                if the robot has moved since the last measurement update, or once at standstill
                (twice while the pose is uncertain).
            covariance: (3, 3) of the motion since the last scan, in the base frame there, as
                odometry states it.
            disturbed: whether odometry was disturbed since the last scan (a push or slip).
        """
        last, begins = self._estimate, self._odometry.pose is None
        self._odometry.add(odometry)
        self._estimate = None
        if scan is None:
            if last is not None and not last.rivals and not begins:
                self._estimate = last.moved_to(self._pose)
            return
        again = self._trusted.is_touched
        touched = not self._scattered and self._touch.touches(scan, self._pose, again=again)
        self._follow(scan, covariance, disturbed=disturbed, touched=touched)
        if self._scattered:
            self._start_anywhere(scan)
        elif self._odometry.is_update_due(settled=self._filter.hypotheses.best.is_settled):
            self._measurement_update(scan)
        view = self.map.evaluator.view(self._pose, scan)
        if len(self._filter.hypotheses) > 1:
            view = self._compare_hypotheses(scan, view)
        view = self._search(scan, view, odometry)
        scale, alone = self.map.scale_for(scan), len(self._filter.hypotheses) == 1
        self._confidence.add(scan.stamp, view, scale, self._travelled, alone=alone)
        if self._confidence.needs_verification(view, scale, alone=alone):
            self._recovery.verify(scan.stamp)
        settled = not self._recovery.is_disturbed(scan.stamp)
        if settled and self._confidence.trusts(view, scale, alone=alone):
            self._trusted.trust(self._pose, odometry)
        else:
            self._trusted.follow(self._pose, odometry)

    def _search(self, scan: Scan, view: ScanView, odometry: Pose2D) -> ScanView:
        """Run a search that is due; return the view of the estimate after it."""
        recovery = self._recovery
        low = self.map.scale_for(scan).low
        search = recovery.next(scan.stamp, view, low) if self.parameters.recover else None
        if search is None:
            return view
        prior = prior_of(
            view, confirmed=self._confidence.is_confirmed,
            disturbed=recovery.is_disturbed(scan.stamp), touched=recovery.is_touched(scan.stamp),
        )  # fmt: skip
        if self._pose_search.run(search, scan, view, self._moved, odometry, prior, self._trusted):
            recovery.verify(scan.stamp)
        return self.map.evaluator.view(self._pose, scan)

    @property
    def estimate(self) -> PoseEstimate:
        """The pose, propagated by odometry since the last scan, with covariance and health.

        Until the first scan after a start the health raises no alarm; if scattered, it is 0.
        """
        if self._estimate is None:
            self._estimate = self._summary()
        return self._estimate

    def _summary(self) -> PoseEstimate:
        """Return the estimate as of now."""
        p, features, hypotheses = self.parameters, self.health_features, self._filter.hypotheses
        if features is None:
            right = 0.0 if self._scattered else UNTESTED_HEALTH
        else:
            right = health(features)
        return PoseEstimate(
            self._pose, hypotheses.covariance() + self._common_errors, right,
            self.map_from_odom, self._corrected_at, rivals=hypotheses.rivals(self._moved),
            thresholds=HealthThresholds(p.lost_health, p.good_health),
            obscured=self._confidence.is_obscured,
        )  # fmt: skip

    @property
    def health_features(self) -> HealthFeatures | None:
        """What the health follows from; None before the first scan after a restart."""
        return self._confidence.features(self._filter.hypotheses, self.map.scale)

    @property
    def map_from_odom(self) -> Pose2D:
        """The odom frame's pose in the map frame."""
        return self._filter.hypotheses.best.pose.compose(self._odometry.reference.inverse())

    @property
    def particles(self) -> FloatArray:
        """(n, 3) x, y, heading of the particles in the map frame, propagated by odometry."""
        return move(self._filter.particles, self._moved)

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose, map frame."""
        return self.map.fit_at(pose, scan, _MATCH_DEVIATION)

    def localise_globally(self, scan: Scan, earlier: Views = ()) -> GlobalMatch:
        """Restart at the best pose on the map that explains the scans, with its rivals.

        Args:
            scan: the newest scan.
            earlier: as for `MapSearch.everywhere`.

        Raises:
            NavigationError: LOST if no pose fits. The particles do not change then.
        """
        odometry = self._odometry.pose or self._odometry.reference
        best, hypotheses = self._pose_search.resolved(scan, earlier, odometry, self._trusted)
        self._restart(hypotheses)
        return best

    def best_view(self, scan: Scan, avoided: Sequence[Pose2D] = ()) -> View | None:
        """Return the view that best tells the estimate from its rivals; None without one."""
        estimate = self.estimate
        if not estimate.ambiguous:
            return None
        clearance = self._robot.footprint.inscribed_radius + CLEARANCE
        planner = ViewPlanner(self.map.field, clearance)
        shares = [rival.share for rival in estimate.rivals]
        poses = [estimate.pose, *(rival.pose for rival in estimate.rivals)]
        return planner.best_view(poses, [1.0 - sum(shares), *shares], scan, avoided)

    def _start_anywhere(self, scan: Scan) -> None:
        """Search the whole map at an unknown start; if nothing fits well, follow all places."""
        try:
            self.localise_globally(scan)
        except NavigationError:
            if hypotheses := self._pose_search.anywhere(scan):
                self._restart(hypotheses)
                self._filter.hypotheses.tidy()

    @property
    def _pose(self) -> Pose2D:
        return self._filter.hypotheses.best.pose.compose(self._moved)

    @property
    def _moved(self) -> Pose2D:
        return self._odometry.moved

    def _restart(self, hypotheses: Sequence[Hypothesis], *, confirmed: bool = False) -> None:
        """Restart with hypotheses at the newest odometry."""
        self._filter.hypotheses.replace(hypotheses)
        self._estimate = None
        self._odometry.restart()
        self._scattered = False
        self._jumped(confirmed=confirmed)
        self._recovery.reset()

    def _jumped(self, *, confirmed: bool) -> None:
        """Note a discontinuity of the pose; scans before say nothing of the new one."""
        self._corrected_at = self._time
        self._confidence.restart(confirmed=confirmed)

    def _follow(
        self, scan: Scan, covariance: FloatArray | None, *, disturbed: bool, touched: bool
    ) -> None:
        """Process the motion since the last scan."""
        if touched:
            covariance = pushed(self._odometry.seconds_to(scan.stamp), covariance)
        distance, turn = self._odometry.add_scan(scan.stamp, covariance, disturbed=disturbed)
        self._travelled = distance + 0.5 * turn
        self._trusted.drive(distance, pushed=disturbed, touched=touched)
        self._filter.hypotheses.travel(distance / RIVAL_DISTANCE + turn / RIVAL_ANGLE)
        if disturbed:
            self._recovery.disturb(scan.stamp)
        if touched:
            self._recovery.touch(scan.stamp)
            self._odometry.doubt_standstill()

    def _measurement_update(self, scan: Scan) -> None:
        """Run one filter step: predict, then weight each hypothesis that the scan fits."""
        lost = _NO_FIT * self.map.scale_for(scan).low
        self._filter.predict(self._odometry.take())
        for hypothesis in self._filter.hypotheses:
            # Scans from elsewhere must not pull it to a pose with a slightly better fit.
            last = self._confidence.views.newest
            fit = last.fit if last and hypothesis is self._filter.hypotheses.best else None
            if fit is not None and fit < lost and hypothesis.is_settled:
                hypothesis.spread()
            else:
                self._filter.measure(hypothesis, scan)

    def _compare_hypotheses(self, scan: Scan, view: ScanView) -> ScanView:
        """Add the evidence of a scan to the hypotheses; return the view of the estimate."""
        hypotheses, moved = self._filter.hypotheses, self._moved
        others = [
            self.map.evaluator.view(hypothesis.pose.compose(moved), scan)
            for hypothesis in hypotheses.others
        ]
        hypotheses.weigh([view.cost, *(o.cost for o in others)])
        if self._confidence.is_confirmed and not self._recovery.is_disturbed(scan.stamp):
            scale = self.map.scale_for(scan)
            least = scale.low + _USUAL * (scale.middle - scale.low)
            hypotheses.hold_back([other.fit >= least for other in others])
        views = dict(zip(map(id, hypotheses), [view, *others], strict=True))
        if hypotheses.tidy():
            self._jumped(confirmed=False)
        return views[id(hypotheses.best)]
