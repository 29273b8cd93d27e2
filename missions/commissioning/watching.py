"""Watching a body for some seconds, standing or with a constant velocity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

from stack.body import Body, BodyCommand
from stack.types import STANDSTILL, Imu, Measurement, Observation, Twist

PERIOD = 0.02
"""Seconds between two commands. Of a sensor that is faster some measurements are not seen."""

M = TypeVar("M", bound=Measurement)


@dataclass(frozen=True, slots=True)
class Watched:
    """What a body measured in some seconds."""

    observations: tuple[Observation, ...]

    @property
    def seconds(self) -> float:
        """Length on the body's clock; 0 without observations."""
        seen = self.observations
        return seen[-1].time - seen[0].time if seen else 0.0

    def of(self, sensor: str, kind: type[M]) -> list[tuple[float, M]]:
        """Return the measurements of a sensor with the times at which they were received."""
        return list(self._of(sensor, kind))

    def _of(self, sensor: str, kind: type[M]) -> Iterator[tuple[float, M]]:
        for observation in self.observations:
            measured = observation.named(sensor, kind)
            if measured is not None:
                yield observation.time, measured

    def stamps(self, sensor: str) -> list[tuple[float, float]]:
        """Return the time of receipt and the stamp of each measurement of a sensor, seconds.

        Of an IMU, those of each sample.
        """
        found: list[tuple[float, float]] = []
        for observation in self.observations:
            measured = observation.measurements.get(sensor)
            if isinstance(measured, Imu):
                found += [(observation.time, stamp) for stamp in measured.stamps.tolist()]
            elif measured is not None:
                found.append((observation.time, measured.stamp))
        return found


def watch(
    body: Body, seconds: float, twist: Twist = STANDSTILL, *, pictures: bool = False
) -> Watched:
    """Command a velocity for some seconds, and return what was measured meanwhile.

    The robot goes on with that velocity until its next command, or until it stops by itself.

    Args:
        body: the robot.
        seconds: on the body's clock.
        twist: velocity, base frame.
        pictures: whether the cameras take pictures.

    Raises:
        BodyError: the robot does not respond.
    """
    command = BodyCommand(twist, capture=pictures, depth=pictures)
    seen, end = [], body.time + seconds - 0.5 * PERIOD
    while True:
        seen.append(body.sense())
        if body.time >= end:
            return Watched(tuple(seen))
        body.command(command)
        body.wait(PERIOD)
