"""The localisation of a robot that the stack drives: asks the estimator."""

from __future__ import annotations

from stack.components import Estimator
from stack.frames.buffer import TransformBuffer
from stack.navigation.navigator import Navigator
from stack.navigation.relocalisation import Relocalisation, report_pose
from stack.navigation.tasks import Emit, MotionTask
from stack.robot import Localisation
from stack.types import CurrentStep, Pose2D, PoseEstimate, Scan


class StackLocalisation(Localisation):
    """Answers from the estimator of the pose.

    Args:
        estimator: of the pose.
        navigator: stands while the pose is searched.
        frames: poses by time stamp.
        now: what the step has perceived.
        emit: called with (kind, text, level="info", **fields) for each event.
    """

    def __init__(
        self, estimator: Estimator, navigator: Navigator, frames: TransformBuffer,
        now: CurrentStep, emit: Emit,
    ) -> None:  # fmt: skip
        self._estimator, self._navigator, self._frames = estimator, navigator, frames
        self._now, self._emit = now, emit

    @property
    def estimate(self) -> PoseEstimate:
        return self._estimator.estimate

    def fit_at(self, pose: Pose2D) -> float:
        scan = self._now.perceived.newest(self._estimator.lidar, Scan)
        return 0.0 if scan is None else self._estimator.fit_at(pose, scan)

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        before = self.pose
        self._estimator.set_pose(pose, position_deviation, heading_deviation)
        report_pose(self._emit, before, pose, source)

    def relocalise(self) -> MotionTask:
        activities = self._navigator.activities
        task = activities.task("relocalise", while_lost=True)
        executor = Relocalisation(task, self._estimator, self._frames, self._emit)
        activities.start(executor, "recovery", "searching for the pose on the whole map")
        return task
