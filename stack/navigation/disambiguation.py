"""Driving to where rival poses differ, until one pose is left, before a drive or in the middle."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from stack.components import Estimator
from stack.navigation.doubt import LocalisationMonitor, other_places, step_in_doubt
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.parameters import NavigationParameters
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.types import (
    STANDSTILL,
    FailureCode,
    Perceived,
    Pose2D,
    PoseEstimate,
    RivalPose,
    Scan,
    Twist,
    has_jumped,
)

VIEW_TIME = 0.5
"""How long it stands and looks at each of them, s."""


def ambiguity(pose: Pose2D, rivals: Sequence[RivalPose]) -> str:
    """Return a sentence about the rivals of a pose."""
    nearest = rivals[0].pose
    others = f"{len(rivals)} other places" if len(rivals) > 1 else "another place"
    such = "such as " if len(rivals) > 1 else ""
    return (
        f"({pose.x:.2f}, {pose.y:.2f}) and {others}, {such}({nearest.x:.2f}, {nearest.y:.2f}), "
        "explain the scans about as well"
    )


class Disambiguation(MotionExecutor):
    """Drives from view to view while the estimate has rivals.

    A view is a motion that leads to free space at every rival, to where their expected scans
    differ; the estimator weighs the rivals by the scans on the way. The drive there avoids what the
    sensors see, as any drive. When the estimate moves to another rival, the next view is chosen.

    Args:
        task: handle of the task.
        estimator: keeps the rivals and chooses views.
        parameters: number of views, and time to look at each.
        drive: makes the drive to a goal that ignores ambiguity.
        monitor: holds the drives while the robot is lost.
        then: drive of the same task, which stands while there are rivals that it cannot tell apart
            on its way; None: the task ends when one pose is left.

    Attributes:
        drive: under way: to a view, or `then`; None while the robot looks.
    """

    while_lost = True

    def __init__(  # noqa: PLR0913 - what it needs of the stack
        self, task: MotionTask, estimator: Estimator, parameters: NavigationParameters,
        drive: Callable[[Pose2D], GoalDrive],
        monitor: LocalisationMonitor, then: GoalDrive | None = None,
    ) -> None:  # fmt: skip
        super().__init__(task)
        self._estimator, self._parameters = estimator, parameters
        self._make_drive, self._then = drive, then
        self._monitor = monitor
        self._looking = self.timers.new()
        self._seen: list[Pose2D] = []
        self._estimate: PoseEstimate | None = None
        self._views = 0
        self.drive = then

    def start(self, now: float) -> None:
        self._looking.start(now)
        if self._then is not None:
            self._then.start(now)

    def step(self, perceived: Perceived) -> Twist:
        if self._then is not None and self.drive is self._then:
            if not other_places(self._then, perceived.estimate):
                return self._step(self._then, perceived)
            self._then.pause(perceived.time)
            self.drive = None
            self._looking.start(perceived.time)
        before, self._estimate = self._estimate, perceived.estimate
        jumped = before is not None and has_jumped(before, perceived.estimate)
        if not perceived.estimate.ambiguous:
            return self._resolved(perceived, jumped=jumped)
        if self.drive is None:
            return self._look(perceived)
        if jumped or not self.drive.task.running:
            self._end_drive(perceived, jumped=jumped)
            return STANDSTILL
        twist = self._step(self.drive, perceived)
        self.task.report(
            f"{_rivals(perceived)}, {self.drive.task.feedback}", self.drive.task.distance_remaining
        )
        return twist

    def pause(self, now: float) -> None:
        super().pause(now)
        if self.drive is not None:
            self.drive.pause(now)

    def resume(self, now: float) -> None:
        super().resume(now)
        if self.drive is not None:
            self.drive.resume(now)

    def stop(self, now: float) -> None:
        if self.drive is not None and self.drive is not self._then:
            self.drive.task.cancel("the search for a view is over")
            self.drive.stop(now)
        if self._then is not None:
            self._then.stop(now)

    def _resolved(self, perceived: Perceived, *, jumped: bool) -> Twist:
        """End the task, or go on with the drive for which one pose was needed."""
        self._end_drive(perceived, jumped=jumped)
        pose = perceived.estimate.pose
        if self._then is None:
            self.task.succeed(f"at ({pose.x:.2f}, {pose.y:.2f}), no other place is left")
            return STANDSTILL
        self.drive = self._then
        self.drive.resume(perceived.time)
        return self._step(self._then, perceived)

    def _step(self, drive: GoalDrive, perceived: Perceived) -> Twist:
        return step_in_doubt(drive, self._monitor, perceived, self._parameters)

    def _end_drive(self, perceived: Perceived, *, jumped: bool) -> None:
        """End the drive to a view, if there is one, and look again."""
        if self.drive is None:
            return
        if not jumped:
            # The place was seen, or could not be reached: choose another one next time.
            self._seen.append(self._view_in_odom)
        self.drive.task.cancel("the view is no longer needed")
        self.drive.stop(perceived.time)
        self.drive = None
        self._looking.start(perceived.time)

    def _look(self, perceived: Perceived) -> Twist:
        """Stand for a moment, then drive to the next view or give up."""
        self.task.report(f"{_rivals(perceived)}, looking", 0.0)
        if not perceived.motion.twist.stands:
            self._looking.start(perceived.time)
        if self._looking.elapsed(perceived.time) < VIEW_TIME:
            return STANDSTILL
        scan, estimate = perceived.newest(self._estimator.lidar, Scan), perceived.estimate
        if scan is None:
            self.task.fail(FailureCode.UNSUPPORTED, "there is no scan to tell the rivals apart by")
            return STANDSTILL
        why = ambiguity(estimate.pose, estimate.rivals)
        if self._views >= self._parameters.view_attempts:
            self.task.fail(
                FailureCode.AMBIGUOUS,
                f"{why} after {self._views} views; raise navigator.view_attempts or set the pose",
            )
            return STANDSTILL
        odometry = perceived.motion.pose
        avoided = [place.relative_to(odometry) for place in self._seen]
        view = self._estimator.best_view(scan, avoided)
        if view is None:
            self.task.fail(
                FailureCode.AMBIGUOUS,
                f"{why}, and no other place within reach shows a difference; look for a marker or "
                "set the pose",
            )
            return STANDSTILL
        self._views += 1
        self._view_in_odom = odometry.compose(view.motion)
        self.drive = self._make_drive(estimate.pose.compose(view.motion))
        self.drive.start(perceived.time)
        return STANDSTILL


def _rivals(perceived: Perceived) -> str:
    number = len(perceived.estimate.rivals)
    return f"{number} rival{'' if number == 1 else 's'} left"
