"""Base class of the controllers that use `GoalAlignment` at both ends of a path."""

from __future__ import annotations

from abc import abstractmethod
from typing import Generic, TypeVar

from stack.components import Controller, ControlState
from stack.control.goal_alignment import GoalAlignment, GoalAlignmentParameters
from stack.control.path_progress import PathProgress
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.types import STANDSTILL, FloatArray, Path, Twist

P = TypeVar("P", bound=GoalAlignmentParameters)


class PathController(Controller, Generic[P]):
    """Turns towards the path, drives along it, and finally turns to the goal's heading.

    Subclasses implement `_follow`, the motion along the path.

    Attributes:
        parameters: current parameters.
    """

    parameters: P

    def __init__(self, parameters: P, robot: RobotDescription, period: float) -> None:
        self._robot, self._period = robot, period
        self._swept = SweptFootprint(robot.footprint)
        self._path: Path | None = None
        self._local_plan: FloatArray | None = None
        self.configure(parameters)

    def configure(self, parameters: P) -> None:
        """Apply new parameters."""
        self.parameters = parameters
        self._alignment = GoalAlignment(parameters, self._robot, self._swept, self._period)
        if self._path is not None:
            self._alignment.set_path(self._path)

    def pause(self, now: float) -> None:
        """Hold the drive; waiting for the path to clear does not count meanwhile."""
        self._alignment.patience.timers.pause(now)

    def resume(self, now: float) -> None:
        """Continue the drive."""
        self._alignment.patience.timers.resume(now)

    def set_path(self, path: Path) -> None:
        """Set the path to follow, map frame."""
        self._path = path
        self._alignment.set_path(path)

    def command(self, state: ControlState) -> Twist:
        """Compute the velocity command for this step.

        Raises:
            NavigationError: COLLISION_AHEAD when there was no safe command for `patience`.
        """
        alignment = self._alignment
        progress = alignment.begin(state)
        if progress is None:
            return STANDSTILL
        there = alignment.reached(state)
        if there:
            chosen = alignment.finish(state)
        else:
            chosen = alignment.turned(state) if self._may_stand_and_turn(state) else None
        if there or chosen is not None:
            self._stand()
        else:
            chosen = self._follow(progress, state)
            if chosen is None:  # a turn in place also ends a mutual wait with a person
                chosen = alignment.turned(state)
        return alignment.end(state, chosen)

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the next seconds, map frame."""
        return None if self._local_plan is None else Path(self._local_plan)

    def _stand(self) -> None:
        """Called in steps without motion along the path."""
        self._local_plan = None

    def _may_stand_and_turn(self, state: ControlState) -> bool:
        """Whether the robot may stop to turn in place towards the path."""
        return True

    @abstractmethod
    def _follow(self, progress: PathProgress, state: ControlState) -> Twist | None:
        """Compute the velocity along the path; None when no motion is safe."""
