"""Base classes of what estimates the pose: odometry (odom -> base) and estimators (map -> odom)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from stack.component_bases.component import Component
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.frames.buffer import TransformBuffer
from stack.types import (
    FailureCode,
    FloatArray,
    Marker,
    MarkerFix,
    MarkerObservation,
    Observation,
    OccupancyGrid,
    Odometry,
    Pose2D,
    PoseEstimate,
    Scan,
    View,
)


class OdometryFusion(Component, ABC):
    """Estimates odom -> base from the measurements of each step.

    The pose drifts and never jumps without a motion of the robot.
    """

    @abstractmethod
    def update(self, observation: Observation) -> Odometry:
        """Process the measurements of a step; return pose, twist and error at its time.

        Raises:
            BodyError: a measurement that the odometry needs is missing.
        """

    @property
    def is_ready(self) -> bool:
        """Whether the robot may drive: not while a sensor is calibrated at the first standstill."""
        return True


NO_PARTICLES: FloatArray = np.empty((0, 3))
NO_PARTICLES.flags.writeable = False


class Match(Protocol):
    """A pose that explains scans."""

    @property
    def pose(self) -> Pose2D:
        """Map frame."""
        ...

    @property
    def fit(self) -> float:
        """Share of the scans explained, in [0, 1]."""
        ...


class Estimator(Component, ABC):
    """Estimates map -> odom from the measurements of each step.

    Lifecycle: `start` before the first step, `update` in each step; `set_pose` and
    `localise_globally` between two steps.

    Attributes:
        needs_map: whether it works only in missions with a map.
        needs_initial_pose: whether, on a map, the mission must know where the robot starts.
        uses_markers: whether `update_markers` corrects the pose.
        maps_markers: whether the markers of `observe_markers` are part of its map.
        loads_saved_maps: whether it reads more of a saved map than the grid, e.g. a pose graph; a
            mission with a saved map then begins with `load_map` instead of `start`.
        lidar: name of the lidar whose scans `fit_at` and `localise_globally` expect.
    """

    needs_map: ClassVar[bool] = False
    needs_initial_pose: ClassVar[bool] = False
    uses_markers: ClassVar[bool] = False
    maps_markers: ClassVar[bool] = False
    loads_saved_maps: ClassVar[bool] = False

    @classmethod
    def check_map(cls, folder: Path | None) -> None:
        """Check the files of the mission's map before the run.

        Args:
            folder: of a map from files; None for a map that is drawn from the world.

        Raises:
            InputError: the estimator needs other files.
        """

    def __init__(
        self, parameters: Any, robot: RobotDescription, grid: OccupancyGrid | None, seed: int
    ) -> None:
        """Create the estimator.

        Args:
            parameters: instance of `Parameters`.
            robot: description of the robot.
            grid: the map; None in missions without one.
            seed: of the run, for `stack.streams.stream`.
        """
        self.parameters, self.lidar = parameters, robot.main_lidar

    @abstractmethod
    def start(self, pose: Pose2D | None) -> None:
        """Start at the initial pose of the base, map frame; None if it is unknown."""

    @abstractmethod
    def update(self, observation: Observation, frames: TransformBuffer) -> PoseEstimate:
        """Process the measurements of a step; return the estimate at the observation's time.

        Args:
            observation: new measurements, scans deskewed.
            frames: with the odometry up to the observation's time; `frames.pose_at("odom", stamp)`
                is the pose at which a measurement was taken.
        """

    def update_markers(self, fix: MarkerFix, frames: TransformBuffer) -> PoseEstimate:
        """Process the known markers in a picture; return the estimate at the time of `update`.

        It is called after `update` in the step in which the picture arrives, with
        `navigation: {markers: {localise: true}}`. Consecutive pictures are taken from different
        places, so that their errors are about independent. Estimators without `uses_markers`
        ignore them.

        Args:
            fix: the base's pose at the picture's stamp, with its candidates.
            frames: as for `update`.
        """
        return self.estimate

    def take_notes(self) -> Sequence[str]:
        """Return what a person should know that happened since the last call, as sentences."""
        return ()

    @property
    def fault(self) -> str:
        """What the estimator does without at present, and why; empty if nothing is wrong."""
        return ""

    def await_input(self, time: float, longest: float) -> bool:
        """Wait for slow work, done beside the loop, that the next `update` uses.

        Args:
            time: of the robot's clock, seconds.
            longest: wall seconds.

        Returns:
            Whether `update` will not wait.
        """
        return True

    def observe_markers(self, seen: Sequence[MarkerObservation], frames: TransformBuffer) -> None:
        """Take the markers of a picture into the map.

        It is called after `update` in the step in which the picture arrives, with
        `navigation: {markers: {survey: true}}`, for estimators with `maps_markers`.

        Args:
            seen: the markers to map, relative to the base at the picture's stamp.
            frames: as for `update`.
        """

    def mapped_markers(self) -> tuple[Marker, ...]:
        """Return the markers of the estimator's map, with standard deviations, map frame."""
        return ()

    @property
    @abstractmethod
    def estimate(self) -> PoseEstimate:
        """The newest estimate."""

    @abstractmethod
    def set_pose(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Restart around a pose.

        Args:
            pose: of the base now, map frame.
            position_deviation: standard deviation, metres.
            heading_deviation: standard deviation, radians.
        """

    def take_map(self) -> OccupancyGrid | None:
        """Return the map if the estimator draws one and it changed since the last call."""
        return None

    def run_in_real_time(self) -> None:
        """Prepare for a body whose clock goes on: no `update` may wait for slow work."""

    def close(self) -> None:
        """Release processes and files. Safe to call twice."""

    @property
    def particles(self) -> FloatArray:
        """(n, 3) x, y, heading of hypotheses in the map frame, for displays; may be empty."""
        return NO_PARTICLES

    @property
    def grid(self) -> OccupancyGrid | None:
        """The map that the estimator draws; None if it draws none. A new one is a new object."""
        return None

    @property
    def unmapped(self) -> str:
        """Why there is nothing on the map that the estimator draws; empty if there is something."""
        return ""

    def map_files(self) -> Mapping[str, bytes]:
        """Return further files of a saved map by name, e.g. of a pose graph."""
        return {}

    def corrected_pose(self, stamp: float, odometry: Pose2D) -> Pose2D | None:
        """Return where the base was at an earlier stamp, as far as it is known now, map frame.

        None if the estimator does not correct the past, as all but SLAM do.

        Args:
            stamp: seconds.
            odometry: pose of the base then, odom frame.
        """
        return None

    def load_map(self, grid: OccupancyGrid, folder: Path, pose: Pose2D | None) -> None:
        """Use a saved map from now on, between two steps.

        Args:
            grid: its occupancy grid.
            folder: with all files of the map.
            pose: of the base in that map; None: unknown.

        Raises:
            NavigationError: UNSUPPORTED if the estimator cannot change its map.
        """
        raise NavigationError(
            FailureCode.UNSUPPORTED,
            "this estimator cannot load a map during a run; use `localisation: mcl`",
        )

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to change the map, between two steps; it localises on in either case.

        Raises:
            NavigationError: UNSUPPORTED if the estimator draws no map.
        """
        raise NavigationError(
            FailureCode.UNSUPPORTED,
            "this estimator draws no map; use `localisation: slam` or `localisation: pose_graph`",
        )

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Return the health in [0, 1] of a single scan at another pose; 0 without a map."""
        return 0.0

    def best_view(self, scan: Scan, avoided: Sequence[Pose2D] = ()) -> View | None:
        """Return the view that best tells the estimate from its rivals; None without one.

        Args:
            scan: the newest scan, for the lidar's beams.
            avoided: places that could not be reached or were seen, current base frame.
        """
        return None

    def localise_globally(self, scan: Scan, earlier: Sequence[tuple[Pose2D, Scan]] = ()) -> Match:
        """Restart at the best pose on the map that explains the scans.

        Other poses that explain them about as well become `estimate.rivals`.

        Args:
            scan: the newest scan.
            earlier: earlier scans, each with the base pose at its stamp in the current base frame.

        Raises:
            NavigationError: LOST if no pose fits or the estimator cannot search a map.
        """
        raise NavigationError(
            FailureCode.LOST,
            "global relocalisation needs a map and an estimator that searches it; add a map and "
            "use `localisation: mcl`, or set the pose",
        )
