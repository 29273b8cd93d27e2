"""What a run was: the robot's true poses, and how it ended."""

from __future__ import annotations

import numpy as np

from missions.bench.bench import FAILED, PASSED
from missions.execution.report import Report
from stack.telemetry.records import MissionState, Snapshot
from stack.telemetry.sinks import Sink
from stack.types import FloatArray, Pose2D


class TruthRecorder(Sink):
    """A telemetry sink that records the true pose at every step.

    Attributes:
        times: seconds on the robot's clock.
        poses: map frame.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.poses: list[Pose2D] = []

    @property
    def points(self) -> FloatArray:
        """(n, 2) metres."""
        return np.array([(pose.x, pose.y) for pose in self.poses]).reshape(-1, 2)

    @property
    def time(self) -> float:
        """Seconds on the robot's clock."""
        return self.times[-1] if self.times else 0.0

    def wants_snapshot(self, time: float) -> bool:
        """Return True: every step is recorded."""
        return True

    def snapshot(self, snapshot: Snapshot) -> None:
        """Record a step; the last step arrives twice and counts once."""
        if snapshot.truth is not None and snapshot.time > self.time:
            self.times.append(snapshot.time)
            self.poses.append(snapshot.truth)


def ending(report: Report) -> tuple[str, str]:
    """Return the status of a run that passes with the mission's success, and the cause."""
    if report.status == MissionState.SUCCESS:
        return PASSED, ""
    return FAILED, report.reason or str(report.status)
