"""Global relocalisation: finds the pose anywhere on the map while the robot stands."""

from __future__ import annotations

from math import degrees

from stack.components import Estimator
from stack.errors import NavigationError
from stack.frames.buffer import TransformBuffer
from stack.navigation.disambiguation import ambiguity
from stack.navigation.tasks import Emit, MotionExecutor, MotionTask
from stack.types import STANDSTILL, FailureCode, Perceived, Pose2D, Scan, Twist, wrap_angle

SEARCH_SCANS, SEARCH_TIME = 3, 5.0
"""Scans that a search of the whole map matches together, and seconds in which they must arrive."""


class Relocalisation(MotionExecutor):
    """Stands still, collects scans and lets the estimator match them with the whole map.

    Args:
        task: handle of the task.
        estimator: searches the map.
        frames: with the odometry at the stamps of the scans.
        emit: receives the event with the new pose.
    """

    while_lost = True

    def __init__(
        self, task: MotionTask, estimator: Estimator, frames: TransformBuffer, emit: Emit
    ) -> None:  # fmt: skip
        super().__init__(task)
        self._estimator, self._emit = estimator, emit
        self._frames = frames
        self._scans: list[Scan] = []
        self._waiting = self.timers.new()
        self._standing_since: float | None = None

    def start(self, now: float) -> None:
        self._waiting.start(now)

    def step(self, perceived: Perceived) -> Twist:
        """Return standstill; end the task when there are enough scans."""
        if perceived.motion.twist.stands:
            self._gather(perceived)
        self.task.report(f"scan {len(self._scans)} of {SEARCH_SCANS}", 0.0)
        if len(self._scans) == SEARCH_SCANS:
            self._match()
        elif self._waiting.elapsed(perceived.time) >= SEARCH_TIME:
            self.task.fail(
                FailureCode.LOST,
                f"received {len(self._scans)} of {SEARCH_SCANS} lidar scans while standing still "
                f"within {SEARCH_TIME:g} s",
            )
        return STANDSTILL

    def _gather(self, perceived: Perceived) -> None:
        """Store each scan that was taken while the robot stood."""
        if self._standing_since is None:
            self._standing_since = perceived.time
        newest = self._scans[-1].stamp if self._scans else self._standing_since - 1e-9
        scan = perceived.newest(self._estimator.lidar, Scan)
        if scan is not None and scan.stamp > newest:
            self._scans.append(scan)

    def _match(self) -> None:
        *earlier, newest = self._scans
        before = self._estimator.estimate.pose
        try:
            views = [(self._frames.motion(newest.stamp, scan.stamp), scan) for scan in earlier]
            match = self._estimator.localise_globally(newest, views)
        except NavigationError as error:
            self.task.fail(error.failure.code, error.failure.sentence)
            return
        report_pose(self._emit, before, match.pose, "lidar")
        pose, rivals = match.pose, self._estimator.estimate.rivals
        if rivals:
            why = f"{ambiguity(pose, rivals)}; look for a marker or run `disambiguate`"
            self.task.fail(FailureCode.AMBIGUOUS, why)
            return
        self.task.succeed(
            f"at ({pose.x:.2f}, {pose.y:.2f}), {match.fit:.0%} of the scans explained"
        )


def report_pose(emit: Emit, before: Pose2D, pose: Pose2D, source: str) -> None:
    """Report that the pose was found or set by a source, and how far it is from that before."""
    jump, turn = before.distance_to(pose), abs(wrap_angle(pose.heading - before.heading))
    emit(
        "relocalised",
        f"now at ({pose.x:.2f}, {pose.y:.2f}, {degrees(pose.heading):.0f} deg) by {source}, "
        f"{jump:.2f} m and {degrees(turn):.0f} deg from the previous pose",
        by=source, jump=round(jump, 3), turn=round(turn, 4),
    )  # fmt: skip
