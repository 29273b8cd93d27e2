"""Task handles of navigation, and the motions that they belong to."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from stack.lifecycle import Lifecycle, Timers
from stack.navigation.plans.planner_worker import PlanFuture
from stack.types import (
    Failure,
    FailureCode,
    Path,
    Perceived,
    Pose2D,
    TaskStatus,
    Twist,
)

Emit = Callable[..., None]
"""emit(kind, text, level="info", **fields): publish an event."""


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
    def step(self, perceived: Perceived) -> Twist:
        """Compute the velocity for this control step; ends the task when it is done."""

    def way_left(self, pose: Pose2D) -> float:
        """Return the metres that are left at least, from a pose in the map frame; 0: unknown."""
        return 0.0

    def pause(self, now: float) -> None:
        self.timers.pause(now)

    def resume(self, now: float) -> None:
        self.timers.resume(now)
