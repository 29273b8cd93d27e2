"""Finding the pose anywhere on the map, from a stand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from stack.errors import NavigationError
from stack.navigation.following import standing
from stack.navigation.tasks import MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Pose2D, PoseEstimate, Scan, Twist

SCANS = 3
"""Scans matched together; more of the same view only average the noise."""

SCAN_PATIENCE = 5.0
"""Seconds in which the robot must have come to a stand and the scans must have come in."""


class Match(Protocol):
    """A pose that explains the scans."""

    @property
    def pose(self) -> Pose2D:
        """Map frame."""
        ...

    @property
    def fit(self) -> float:
        """Share of the scans explained, in [0, 1]."""
        ...


class Estimator(Protocol):
    """What says where the robot is."""

    @property
    def estimate(self) -> PoseEstimate:
        """Pose, covariance and health now, map frame."""
        ...

    def start(self, pose: Pose2D, position_deviation: float, heading_deviation: float) -> None:
        """Be around a pose of the map frame; standard deviations in metres and radians."""
        ...

    def fit_at(self, pose: Pose2D, scan: Scan) -> float:
        """Health that a scan would have at another pose, in [0, 1]."""
        ...

    def relocalise_globally(self, scan: Scan, earlier: Sequence[tuple[Pose2D, Scan]] = ()) -> Match:
        """Start anew at the one place that explains the scans.

        Args:
            scan: the newest.
            earlier: scans from before, each with the base's pose then in the base's frame of now.

        Raises:
            NavigationError: LOST when no place fits, AMBIGUOUS when several do.
        """
        ...


class Relocalisation:
    """Stands still, gathers scans and asks the estimator where on the map they were taken."""

    def __init__(
        self, task: MotionTask, estimator: Estimator, found: Callable[[Pose2D, Match], None]
    ) -> None:
        self.task = task
        self._estimator, self._found = estimator, found
        self._views: list[tuple[Pose2D, Scan]] = []
        self._deadline: float | None = None
        self._standing_since: float | None = None

    def advance(self, state: NavigationState) -> Twist:
        """Standstill; ends the task once there are scans enough."""
        if self._deadline is None:
            self._deadline = state.time + SCAN_PATIENCE
        if standing(state.odometry.twist):
            self._gather(state)
        self.task.report(f"scan {len(self._views)} of {SCANS}", 0.0)
        if len(self._views) == SCANS:
            self._match(state.odometry.pose)
        elif state.time >= self._deadline:
            self.task.fail(
                FailureCode.LOST,
                f"{len(self._views)} of {SCANS} lidar scans came in within {SCAN_PATIENCE:g} s "
                "of standing still",
            )
        return STANDSTILL

    def _gather(self, state: NavigationState) -> None:
        """Keep a scan taken wholly while standing, once."""
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
            match = self._estimator.relocalise_globally(newest, views)
        except NavigationError as error:
            self.task.fail(error.failure.code, error.failure.sentence)
            return
        self._found(before, match)
        pose = match.pose
        self.task.succeed(
            f"at ({pose.x:.2f}, {pose.y:.2f}), {match.fit:.0%} of the scans explained"
        )
