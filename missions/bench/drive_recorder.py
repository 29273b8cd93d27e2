"""What of a drive no report holds: how the commands changed, and how well goals were met."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot, sqrt
from typing import Any

from stack.telemetry.records import Event, RunInfo, Snapshot
from stack.types import STANDSTILL, Pose2D, Twist


class DriveRecorder:
    """A telemetry sink that looks at every step of a simulated run.

    Attributes:
        time: robot's clock, seconds.
        reached: (goal, true pose) whenever a drive to a pose was said to have succeeded.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.reached: list[tuple[Pose2D, Pose2D]] = []
        self._goal: Pose2D | None = None
        self._met: Pose2D | None = None
        self._before, self._twist, self._last = STANDSTILL, STANDSTILL, 0.0
        self._moving, self._turning, self._jerk_squared = 0.0, 0.0, 0.0

    @property
    def turning(self) -> float:
        """Mean absolute change of the commanded angular velocity while driving, rad/s²."""
        return self._turning / self._moving if self._moving else 0.0

    @property
    def jerk(self) -> float:
        """Root mean square of the second change of the commanded velocity while driving, m/s³."""
        return sqrt(self._jerk_squared / self._moving) if self._moving else 0.0

    def open(self, info: RunInfo) -> None:
        """Nothing to prepare."""

    def event(self, event: Event) -> None:
        """Note when a goal is met; what a recovery succeeds at is no goal."""
        if event.kind in ("goal", "recovery"):
            self._goal = None
        elif event.kind == "task" and event.fields.get("status") == "succeeded":
            self._met, self._goal = self._goal, None

    def wants_snapshot(self, time: float) -> bool:
        """Each step's."""
        return True

    def snapshot(self, snapshot: Snapshot) -> None:
        """Take in a step; the last one comes twice."""
        if self._met is not None and snapshot.truth is not None:
            self.reached.append((self._met, snapshot.truth))
        self._met = None
        self._goal = snapshot.goal or self._goal
        if snapshot.time > self._last:
            self._command(snapshot.commanded, snapshot.time - self._last)
        self.time = self._last = snapshot.time

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Nothing to close."""

    def _command(self, twist: Twist, period: float) -> None:
        before, now = self._before, self._twist
        self._before, self._twist = now, twist
        if STANDSTILL == twist == now == before:
            return
        self._moving += period
        self._turning += abs(twist.angular - now.angular)
        second = hypot(
            twist.linear - 2.0 * now.linear + before.linear,
            twist.lateral - 2.0 * now.lateral + before.lateral,
        )
        self._jerk_squared += (second / period**2) ** 2 * period
