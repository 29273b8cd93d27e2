"""What the controllers share that drive along a path and leave its two ends to `GoalAlignment`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from stack.components import ControlState
from stack.control.goal_alignment import EndsParameters, GoalAlignment
from stack.control.path_progress import PathProgress
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.types import STANDSTILL, FloatArray, Path, Twist

P = TypeVar("P", bound=EndsParameters)


class PathController(ABC, Generic[P]):
    """Turns towards the path, drives along it, and turns to the goal's heading at last.

    A controller says in `_along` how it drives along the path.

    Attributes:
        parameters: in force.
    """

    parameters: P

    def __init__(self, parameters: P, robot: RobotDescription, period: float) -> None:
        self._robot, self._period = robot, period
        self._swept = SweptFootprint(robot.footprint)
        self._path: Path | None = None
        self._local_plan: FloatArray | None = None
        self.configure(parameters)

    def configure(self, parameters: P) -> None:
        """Put other parameters in force."""
        self.parameters = parameters
        self._ends = GoalAlignment(parameters, self._robot, self._swept, self._period)
        if self._path is not None:
            self._ends.set_path(self._path)

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        self._path = path
        self._ends.set_path(path)

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe could be commanded for `patience`.
        """
        ends = self._ends
        track = ends.begin(state)
        if track is None:
            return STANDSTILL
        there = ends.reached(state)
        if there:
            chosen = ends.finish(state)
        else:
            chosen = ends.turned(state) if self._may_stand_and_turn(state) else None
        if there or chosen is not None:
            self._stand()
        else:
            chosen = self._along(track, state)
            if chosen is None:  # better to stand and turn than to wait for each other
                chosen = ends.turned(state)
        return ends.end(state, chosen)

    @property
    def local_plan(self) -> Path | None:
        """What it means to drive next, map frame."""
        return None if self._local_plan is None else Path(self._local_plan)

    def _stand(self) -> None:
        """Nothing is driven along the path in this step."""
        self._local_plan = None

    def _may_stand_and_turn(self, state: ControlState) -> bool:
        """Whether there is time to turn in place towards the path."""
        return True

    @abstractmethod
    def _along(self, track: PathProgress, state: ControlState) -> Twist | None:
        """The velocity along the path; None when nothing is safe."""
