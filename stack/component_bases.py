"""Base classes of the components of navigation, and what they get: import from stack.components."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, ClassVar, Protocol

import numpy as np

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError, ParameterError
from stack.frames.buffer import TransformBuffer
from stack.geometry.path_segment import PathSegment
from stack.lifecycle import Lifecycle
from stack.types import (
    CostGrid,
    FailureCode,
    FloatArray,
    Marker,
    MarkerFix,
    MarkerObservation,
    Observation,
    OccupancyGrid,
    Odometry,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    TrackedObject,
    Twist,
    View,
)


class CancelToken:
    """Cancels a search from any thread.

    Attributes:
        flag: (1,) uint8, 0 until cancellation is requested; compiled loops poll it.
    """

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.uint8)

    def request(self) -> None:
        """Request cancellation."""
        self.flag[0] = 1

    def check(self) -> None:
        """Raise NavigationError CANCELLED if cancellation was requested."""
        if self.flag[0]:
            raise NavigationError(FailureCode.CANCELLED, "the plan was cancelled")


@dataclass(frozen=True)
class PlanOptions:
    """Options of a plan request.

    Attributes:
        partial: accept a path to the nearest reachable pose, whatever the planner's parameters.
        direction: +1 or -1 if the robot drives forward or backward at the start of the plan, 0 if
            it stands. Planners with directions count a change of direction there as anywhere.
        cancel: when cancellation is requested, the planner may fail with CANCELLED.
    """

    partial: bool = False
    direction: int = 0
    cancel: CancelToken = field(default_factory=CancelToken)


DEFAULT_PLAN_OPTIONS = PlanOptions()
"""Default options; such a plan is never cancelled."""


class Component:
    """Base class of components.

    Attributes:
        Parameters: a frozen dataclass.
        parameters: current parameters.
    """

    Parameters: ClassVar[type]
    parameters: Any

    @staticmethod
    def check(parameters: Any, robot: RobotDescription) -> None:
        """Check the parameters against the robot, before anything moves.

        Raises:
            InputError: they do not fit the robot.
        """

    @staticmethod
    def kernels(parameters: Any, robot: RobotDescription) -> KernelTypes:
        """Return the numba functions that a run calls, with the types of their arguments.

        They are compiled before the first step; others are when the run first calls them.
        """
        return ()

    def configure(self, parameters: Any) -> None:
        """Apply new parameters; live tuning calls it between two steps."""
        self.parameters = parameters


class Planner(Component, ABC):
    """A global planner.

    Attributes:
        has_route_graph: whether `with_edge` opens and closes edges of a route graph.
    """

    has_route_graph: ClassVar[bool] = False

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @abstractmethod
    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Plan a smooth, collision-free path from start to goal, map frame.

        Headings are those of the robot: on backward segments they point against the motion. A
        planner may ignore the options. If it ignores `options.cancel`, an obsolete plan is computed
        to its end before the next one starts. The costs may change after the return: keep a copy
        of what later plans need.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT at the limit of expansions, or CANCELLED.
        """

    def with_edge(self, edge: str, *, closed: bool) -> Planner:
        """Return a copy with an edge of the route graph closed or open.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        raise ParameterError(
            "edge", f"{edge!r}: the planner in use has no route graph",
            "use `planner: {use: route, graph: FILE}`",
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ControlState:
    """Input of a controller in one step.

    Attributes:
        time: seconds on the robot's clock.
        pose: estimate, map frame.
        twist: measured velocity, base frame.
        costs: local costmap around the robot, map frame.
        tracks: moving objects extrapolated to `time`, map frame; only for controllers with
            `needs_tracks`.
        points: (m, 2) end points of the newest scan in the current base frame, metres; None
            without a scan.
        at_goal: whether the goal's position is reached and only its heading is left, by the
            controller's `stop_criterion`.
    """

    time: float
    pose: Pose2D
    twist: Twist
    costs: CostGrid
    tracks: tuple[TrackedObject, ...] = ()
    points: FloatArray | None = None
    at_goal: bool = False


@dataclass(frozen=True, slots=True)
class StopCriterion:
    """Where the robot stops driving along the path and turns to the goal's heading.

    The navigator judges it. It is a property of the controller: how exactly it can stop.

    Attributes:
        distance: metres to the goal.
        along_path: measure the rest of the path instead of the straight line to the goal: for a
            controller that does not approach a goal beside it again.
    """

    distance: float = 0.05
    along_path: bool = False


class Controller(Component, Lifecycle, ABC):
    """A path-following controller.

    It gets a segment of the path and steers along it. The navigator knows how far the robot is,
    when it has arrived, and how long it waits before an obstacle.

    Lifecycle: `start` at the beginning of a drive, `set_segment` for each new segment, `step` in
    each control step, `stop` at the end. `pause` and `resume` enclose a time in which the robot is
    held or drives elsewhere: it does not count for time limits.

    Attributes:
        needs_tracks: whether the controller uses tracks of moving objects.
    """

    needs_tracks: ClassVar[bool] = False

    def __init__(self, parameters: Any, robot: RobotDescription, period: float) -> None:
        self.parameters = parameters

    @property
    def stop_criterion(self) -> StopCriterion:
        """When `ControlState.at_goal` becomes true."""
        return StopCriterion()

    @abstractmethod
    def set_segment(self, segment: PathSegment) -> None:
        """Set the segment to drive along, map frame; before each step it is up to date."""

    @abstractmethod
    def step(self, state: ControlState) -> Twist:
        """Compute the velocity command of this step, base frame.

        Raises:
            NavigationError: COLLISION_AHEAD if no command is safe; the robot then stands.
        """

    @staticmethod
    def blocked() -> NavigationError:
        """Return the failure to raise when no command is safe."""
        return NavigationError(FailureCode.COLLISION_AHEAD, "an obstacle blocks the path ahead")

    @property
    def local_plan(self) -> Path | None:
        """The motion planned for the next seconds, map frame, for displays."""
        return None


@dataclass(frozen=True, slots=True)
class DriveState:
    """Input of the goal checker and the progress checker in one step.

    Attributes:
        time: seconds on the robot's clock.
        pose: estimate, map frame.
        standing: whether the robot stands and is not commanded to move.
        remaining: metres of the path that are left.
    """

    time: float
    pose: Pose2D
    standing: bool
    remaining: float


class GoalChecker(Component, Lifecycle, ABC):
    """Decides when a drive has reached its goal. The navigator has one.

    Lifecycle: `start` at the beginning of a drive, `set_goal` for each new path, `reached` in each
    control step, `stop` at the end, `pause` and `resume` as for controllers.
    """

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @abstractmethod
    def set_goal(self, goal: Pose2D, tolerance: float | None) -> None:
        """Set the end of a new path, map frame, and the position tolerance of the task (m).

        Without a tolerance of the task the parameters apply.
        """

    @abstractmethod
    def reached(self, state: DriveState) -> bool:
        """Whether the goal is reached."""

    @property
    def at_position(self) -> bool:
        """Whether at most the heading was missing at the last check."""
        return False


class ProgressChecker(Component, Lifecycle, ABC):
    """Decides when a drive makes no progress. The navigator has one.

    Lifecycle: `start` at the beginning of a drive, `stuck` in each control step in which the robot
    follows its path, `stop` at the end, `pause` and `resume` as for controllers.
    """

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @abstractmethod
    def stuck(self, state: DriveState) -> str:
        """Why the drive fails with NO_PROGRESS; empty while it makes progress."""


class OdometryFusion(Component, ABC):
    """Estimates odom -> base from the measurements of each step.

    The pose drifts and never jumps without a motion of the robot.
    """

    def __init__(self, parameters: Any, robot: RobotDescription) -> None:
        self.parameters = parameters

    @abstractmethod
    def update(self, observation: Observation) -> Odometry:
        """Process the measurements of a step; return pose, twist and error at its time.

        Raises:
            BodyError: a measurement that the odometry needs is missing.
        """


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
    def check_map(cls, folder: FilePath | None) -> None:
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

    def load_map(self, grid: OccupancyGrid, folder: FilePath, pose: Pose2D | None) -> None:
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
