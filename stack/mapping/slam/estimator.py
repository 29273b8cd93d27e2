"""SLAM as an estimator: maps while it localises, or localises in a saved pose graph."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from stack.compilation import KernelTypes
from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, NavigationError, WorkerError
from stack.frames.buffer import TransformBuffer
from stack.localisation.parameters import check_lidar
from stack.localisation.search.matches import GlobalMatch, Views
from stack.localisation.view_planner import CLEARANCE
from stack.mapping.slam.consistency import MapConsistency
from stack.mapping.slam.global_localisation import GlobalLocalisation
from stack.mapping.slam.landmarks import markers_of, problem_of
from stack.mapping.slam.odometry.error import odometry_covariance
from stack.mapping.slam.parameters import SlamParameters
from stack.optional_packages import GTSAM
from stack.types import (
    FloatArray,
    HealthThresholds,
    Marker,
    MarkerObservation,
    Observation,
    OccupancyGrid,
    Pose2D,
    PoseEstimate,
    RivalPose,
    Scan,
    View,
)

KEYFRAMES_PER_STEP = 5
"""Keyframes drawn again in a control step after a loop closure."""
SEARCH_PERIOD = 5.0
"""Time between two searches of the whole map while the robot is lost on a saved map, s."""

MAP_PERIOD = 1.0
"""Time between two updates of the costmap's map, s."""


class SlamEstimator(Estimator):
    """SLAM: scan matching, loop closure and a pose graph; the map grows with the drive.

    A loop closure moves the map and the robot in it: the estimate jumps. The graph is optimised
    beside the loop and applied `latency` seconds later. On a saved map the graph is continued.
    """

    Parameters = SlamParameters
    packages = (GTSAM,)
    needs = ("lidar",)
    loads_saved_maps = True
    maps_markers = True
    starts_mapping: ClassVar[bool] = True
    parameters: SlamParameters

    @staticmethod
    def kernels(parameters: SlamParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of scan matching, map rendering and global localisation."""
        from stack.geometry.travel.kernels import TRAVEL
        from stack.localisation import kernels
        from stack.localisation.search import kernels as search
        from stack.mapping.slam import kernels as paths
        from stack.mapping.slam.matching import kernels as matching
        from stack.mapping.slam.rendering import kernels as rendering

        return (
            *matching.ENTRY_POINTS, *paths.ENTRY_POINTS, *rendering.ENTRY_POINTS,
            *kernels.LOCALISATION, *search.SEARCH, *TRAVEL,
        )  # fmt: skip

    @staticmethod
    def check(parameters: SlamParameters, robot: RobotDescription) -> None:
        """Check that the robot has the lidar."""
        check_lidar(parameters.lidar, robot)

    @classmethod
    def check_map(cls, folder: Path | None) -> None:
        """Check that a saved map has a pose graph."""
        from stack.mapping.graph_files import check_graph

        if folder is not None:
            check_graph(folder)

    def __init__(
        self, parameters: SlamParameters, robot: RobotDescription, grid: OccupancyGrid | None,
        seed: int,
    ) -> None:  # fmt: skip
        from stack.mapping.slam.mapper import Mapper
        from stack.mapping.slam.worker import OptimiserWorker

        super().__init__(parameters, robot, grid, seed)
        self.lidar = parameters.lidar or robot.main_lidar
        self._noise = robot.range_noise(self.lidar)
        self._clearance, self._seed = robot.footprint.inscribed_radius + CLEARANCE, seed
        self.mapper = Mapper(parameters, noise=self._noise, immediate=False)
        self._wants_mapping = self.starts_mapping
        self._on_map: tuple[OccupancyGrid, GlobalLocalisation] | None = None
        self._is_located, self._search_due = True, 0.0
        self._worker = OptimiserWorker()
        self._map_from_odom, self._odometry = Pose2D(0.0, 0.0), Pose2D(0.0, 0.0)
        self._matched = Pose2D(0.0, 0.0)
        self._covariance: FloatArray = np.diag([1e-4, 1e-4, 1e-4])
        self._consistency, self._notes = MapConsistency(), list[str]()
        self._health, self._scans = 1.0, 0
        self._time = self._corrected_at = self._scanned_at = 0.0
        self._is_started, self._is_real_time = False, False
        self._taken, self._map_due = self.mapper.shown_grid, 0.0
        self._shows_map = grid is None

    def start(self, pose: Pose2D | None) -> None:
        """Begin the map at the initial pose; at the map's origin if that is unknown."""
        if pose is not None:
            self._map_from_odom = pose
            self.mapper.start(pose)

    def load_map(self, grid: OccupancyGrid, folder: Path, pose: Pose2D | None) -> None:
        """Continue a saved pose graph, or localise in it; at an unknown pose, search it.

        Raises:
            InputError: the folder has no pose graph, or a damaged one.
        """
        from stack.mapping.graph_files import read_graph
        from stack.mapping.slam.mapper import Mapper
        from stack.mapping.slam.worker import OptimiserWorker

        self.check_map(folder)
        graph = read_graph(folder)
        if not graph.keyframes:
            raise InputError(f"{folder}: the pose graph has no keyframes; map again")
        self.mapper = Mapper(self.parameters, graph, noise=self._noise, immediate=False)
        self._worker.close()
        self._worker = OptimiserWorker(waits=not self._is_real_time)
        self._shows_map, self._taken, self._on_map = True, self.mapper.shown_grid, None
        if pose is None:
            self._is_located, self._health, self._search_due = False, 0.0, 0.0
            self._apply_mode()
        else:
            self.set_pose(pose, 0.1, 0.05)
            self._search_due = self._time + SEARCH_PERIOD

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to change the map."""
        self._wants_mapping = is_mapping
        self._apply_mode()

    @property
    def is_mapping(self) -> bool:
        """Whether keyframes are added: not while the place in a map is unknown or ambiguous."""
        return self._wants_mapping and self._is_located and not self._rivals

    @property
    def _rivals(self) -> tuple[RivalPose, ...]:
        return self._on_map[1].rivals if self._on_map is not None else ()

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Match a new scan, apply a finished optimisation, draw a piece of the map."""
        self._time = observation.time
        self._odometry = frames.pose_at("odom", observation.time)
        if not self._is_started:
            start = self._map_from_odom
            self._map_from_odom = start.compose(self._odometry.inverse())
            if self.mapper.graph.keyframes and self._is_located:
                self._restart_at(start)
            self._is_started = True
        self._apply_optimisation()
        scan = observation.named(self.lidar, Scan)
        if scan is not None and frames.covers(scan.stamp):
            self._scans += 1
            self._process(scan, frames.pose_at("odom", scan.stamp))
        if self.mapper.needs_optimising and self._worker.is_free(self._time):
            self._worker.submit(self.mapper.problem(), self._time + self.parameters.latency)
        self.mapper.draw(KEYFRAMES_PER_STEP)
        return self.estimate

    def take_notes(self) -> Sequence[str]:
        """Return what was found in the measurements, and what became of the optimiser."""
        notes, self._notes = [*self._notes, *self.mapper.take_notes()], []
        return notes

    @property
    def fault(self) -> str:
        """Why the map is not corrected; empty while it is."""
        return self._worker.fault

    def await_input(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for an optimisation that is due."""
        return self._worker.await_result(time, longest)

    def observe_markers(self, seen: Sequence[MarkerObservation], frames: TransformBuffer) -> None:
        """Take the markers of a picture into the graph while it grows."""
        for one in seen:
            times = sorted((one.stamp, self._scanned_at))
            if frames.covers(times[0]) and not frames.disturbed_between(*times):
                self.mapper.add_marker(one, frames.pose_at("odom", one.stamp))

    def mapped_markers(self) -> tuple[Marker, ...]:
        """Return the landmarks of the graph; their deviations are its marginals."""
        graph = self.mapper.graph
        if not graph.landmarks:
            return ()
        return markers_of(graph, self._worker.solve(problem_of(graph)))

    def take_map(self) -> OccupancyGrid | None:
        """Return the map when it changed, at most every MAP_PERIOD seconds."""
        grid, is_due = self.grid, self._time >= self._map_due - 1e-9
        if grid is self._taken or not (is_due and self._shows_map):
            return None
        self._taken, self._map_due = grid, self._time + MAP_PERIOD
        return grid

    @property
    def grid(self) -> OccupancyGrid:
        """The map that is drawn; a new object after each change."""
        return self.mapper.shown_grid

    @property
    def unmapped(self) -> str:
        """Why the map has no walls; empty if it has some."""
        if self.grid.occupied.any():
            return ""
        if not self._scans:
            return f"no scan of {self.lidar} could be used; the report counts those dropped"
        longest = self.parameters.match_range
        return f"none of {self._scans} scans of {self.lidar} shows a wall within {longest:g} m"

    def map_files(self) -> dict[str, bytes]:
        """Return the pose graph, also as g2o, and the trajectory of the keyframes."""
        from stack.mapping.graph_files import saved_files

        return saved_files(self.mapper.graph)

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Continue at another pose of the map; near no keyframe, a new part of the graph begins."""
        self._covariance = np.diag(
            np.square([position_deviation, position_deviation, heading_deviation])
        )
        if not self._is_started:
            self._map_from_odom = pose
        self._restart_at(pose)
        self._adopt([GlobalMatch(pose, 1.0)])

    def localise_globally(self, scan: Scan, earlier: Views = ()) -> GlobalMatch:
        """Continue at the best pose of the map that explains the scans; others become rivals.

        Raises:
            NavigationError: LOST if no pose fits. The pose does not change then.
        """
        found = self._localisation().search(scan, earlier)
        self._covariance = found[0].covariance
        self._restart_at(found[0].pose)
        self._adopt(found)
        return found[0]

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose."""
        return self._localisation().fit_at(pose, scan) if self.mapper.graph.keyframes else 0.0

    def best_view(self, scan: Scan, avoided: Sequence[Pose2D] = ()) -> View | None:
        """Return the view that best tells the estimate from its rivals; None without one."""
        if self._on_map is None:
            return None
        return self._on_map[1].best_view(scan, self._clearance, avoided)

    @property
    def estimate(self) -> PoseEstimate:
        """The newest pose, its health and its rivals.

        While mapping, the health says how well the scans agree with the known walls. On a map that
        stays as it is, it is the calibrated probability of Monte-Carlo localisation.
        """
        p = self.parameters
        return PoseEstimate(
            self._map_from_odom.compose(self._odometry), self._covariance, self._health,
            self._map_from_odom, self._corrected_at, rivals=self._rivals,
            thresholds=HealthThresholds(p.lost_health, p.good_health),
        )  # fmt: skip

    def corrected_pose(self, stamp: float, odometry: Pose2D) -> Pose2D | None:
        """Return the pose at a stamp of this run, from the keyframe nearest in time."""
        return self.mapper.graph.pose_at(stamp, odometry, self.mapper.session)

    def configure(self, parameters: SlamParameters) -> None:
        """Apply new parameters to the next scans."""
        super().configure(parameters)
        self.mapper.configure(parameters)

    def run_in_real_time(self) -> None:
        """Do not wait for a late optimisation."""
        self._is_real_time, self._worker.waits = True, False

    def close(self) -> None:
        """End the optimiser's process."""
        self._worker.close()

    def _process(self, scan: Scan, odometry: Pose2D) -> None:
        """Match a scan; on a map that stays as it is, compare it with all hypotheses."""
        if not self._is_located:
            self._search(scan)
            if not self._is_located:
                return
        self._match(scan, odometry)
        if self.mapper.is_mapping:
            return
        localisation = self._localisation()
        taken = localisation.add(self.mapper.pose, odometry, scan)
        if taken is not None:
            self._covariance = np.diag([0.01, 0.01, 0.0025])
            self._restart_at(taken.compose(odometry.relative_to(self._odometry).inverse()))
        self._health = localisation.health
        if self.estimate.is_lost:
            self._search(scan)
        else:
            self._search_due = scan.stamp + SEARCH_PERIOD
        self._apply_mode()

    def _search(self, scan: Scan) -> None:
        """Search the whole map, at most every SEARCH_PERIOD seconds."""
        if scan.stamp < self._search_due - 1e-9:
            return
        self._search_due = scan.stamp + SEARCH_PERIOD
        try:
            self.localise_globally(scan)
        except NavigationError:
            return

    def _adopt(self, matches: Sequence[GlobalMatch]) -> None:
        """Follow these matches from now on, the first one as the estimate."""
        self._is_located = True
        if self._on_map is not None or not self._wants_mapping or len(matches) > 1:
            self._localisation().restart(matches, self._odometry)
            self._health = self._localisation().health
        self._apply_mode()

    def _restart_at(self, pose: Pose2D) -> None:
        """Continue at a pose of the base now."""
        if self._is_started:
            self._map_from_odom = pose.compose(self._odometry.inverse())
        self.mapper.set_pose(pose, self._odometry)
        self._corrected_at = self._time

    def _apply_mode(self) -> None:
        """Map if that is wanted and possible; follow hypotheses on the map otherwise."""
        if self.is_mapping != self.mapper.is_mapping:
            self.mapper.set_mapping(self.is_mapping)
        if self.mapper.is_mapping:
            self._on_map = None

    def _localisation(self) -> GlobalLocalisation:
        """Return the localisation on the map as it is drawn now."""
        if self._on_map is None or (self._on_map[0] is not self.grid and not self._rivals):
            localisation = GlobalLocalisation(self.grid, self._noise, self._seed)
            localisation.restart([GlobalMatch(self.estimate.pose, 1.0)], self._odometry)
            self._on_map = self.grid, localisation
        return self._on_map[1]

    def _match(self, scan: Scan, odometry: Pose2D) -> None:
        pose = self.mapper.add(scan.stamp, odometry, scan)
        self._scanned_at = scan.stamp
        moved, self._matched = odometry.relative_to(self._matched), odometry
        self._map_from_odom = pose.compose(odometry.inverse())
        self._corrected_at = max(self._corrected_at, scan.stamp)
        match = self.mapper.match
        if match is None:
            return
        self._health = self._consistency.weighed(self._health, self.grid, pose, scan)
        if not match.information.any():  # nothing to match with: odometry alone
            self._covariance = self._covariance + odometry_covariance(moved, floor=0.0)
            return
        self._covariance = match.covariance

    def _apply_optimisation(self) -> None:
        try:
            optimum = self._worker.result(self._time)
        except WorkerError as error:
            self._notes.append(str(error))
            self.mapper.needs_optimising = True
            return
        if optimum is None:
            return
        before = self.mapper.pose
        self.mapper.apply(optimum)
        correction = self.mapper.pose.compose(before.inverse())
        self._map_from_odom = correction.compose(self._map_from_odom)
        self._corrected_at = self._time
