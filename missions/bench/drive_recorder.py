"""Figures of a drive that the report does not contain: smoothness of commands, goal accuracy."""

from __future__ import annotations

from math import hypot, sqrt

from stack.telemetry.records import Event, Snapshot
from stack.telemetry.sinks import Sink
from stack.types import STANDSTILL, Pose2D, Twist


def is_end_of_motion(event: Event, status: str) -> bool:
    """Whether a task ended with a status that was to move the robot, unlike a plan."""
    fields = event.fields
    return event.kind == "task" and fields.get("status") == status and fields.get("moves") is True


class DriveRecorder(Sink):
    """A telemetry sink that records every step of a simulated run.

    Attributes:
        time: robot's clock, seconds.
        reached: (goal, true pose) of every drive to a pose that succeeded.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.reached: list[tuple[Pose2D, Pose2D]] = []
        self._goal: Pose2D | None = None
        self._is_recovery = False
        self._goal_reached: Pose2D | None = None
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

    def event(self, event: Event) -> None:
        """Record that a goal was reached; the success of a recovery or a plan does not count."""
        if event.kind in ("goal", "recovery"):
            self._goal, self._is_recovery = None, event.kind == "recovery"
        elif is_end_of_motion(event, "succeeded"):
            self._goal_reached, self._goal = self._goal, None

    def wants_snapshot(self, time: float) -> bool:
        """Return True: every step is recorded."""
        return True

    def snapshot(self, snapshot: Snapshot) -> None:
        """Record a step; the last step arrives twice and counts once."""
        if self._goal_reached is not None and snapshot.truth is not None:
            self.reached.append((self._goal_reached, snapshot.truth))
        self._goal_reached = None
        if not self._is_recovery:  # `disambiguate` drives to views, which are no goals
            self._goal = snapshot.goal or self._goal
        if snapshot.time > self._last:
            self._command(snapshot.commanded, snapshot.time - self._last)
        self.time = self._last = snapshot.time

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
