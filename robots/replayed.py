"""Replayed robot: the Body that plays the observations of a recording. Commands have no effect."""

from __future__ import annotations

from collections.abc import Iterable

from stack.body import Body, BodyCommand
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.types import Observation


class ReplayedBody(Body):
    """Plays observations in order, one for each control period; its clock is the recording's.

    Args:
        description: of the robot that was recorded.
        observations: in order.

    Raises:
        BodyError: there are no observations.
    """

    def __init__(self, description: RobotDescription, observations: Iterable[Observation]) -> None:
        self._description = description
        self._coming = iter(observations)
        first = next(self._coming, None)
        if first is None:
            raise BodyError("the recording has no observations")
        self._current, self._has_ended = first, False

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Time of the current observation, seconds."""
        return self._current.time

    @property
    def has_ended(self) -> bool:
        """Whether the last observation was played."""
        return self._has_ended

    def sense(self) -> Observation:
        """Return the current observation."""
        return self._current

    def command(self, command: BodyCommand) -> None:
        """Ignored: the motion is recorded."""

    def wait(self, period: float) -> None:
        """Go on to the next observation, whatever the period."""
        following = next(self._coming, None)
        if following is None:
            self._has_ended = True
        else:
            self._current = following

    def close(self) -> None:
        """Nothing to close."""
