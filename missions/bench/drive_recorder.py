"""Figures of a drive that the report does not contain: smoothness of commands, goal accuracy."""

from __future__ import annotations

from math import sqrt

import numpy as np

from stack.telemetry.records import Event, Snapshot
from stack.telemetry.sinks import Sink
from stack.types import FloatArray, Pose2D, Twist


def is_end_of_motion(event: Event, status: str) -> bool:
    """Whether a task ended with a status that was to move the robot, unlike a plan."""
    fields = event.fields
    return event.kind == "task" and fields.get("status") == status and fields.get("moves") is True


class DriveRecorder(Sink):
    """A telemetry sink that records every step of a simulated run.

    Attributes:
        time: robot's clock, seconds.
        trace: true poses, one a step.
        reached: (goal, true pose) of every drive to a pose that succeeded.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.trace: list[Pose2D] = []
        self.reached: list[tuple[Pose2D, Pose2D]] = []
        self._goal: Pose2D | None = None
        self._is_recovery = False
        self._goal_reached: Pose2D | None = None
        self._commands: dict[float, Twist] = {}

    @property
    def turning(self) -> float:
        """Mean absolute change of the commanded angular velocity while driving, rad/s²."""
        periods, twists = self._driving()
        changes = np.abs(twists[:, 2, 2] - twists[:, 1, 2])
        return float(changes.sum() / periods.sum()) if len(periods) else 0.0

    @property
    def jerk(self) -> float:
        """Root mean square of the second change of the commanded velocity while driving, m/s³."""
        periods, twists = self._driving()
        seconds = twists[:, 2, :2] - 2.0 * twists[:, 1, :2] + twists[:, 0, :2]
        squares = (seconds**2).sum(axis=1) / periods**3
        return sqrt(float(squares.sum() / periods.sum())) if len(periods) else 0.0

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
        """Record a step. Of several snapshots of one time the last counts.

        While a step waits for a plan, snapshots with the command of the step before are published.
        """
        if snapshot.truth is not None:
            self.trace.append(snapshot.truth)
            if self._goal_reached is not None:
                self.reached.append((self._goal_reached, snapshot.truth))
        self._goal_reached = None
        if not self._is_recovery:  # `disambiguate` drives to views, which are no goals
            self._goal = snapshot.goal or self._goal
        if snapshot.time > 0.0:
            self._commands[snapshot.time] = snapshot.commanded
        self.time = snapshot.time

    def _driving(self) -> tuple[FloatArray, FloatArray]:
        """Return the steps in which the robot was to move.

        Returns:
            Their periods (n,), seconds, and the commands (n, 3, 3) of the two steps before and of
            the step: linear and lateral, m/s, and angular velocity, rad/s.
        """
        periods = np.diff([0.0, *self._commands])
        given = [(twist.linear, twist.lateral, twist.angular) for twist in self._commands.values()]
        twists = np.array([(0.0, 0.0, 0.0)] * 2 + given)
        steps = np.stack([twists[:-2], twists[1:-1], twists[2:]], axis=1)
        moves = steps.any(axis=(1, 2))
        return periods[moves], steps[moves]
