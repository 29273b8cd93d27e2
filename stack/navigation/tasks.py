"""Task handles of navigation, and the motions that they belong to."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import hypot
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stack.lifecycle import Lifecycle, Timers
from stack.navigation.plans.planner_worker import PlanFuture
from stack.types import (
    CostGrid,
    Failure,
    FailureCode,
    OccupancyGrid,
    Path,
    Perceived,
    Pose2D,
    TaskStatus,
    Twist,
)

STANDING_SPEED, STANDING_TURN = 0.02, 0.05
"""Speeds in m/s and rad/s below which the robot counts as standing."""


def standing(twist: Twist) -> bool:
    """Whether a measured velocity counts as standstill."""
    speed = hypot(twist.linear, twist.lateral)
    return speed < STANDING_SPEED and abs(twist.angular) < STANDING_TURN


Emit = Callable[..., None]
"""emit(kind, text, level="info", **fields): publish an event."""


class CopyLike(Protocol):
    """A copy of a costmap for a worker thread."""

    @property
    def grid(self) -> CostGrid:
        """The costs; not modified before the release."""
        ...

    def release(self) -> None:
        """Allow the reuse of the cells."""
        ...


class CostmapLike(Protocol):
    """A costmap, as far as navigation needs it."""

    @property
    def grid(self) -> CostGrid:
        """A copy of the current costs; never modified later."""
        ...

    @property
    def view(self) -> CostGrid:
        """The current costs without a copy, which the next update changes: read them at once."""
        ...

    @property
    def marks(self) -> CostGrid:
        """Free, lethal and unknown cells before inflation, without a copy: read them at once."""
        ...

    @property
    def ground(self) -> CostGrid:
        """Costs of the map alone, without a copy; unknown without a map."""
        ...

    def copied(self) -> CopyLike:
        """Return a copy of the current costs for a worker thread, until it is released."""
        ...

    @property
    def version(self) -> int:
        """Increases with each change."""
        ...

    def set_static(self, static: OccupancyGrid) -> None:
        """Replace the map; sensed obstacles keep their positions."""
        ...

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers."""
        ...

    @property
    def way_out(self) -> Pose2D | None:
        """First place outside, map frame, for a robot in a keep-out zone; None elsewhere."""
        ...

    @property
    def forbidden(self) -> dict[str, NDArray[np.bool_]]:
        """Cells (rows, columns) of each keep-out zone, by name."""
        ...

    def zones_between(self, start: Pose2D, goal: Pose2D) -> tuple[str, ...]:
        """Return the names of the keep-out zones that alone close the way between two places."""
        ...

    def clear(self, *, layer: str | None = None) -> None:
        """Clear sensed obstacles, in one layer or all."""
        ...

    def clear_around(self, pose: Pose2D, radius: float, *, layer: str | None = None) -> None:
        """Clear sensed obstacles within `radius` metres of a pose."""
        ...


class MotionTask:
    """A task handle (stack.robot.Task); it keeps its outcome after the task has ended.

    Attributes:
        what: description of the task, e.g. `drive to (3.0, 1.0)`.
        feedback: progress in a few words.
        distance_remaining: remaining metres (radians for a spin); 0 after the end.
        path: current path, or the result of a plan.
        future: the requested plan; cancelled when the task ends before it is due.
        while_lost: whether it also moves a robot that is lost.
    """

    def __init__(
        self, what: str, ended: Callable[[MotionTask], None], *, while_lost: bool = False
    ) -> None:
        self.while_lost = while_lost
        self.what, self.feedback = what, "starting"
        self.distance_remaining = 0.0
        self.path: Path | None = None
        self.future: PlanFuture | None = None
        self._status = TaskStatus.RUNNING
        self._failure: Failure | None = None
        self._ended = ended

    @property
    def status(self) -> TaskStatus:
        """RUNNING until the task succeeds, fails or is cancelled; does not change afterwards."""
        return self._status

    @property
    def failure(self) -> Failure | None:
        """Reason of a failure or cancellation; None otherwise."""
        return self._failure

    @property
    def running(self) -> bool:
        """Whether the task has not ended yet."""
        return self._status is TaskStatus.RUNNING

    def report(self, feedback: str, remaining: float) -> None:
        """Set the progress shown to the operator and to behaviours."""
        if self.running:
            self.feedback, self.distance_remaining = feedback, remaining

    def succeed(self, feedback: str) -> None:
        """End the task with success."""
        self._end(TaskStatus.SUCCEEDED, feedback, None)

    def fail(self, code: str, sentence: str) -> None:
        """End the task with a failure code and a sentence."""
        self._end(TaskStatus.FAILED, sentence, Failure(code, sentence))

    def cancel(self, why: str = "cancelled") -> None:
        """Cancel the task; the robot stops from the next control step on."""
        self._end(TaskStatus.CANCELLED, why, Failure(FailureCode.CANCELLED, why))

    def _end(self, status: TaskStatus, feedback: str, failure: Failure | None) -> None:
        if not self.running:
            return
        self._status, self._failure = status, failure
        if self.future is not None:
            self.future.drop()
        self.feedback, self.distance_remaining = feedback, 0.0
        self._ended(self)


class MotionExecutor(Lifecycle, ABC):
    """Executes a motion task: a drive or a recovery.

    `start` precedes the first step; `pause` and `resume` enclose a time in which the robot is held
    or drives elsewhere; `stop` follows the end of the task, whatever ended it.

    Attributes:
        task: handle of the task.
        timers: time limits of the task; pauses do not count.
        while_lost: it also moves a robot that is lost: it finds the pose, or an operator drives.
        while_ambiguous: it also moves a robot whose estimate has rivals.
        follows_map: it follows a path on the map.
        held_for: seconds for which it has been held because the robot is lost; None if it is not.
    """

    while_lost = False
    while_ambiguous = True
    follows_map = False

    def __init__(self, task: MotionTask) -> None:
        self.task = task
        self.timers = Timers()
        self.while_lost = self.while_lost or task.while_lost
        self.held_for: float | None = None

    def hold(self, now: float, period: float) -> float:
        """Hold the motion for a control period because the robot is lost; return for how long."""
        self.held_for = 0.0 if self.held_for is None else self.held_for + period
        self.pause(now)
        return self.held_for

    def let_go(self, now: float) -> None:
        """Continue the motion if it was held."""
        if self.held_for is not None:
            self.held_for = None
            self.resume(now)

    @abstractmethod
    def step(self, state: Perceived) -> Twist:
        """Compute the velocity for this control step; ends the task when it is done."""

    def way_left(self, pose: Pose2D) -> float:
        """Return the metres that are left at least, from a pose in the map frame; 0: unknown."""
        return 0.0

    def pause(self, now: float) -> None:
        """Hold the motion, and its time limits."""
        self.timers.pause(now)

    def resume(self, now: float) -> None:
        """Continue the motion."""
        self.timers.resume(now)
