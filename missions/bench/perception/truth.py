"""The robot's true poses during a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stack.telemetry.records import Event, RunInfo, Snapshot
from stack.types import FloatArray, Pose2D


class TruthRecorder:
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

    def open(self, info: RunInfo) -> None:
        """Do nothing."""

    def event(self, event: Event) -> None:
        """Do nothing."""

    def wants_snapshot(self, time: float) -> bool:
        """Return True: every step is recorded."""
        return True

    def snapshot(self, snapshot: Snapshot) -> None:
        """Record a step; the last step arrives twice and counts once."""
        if snapshot.truth is not None and snapshot.time > self.time:
            self.times.append(snapshot.time)
            self.poses.append(snapshot.truth)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Do nothing."""
