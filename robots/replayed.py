"""Replayed robot: the Body that plays the observations of a recording. Commands have no effect."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from stack.body import Body, BodyCommand, Replay
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.sim.pace import Pace
from stack.types import STANDSTILL, Measurement, Observation

LONGEST_REST = 0.25
"""Wall seconds: longest wait for the pace between two observations, e.g. in a gap of the log."""


class ReplayedBody(Body, Replay):
    """Plays observations in order, one for each control period; its clock is the recording's.

    After the recording the robot stands for some time with its last odometry, so that a mission can
    end what it began: optimise and save a map.

    Args:
        description: of the robot that was recorded.
        observations: in order.
        after: seconds that the robot stands after the last observation.
        pace: seconds of the recording per wall second; 0: as fast as possible.

    Raises:
        BodyError: there are no observations.
    """

    def __init__(
        self, description: RobotDescription, observations: Iterable[Observation], *,
        after: float = 0.0, pace: float = 0.0,
    ) -> None:  # fmt: skip
        self._description, self._after = description, after
        self._coming = iter(observations)
        first = next(self._coming, None)
        if first is None:
            raise BodyError("the recording has no observations")
        self._current, self._has_ended, self._is_over = first, False, False
        self._wheels = first.wheels
        self._pace = Pace(pace)

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Time of the current observation, seconds."""
        return self._current.time

    @property
    def recording_over(self) -> bool:
        """Whether the last observation of the recording was played."""
        return self._is_over

    @property
    def has_ended(self) -> bool:
        """Whether the last observation was played, and the time after it is over."""
        return self._has_ended

    def sense(self) -> Observation:
        """Return the current observation."""
        return self._current

    def command(self, command: BodyCommand) -> None:
        """Ignored: the motion is recorded."""

    def wait(self, period: float) -> None:
        """Go on to the next observation, whatever the period; keep the pace."""
        before = self._current.time
        following = next(self._coming, None)
        if following is not None:
            self._current = following
            self._wheels = following.wheels or self._wheels
        elif self._after > 0.0:
            self._is_over = True
            self._after -= period
            self._current = self._standing(before + period)
        else:
            self._is_over = self._has_ended = True
        self._pace.advance(self._current.time - before)
        self._pace.rest(LONGEST_REST)

    def close(self) -> None:
        """Nothing to close."""

    def _standing(self, time: float) -> Observation:
        """Return an observation of the robot that stands where the recording ended."""
        measured: dict[str, Measurement] = {}
        if self._wheels is not None:
            measured["wheels"] = replace(self._wheels, stamp=time, twist=STANDSTILL)
        return Observation(time, measured)
