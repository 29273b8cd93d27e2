"""Base classes of what follows a path: controllers, goal checkers and progress checkers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf
from typing import Any, ClassVar

from stack.component_bases.component import Component
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.geometry.path_segment import PathSegment
from stack.lifecycle import Lifecycle
from stack.types import (
    CostGrid,
    FailureCode,
    FloatArray,
    Image,
    Path,
    Pose2D,
    TrackedObject,
    Twist,
)


@dataclass(frozen=True, slots=True)
class GoalTolerance:
    """How near to a goal is enough.

    Attributes:
        position: metres.
        heading: radians.
    """

    position: float = inf
    heading: float = inf


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
        blind_behind: whether no sensor covers the ground behind; the robot then backs up slowly.
        image: newest picture of the camera; None before the first one. Pictures are taken for
            controllers that ask for them (`takes_pictures`).
    """

    time: float
    pose: Pose2D
    twist: Twist
    costs: CostGrid
    tracks: tuple[TrackedObject, ...] = ()
    points: FloatArray | None = None
    at_goal: bool = False
    blind_behind: bool = False
    image: Image | None = None


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

    Lifecycle: `start` at the beginning of a drive, `set_tolerance` for each path, `set_segment` for
    each new segment, `step` in each control step, `stop` at the end. `pause` and `resume` enclose a
    time in which the robot is held or drives elsewhere: it does not count for time limits.

    Attributes:
        needs_tracks: whether the controller uses tracks of moving objects.
    """

    needs_tracks: ClassVar[bool] = False

    def __init__(self, parameters: Any, robot: RobotDescription, period: float) -> None:
        super().__init__(parameters, robot)

    @staticmethod
    def takes_pictures(parameters: Any) -> bool:
        """Whether the camera takes pictures all the time, for `ControlState.image`."""
        return False

    @property
    def stop_criterion(self) -> StopCriterion:
        """When `ControlState.at_goal` becomes true."""
        return StopCriterion()

    def set_tolerance(self, tolerance: GoalTolerance) -> None:
        """Note how near to the goal is enough, at the beginning of each path.

        A controller that stops less exactly by its parameters stops within the tolerance.
        """

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

    @property
    def top_speed(self) -> float:
        """Speed in m/s that the parameters allow at most."""
        return inf

    @property
    def keeps_clear(self) -> bool:
        """Whether the last command begins a plan that keeps clear of everybody who moves.

        Then evasion leaves it alone. False for controllers that do not plan with tracks.
        """
        return False


@dataclass(frozen=True, slots=True)
class DriveState:
    """Input of the goal checker and the progress checker in one step.

    Attributes:
        time: seconds on the robot's clock.
        pose: estimate, map frame.
        standing: whether the robot stands and is not commanded to move.
        remaining: metres of the path that are left.
        reversals: how often the robot has still to stop and change its direction on the path.
        top_speed: m/s at which controller and path let it drive at most.
    """

    time: float
    pose: Pose2D
    standing: bool
    remaining: float
    reversals: int = 0
    top_speed: float = inf


class GoalChecker(Component, Lifecycle, ABC):
    """Decides when a drive has reached its goal. The navigator has one.

    Lifecycle: `start` at the beginning of a drive, `set_goal` for each new path, `reached` in each
    control step, `stop` at the end, `pause` and `resume` as for controllers.
    """

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

    @property
    def tolerance(self) -> GoalTolerance:
        """Tolerances at the current goal: controllers stop within them, as far as they are known.

        A given path is not over where it only passes within the tolerance of its end.
        """
        return GoalTolerance()


class ProgressChecker(Component, Lifecycle, ABC):
    """Decides when a drive makes no progress. The navigator has one.

    Lifecycle: `start` at the beginning of a drive, `stuck` in each control step in which the robot
    follows its path, `stop` at the end, `pause` and `resume` as for controllers.
    """

    @property
    def patience(self) -> float:
        """Seconds without progress after which a drive fails, for its sentence; 0: not known."""
        return 0.0

    @abstractmethod
    def stuck(self, state: DriveState) -> str:
        """Why the drive fails with NO_PROGRESS; empty while it makes progress."""
