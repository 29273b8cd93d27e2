"""Base class of the controllers that use `GoalAlignment` at both ends of a path."""

from __future__ import annotations

from abc import abstractmethod
from typing import Generic, TypeVar

from stack.compilation import KernelTypes
from stack.components import Controller, ControlState, GoalTolerance, StopCriterion
from stack.control.goal_alignment import GoalAlignment, GoalAlignmentParameters
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, FloatArray, Path, Twist

P = TypeVar("P", bound=GoalAlignmentParameters)


class PathController(Controller, Generic[P]):
    """Turns towards the path, drives along it, and finally turns to the goal's heading.

    Subclasses implement `_follow`, the motion along the path.

    Attributes:
        parameters: current parameters.
    """

    parameters: P

    @staticmethod
    def kernels(parameters: P, robot: RobotDescription) -> KernelTypes:
        from stack.control import kernels

        return (*kernels.SWEEP, *kernels.CLEAR_POSES)

    def __init__(self, parameters: P, robot: RobotDescription, period: float) -> None:
        self._robot, self._period = robot, period
        self._swept = SweptFootprint(robot.footprint)
        self._segment: PathSegment | None = None
        self._local_plan: FloatArray | None = None
        self._tolerance = GoalTolerance()
        self.configure(parameters)

    def configure(self, parameters: P) -> None:
        self.parameters = parameters
        self._alignment = GoalAlignment(parameters, self._robot, self._swept, self._period)
        self._alignment.set_tolerance(parameters, self._tolerance)
        if self._segment is not None:
            self._alignment.set_segment(self._segment)

    @property
    def top_speed(self) -> float:
        return self.parameters.cruise_speed

    @property
    def stop_criterion(self) -> StopCriterion:
        return self._alignment.stop_criterion

    def set_tolerance(self, tolerance: GoalTolerance) -> None:
        self._tolerance = tolerance
        self._alignment.set_tolerance(self.parameters, tolerance)

    def set_segment(self, segment: PathSegment) -> None:
        self._segment = segment
        self._alignment.set_segment(segment)

    def step(self, state: ControlState) -> Twist:
        if self._segment is None:
            return STANDSTILL
        self._alignment.begin(state)
        chosen = self._choose(self._segment, state)
        self._commanded(chosen or STANDSTILL)
        if chosen is None:
            raise self.blocked()
        return chosen

    def _choose(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """A turn at an end of the path, or a motion along it; None when none is safe."""
        alignment = self._alignment
        if state.at_goal:
            self._stand()
            return alignment.finish(state)
        approach = alignment.approached(state)
        if approach is not None:
            self._stand()
            return approach
        turn = alignment.turned(state) if self._may_stand_and_turn(state) else None
        if turn is not None:
            self._stand()
            return turn
        # a turn in place also ends a mutual wait with a person
        return self._follow(segment, state) or alignment.turned(state)

    def _commanded(self, twist: Twist) -> None:
        """Note the command of this step."""
        self._alignment.commanded(twist)

    @property
    def local_plan(self) -> Path | None:
        return None if self._local_plan is None else Path(self._local_plan)

    def _stand(self) -> None:
        """Called in steps without motion along the path."""
        self._local_plan = None

    def _may_stand_and_turn(self, state: ControlState) -> bool:
        """Whether the robot may stop to turn in place towards the path."""
        return True

    @abstractmethod
    def _follow(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """Compute the velocity along the path; None when no motion is safe."""
