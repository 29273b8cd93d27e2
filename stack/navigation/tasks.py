"""What navigation is asked to do: task handles, and the moment they advance in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from stack.navigation.planner_worker import PlanFuture
from stack.types import (
    CostGrid,
    Failure,
    FailureCode,
    Odometry,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    TaskStatus,
    TrackedObject,
    Twist,
)

Emit = Callable[..., None]
"""emit(kind, text, level="info", **fields): something happened."""


@dataclass(frozen=True, slots=True)
class NavigationState:
    """What navigation knows in one control step.

    Attributes:
        time: seconds on the robot's clock.
        estimate: where the robot believes it is, map frame.
        odometry: dead reckoning and measured speed.
        scan: the newest lidar scan.
        tracks: what moves around the robot, as of the robot's clock now, map frame.
    """

    time: float
    estimate: PoseEstimate
    odometry: Odometry
    scan: Scan | None = None
    tracks: tuple[TrackedObject, ...] = ()


class CostmapLike(Protocol):
    """A costmap, as far as navigation needs it."""

    @property
    def grid(self) -> CostGrid:
        """The costs now; never written to again, so that a worker may read them."""
        ...

    @property
    def version(self) -> int:
        """Grows with each change."""
        ...

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of what it is made of."""
        ...

    def clear(self, *, layer: str | None = None) -> None:
        """Forget what was sensed, by one layer or all."""
        ...

    def clear_around(self, pose: Pose2D, radius: float, *, layer: str | None = None) -> None:
        """Forget what was sensed within a distance (metres) of a pose."""
        ...


class MotionTask:
    """A task handle (stack.robot.Task) that keeps its own outcome for ever.

    Attributes:
        what: the task in words, e.g. `drive to (3.0, 1.0)`.
        feedback: progress in a few words.
        distance_remaining: metres left (radians for a spin); 0 when over.
        path: in force, or the answer of a plan.
        future: the plan that it waits for; dropped when the task ends first.
    """

    def __init__(self, what: str, ended: Callable[[MotionTask], None]) -> None:
        self.what, self.feedback = what, "begins"
        self.distance_remaining = 0.0
        self.path: Path | None = None
        self.future: PlanFuture | None = None
        self._status = TaskStatus.RUNNING
        self._failure: Failure | None = None
        self._ended = ended

    @property
    def status(self) -> TaskStatus:
        """RUNNING until it succeeded, failed or was cancelled; never changes after that."""
        return self._status

    @property
    def failure(self) -> Failure | None:
        """Why it failed or was cancelled; None otherwise."""
        return self._failure

    @property
    def running(self) -> bool:
        """Whether it is not over yet."""
        return self._status is TaskStatus.RUNNING

    def report(self, feedback: str, remaining: float) -> None:
        """Progress, for the operator and for behaviours."""
        if self.running:
            self.feedback, self.distance_remaining = feedback, remaining

    def succeed(self, feedback: str) -> None:
        """End it well."""
        self._end(TaskStatus.SUCCEEDED, feedback, None)

    def fail(self, code: str, sentence: str) -> None:
        """End it with a reason."""
        self._end(TaskStatus.FAILED, sentence, Failure(code, sentence))

    def cancel(self, why: str = "cancelled") -> None:
        """End it; the robot stands from the next control step on."""
        self._end(TaskStatus.CANCELLED, why, Failure(FailureCode.CANCELLED, why))

    def _end(self, status: TaskStatus, feedback: str, failure: Failure | None) -> None:
        if not self.running:
            return
        self._status, self._failure = status, failure
        if self.future is not None:
            self.future.drop()
        self.feedback, self.distance_remaining = feedback, 0.0
        self._ended(self)


class MotionExecutor(Protocol):
    """A motion task at work: one of the drives and recoveries."""

    task: MotionTask

    def advance(self, state: NavigationState) -> Twist:
        """The velocity for this control step; ends its task when there is nothing left to do."""
        ...
