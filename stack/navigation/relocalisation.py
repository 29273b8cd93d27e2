"""Global relocalisation: finds the pose anywhere on the map while the robot stands."""

from __future__ import annotations

from collections.abc import Callable

from stack.components import Estimator, Match
from stack.errors import NavigationError
from stack.navigation.following import standing
from stack.navigation.parameters import NavigationParameters
from stack.navigation.tasks import MotionExecutor, MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Pose2D, Scan, Twist


class Relocalisation(MotionExecutor):
    """Stands still, collects scans and lets the estimator match them with the whole map.

    Args:
        task: handle of the task.
        estimator: that searches the map.
        parameters: number of scans, and the time in which they must arrive.
        found: called with the pose before and the match.
    """

    def __init__(
        self, task: MotionTask, estimator: Estimator, parameters: NavigationParameters,
        found: Callable[[Pose2D, Match], None],
    ) -> None:  # fmt: skip
        super().__init__(task)
        self._estimator, self._found = estimator, found
        self._wanted, self._patience = parameters.search_scans, parameters.search_time
        self._views: list[tuple[Pose2D, Scan]] = []
        self._waiting = self.timers.new()
        self._standing_since: float | None = None

    def start(self, now: float) -> None:
        """Start to wait for scans."""
        self._waiting.start(now)

    def step(self, state: NavigationState) -> Twist:
        """Return standstill; end the task when there are enough scans."""
        if standing(state.odometry.twist):
            self._gather(state)
        self.task.report(f"scan {len(self._views)} of {self._wanted}", 0.0)
        if len(self._views) == self._wanted:
            self._match(state.odometry.pose)
        elif self._waiting.elapsed(state.time) >= self._patience:
            self.task.fail(
                FailureCode.LOST,
                f"received {len(self._views)} of {self._wanted} lidar scans while standing still "
                f"within {self._patience:g} s",
            )
        return STANDSTILL

    def _gather(self, state: NavigationState) -> None:
        """Store each scan that was taken while the robot stood."""
        if self._standing_since is None:
            self._standing_since = state.time
        newest = self._views[-1][1].stamp if self._views else self._standing_since - 1e-9
        if state.scan is not None and state.scan.stamp > newest:
            self._views.append((state.odometry.pose, state.scan))

    def _match(self, now: Pose2D) -> None:
        *earlier, (_, newest) = self._views
        views = [(pose.relative_to(now), scan) for pose, scan in earlier]
        before = self._estimator.estimate.pose
        try:
            match = self._estimator.localise_globally(newest, views)
        except NavigationError as error:
            self.task.fail(error.failure.code, error.failure.sentence)
            return
        self._found(before, match)
        pose = match.pose
        self.task.succeed(
            f"at ({pose.x:.2f}, {pose.y:.2f}), {match.fit:.0%} of the scans explained"
        )
