"""SLAM as an estimator: maps while it localises, or localises in a saved pose graph."""

from __future__ import annotations

import numpy as np

from stack.compilation import KernelTypes
from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.mapping.slam.parameters import SlamParameters
from stack.parameters import suggestion
from stack.types import FloatArray, Observation, OccupancyGrid, Pose2D, PoseEstimate, Scan

SMALL_CORRECTION = 0.02
"""Metres: corrections by the optimiser below this are no jump."""

LEAST_OVERLAP, FULL_OVERLAP = 0.2, 0.6
"""Share of a scan's points that the map explains, at health 0 and 1."""

UNKNOWN_VARIANCE = 1.0
"""Square metres or radians: variance in a direction that no scan determines."""


class SlamEstimator(Estimator):
    """SLAM: scan matching, loop closure and a pose graph; the map grows with the drive.

    A loop closure moves the map and the robot in it: the estimate jumps. The graph is optimised
    beside the loop and applied `latency` seconds later.
    """

    Parameters = SlamParameters
    parameters: SlamParameters

    @staticmethod
    def kernels(parameters: SlamParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of scan matching and map rendering."""
        from stack.mapping.slam.matching import kernels as matching
        from stack.mapping.slam.rendering import kernels as rendering

        return (*matching.ENTRY_POINTS, *rendering.ENTRY_POINTS)

    @staticmethod
    def check(parameters: SlamParameters, robot: RobotDescription) -> None:
        """Check that the robot has the lidar."""
        wanted, lidars = parameters.lidar, robot.all_lidars
        if wanted and wanted not in lidars:
            raise InputError(
                f"{robot.name} has no lidar {wanted!r}; {suggestion(wanted, list(lidars))}"
            )

    def __init__(
        self,
        parameters: SlamParameters,
        robot: RobotDescription,
        grid: OccupancyGrid | None,
        seed: int,
    ) -> None:
        from stack.mapping.slam.mapper import Mapper
        from stack.mapping.slam.worker import OptimiserWorker

        super().__init__(parameters, robot, grid, seed)
        self.lidar = parameters.lidar or robot.main_lidar
        self._drawn: tuple[object, OccupancyGrid] | None = None
        self.mapper = Mapper(parameters, immediate=False)
        self._worker = OptimiserWorker()
        self._map_from_odom, self._odometry = Pose2D(0.0, 0.0), Pose2D(0.0, 0.0)
        self._covariance: FloatArray = np.diag([1e-4, 1e-4, 1e-4])
        self._health, self._jumps = 1.0, 0
        self._time = self._corrected_at = 0.0
        self._is_started = False
        self._map_version, self._map_due = 0, 0.0

    def start(self, pose: Pose2D | None) -> None:
        """Begin the map at the initial pose; at the map's origin if that is unknown."""
        if pose is not None:
            self._map_from_odom = pose
            self.mapper.start(pose)

    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Match a new scan, apply a finished optimisation, draw a piece of the map."""
        self._time = observation.time
        self._odometry = frames.pose_at("odom", observation.time)
        if not self._is_started:
            self._map_from_odom = self._map_from_odom.compose(self._odometry.inverse())
            self._is_started = True
        self._apply_optimisation()
        scan = observation.named(self.lidar, Scan)
        if scan is not None and frames.covers(scan.stamp):
            self._match(scan, frames.pose_at("odom", scan.stamp))
        if self.mapper.needs_optimising and not self._worker.is_busy:
            self._worker.submit(self.mapper.problem(), self._time + self.parameters.latency)
        self.mapper.draw(self.parameters.keyframes_per_step)
        return self.estimate

    def take_map(self) -> OccupancyGrid | None:
        """Return the map when it changed, at most every `map_period` seconds."""
        version = self.mapper.map_version
        if version == self._map_version or self._time < self._map_due - 1e-9:
            return None
        self._map_version, self._map_due = version, self._time + self.parameters.map_period
        return self.mapper.shown_grid()

    @property
    def grid(self) -> OccupancyGrid:
        """The map that is drawn; a new object after each change."""
        version = self.mapper.map_version
        if self._drawn is None or self._drawn[0] != version:
            self._drawn = version, self.mapper.shown_grid()
        return self._drawn[1]

    def map_files(self) -> dict[str, bytes]:
        """Return the pose graph, also as g2o, and the trajectory of the keyframes."""
        from stack.mapping.graph_files import g2o_text, graph_contents
        from stack.mapping.trajectories import plain_text, tum_text

        graph = self.mapper.graph
        frames = list(graph.keyframes.values())
        stamps = np.array([frame.stamp for frame in frames], dtype=np.float64)
        poses = [frame.pose for frame in frames]
        return {
            **graph_contents(graph),
            "graph.g2o": g2o_text(graph).encode(),
            "trajectory.tum": tum_text(stamps, poses).encode(),
            "trajectory.txt": plain_text(stamps, poses).encode(),
        }

    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Continue at another pose of the map; near no keyframe, a new part of the graph begins."""
        self._map_from_odom = pose.compose(self._odometry.inverse())
        self.mapper.set_pose(pose, self._odometry)
        self._covariance = np.diag(
            np.square([position_deviation, position_deviation, heading_deviation])
        )
        self._jumps, self._corrected_at = self._jumps + 1, self._time

    @property
    def estimate(self) -> PoseEstimate:
        """The newest pose; its health is the share of the scan that the map explains, scaled."""
        return PoseEstimate(
            self._map_from_odom.compose(self._odometry), self._covariance, self._health,
            self._map_from_odom, self._corrected_at, self._jumps,
        )  # fmt: skip

    def configure(self, parameters: SlamParameters) -> None:
        """Apply new parameters to the next scans."""
        super().configure(parameters)
        self.mapper.configure(parameters)

    def run_in_real_time(self) -> None:
        """Do not wait for a late optimisation."""
        self._worker.waits = False

    def close(self) -> None:
        """End the optimiser's process."""
        self._worker.close()

    def _match(self, scan: Scan, odometry: Pose2D) -> None:
        pose = self.mapper.add(scan.stamp, odometry, scan)
        self._map_from_odom = pose.compose(odometry.inverse())
        self._corrected_at = max(self._corrected_at, scan.stamp)
        match = self.mapper.match
        if match is None:
            return
        span = FULL_OVERLAP - LEAST_OVERLAP
        fit = min(1.0, max(0.0, (match.overlap - LEAST_OVERLAP) / span))
        self._health += self.parameters.health_gain * (fit - self._health)
        least = np.eye(3) / UNKNOWN_VARIANCE
        local = np.linalg.inv(match.information + least) + np.diag([1e-5, 1e-5, 1e-6])
        c, s = np.cos(pose.heading), np.sin(pose.heading)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        self._covariance = turn @ local @ turn.T

    def _apply_optimisation(self) -> None:
        poses = self._worker.result(self._time)
        if poses is None:
            return
        before = self.mapper.pose
        self.mapper.apply(poses)
        after = self.mapper.pose
        correction = after.compose(before.inverse())
        self._map_from_odom = correction.compose(self._map_from_odom)
        if after.distance_to(before) > SMALL_CORRECTION:
            self._jumps, self._corrected_at = self._jumps + 1, self._time
