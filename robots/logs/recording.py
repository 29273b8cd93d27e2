"""What a log contains, and its measurements as observations of a replayed robot.

A replayed robot needs odometry in every observation. So each odometry measurement makes an
observation, together with the measurements since the one before. Several measurements of one sensor
in that time make observations of their own, with the odometry interpolated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stack.drivetrain.description import (
    ImuDescription,
    LidarDescription,
    RobotDescription,
)
from stack.errors import Finding, InputError, Mark
from stack.types import Footprint, Imu, Measurement, Observation, Odometry, Pose2D, Twist
from stack.types.geometry import wrap_angle

NOT_A_LOG, DAMAGED_LOG = "E501", "E502"

WHEELS = "wheels"

SENSOR_LOG = "sensor log"
"""Format of the recordings of treepilot itself."""

LONGEST_GAP = 3600.0
"""Seconds between two stamps of a drive; longer ones are of different clocks or different days."""

SHORTEST_STEP = 1e-3
"""Seconds between two odometry poses below which no velocity is computed from them."""


@dataclass(frozen=True, slots=True)
class Event:
    """A measurement of a log, its sensor, and when it was complete in the log's time, seconds.

    The scan of a lidar that turns is complete with its last beam, after its own stamp.
    """

    stamp: float
    sensor: str
    measurement: Measurement


@dataclass(frozen=True)
class Recording:
    """A log that can be played.

    Attributes:
        file: of the log.
        format: `CARMEN log`, `ROS bag` or SENSOR_LOG.
        epoch: time of the log, seconds since 1970 as a rule, at which the body's clock is 0.
        duration: seconds.
        counts: number of measurements by sensor name.
        lidars: derived from the scans, by sensor name.
        imu: whether there are inertial samples, as a description.
        footprint: from the parameters in the log; None if it states none.
        notes: what was left out or changed, for the user.
        about: metadata of a sensor log; empty for other formats.
        play: returns the observations, on the body's clock.
    """

    file: Path
    format: str
    epoch: float
    duration: float
    counts: Mapping[str, int]
    lidars: Mapping[str, LidarDescription]
    play: Callable[[], Iterator[Observation]]
    imu: ImuDescription | None = None
    footprint: Footprint | None = None
    notes: tuple[str, ...] = ()
    about: Mapping[str, str] = field(default_factory=dict)

    def describe(self, robot: RobotDescription) -> RobotDescription:
        """Return a robot with the sensors of the log; drive and limits stay.

        The robot of a sensor log is not changed.

        Args:
            robot: the footprint is replaced if the log states one.
        """
        if self.format == SENSOR_LOG:
            return robot
        main = next(iter(self.lidars), "")
        rest = {name: lidar for name, lidar in self.lidars.items() if name != main}
        renamed = {} if main in ("", "lidar") else {main: self.lidars[main]}
        return replace(
            robot,
            name=self.file.name.partition(".")[0],
            footprint=self.footprint or robot.footprint,
            lidar=self.lidars.get("lidar") if main == "lidar" else None,
            lidars={**renamed, **rest},
            sonars={}, camera=None, imu=self.imu, body="replayed",
        )  # fmt: skip


def refuse(file: Path, code: str, sentence: str, hint: str = "", line: int = 1) -> InputError:
    """Return the error to raise about a log."""
    return InputError([Finding(Mark(str(file), line), code, sentence, hint)])


def refuse_jump(file: Path, seconds: float, sensor: str, line: int = 1) -> InputError:
    """Return the error to raise about stamps that are further apart than LONGEST_GAP.

    Args:
        file: of the log.
        seconds: from one stamp to the next.
        sensor: of the second one.
        line: of the second one.
    """
    size, units = abs(seconds), {"year": 365.25 * 86400.0, "day": 86400.0, "hour": 3600.0}
    unit = next(name for name, length in units.items() if size >= length)
    count = round(size / units[unit])
    way = "" if seconds > 0.0 else " back"
    place = f"at line {line}" if line > 1 else f"at a measurement of {sensor}"
    sentence = f"the stamps jump{way} by {count} {unit}{'s' if count > 1 else ''} {place}"
    hint = "two clocks, or two drives: correct the stamps, or cut the log there"
    return refuse(file, DAMAGED_LOG, sentence, hint, line)


def without_jumps(events: Iterable[Event], file: Path) -> Iterator[Event]:
    """Yield events; refuse a stamp that is LONGEST_GAP away from the one before.

    Raises:
        InputError: of the first such stamp.
    """
    before: float | None = None
    for event in events:
        if before is not None and abs(event.stamp - before) > LONGEST_GAP:
            raise refuse_jump(file, event.stamp - before, event.sensor)
        before = event.stamp
        yield event


def observations(events: Iterable[Event], epoch: float) -> Iterator[Observation]:
    """Return the observations of a log.

    Args:
        events: in the order of their stamps. Those before the first odometry are left out: there is
            no pose for them.
        epoch: stamp at which the body's clock is 0.
    """
    last: Odometry | None = None
    waiting: list[Event] = []
    for event in events:
        if not isinstance(event.measurement, Odometry):
            waiting.append(event)
            continue
        odometry = _with_twist(last, event.measurement, epoch)
        if last is None:
            waiting = [item for item in waiting if item.stamp >= event.stamp]
        yield from _between(waiting, last or odometry, odometry, epoch)
        waiting, last = [], odometry
    if last is not None and waiting:
        end = replace(last, stamp=max(last.stamp, waiting[-1].stamp - epoch), twist=Twist())
        yield from _between(waiting, last, end, epoch)


def in_order(events: Iterable[Event], window: float) -> Iterator[Event]:
    """Return events in the order of their stamps; equal stamps keep their order.

    Args:
        events: nearly in order.
        window: seconds by which a stamp may be older than the newest one; others are left out.
    """
    from heapq import heappop, heappush

    heap: list[tuple[float, int, Event]] = []
    newest, released = -np.inf, -np.inf
    for number, event in enumerate(events):
        if event.stamp < released:
            continue
        heappush(heap, (event.stamp, number, event))
        newest = max(newest, event.stamp)
        while heap and heap[0][0] <= newest - window:
            released = heap[0][0]
            yield heappop(heap)[2]
    while heap:
        yield heappop(heap)[2]


def _between(
    waiting: list[Event], before: Odometry, after: Odometry, epoch: float
) -> Iterator[Observation]:
    """Yield the observations of the measurements between two odometry poses, and of the second."""
    measured: dict[str, Measurement] = {}
    samples: list[Imu] = []
    now = before.stamp
    for event in waiting:
        measurement = _moved(event.measurement, epoch)
        if isinstance(measurement, Imu):
            samples.append(measurement)
            continue
        if event.sensor in measured:
            wheels = _interpolated(before, after, now)
            inertial = [item for item in samples if item.stamp <= now]
            samples = samples[len(inertial) :]
            yield Observation(now, {WHEELS: wheels, **_joined(inertial), **measured})
            measured = {}
        measured[event.sensor], now = measurement, event.stamp - epoch
    yield Observation(after.stamp, {WHEELS: after, **_joined(samples), **measured})


def _moved(measurement: Measurement, epoch: float) -> Measurement:
    """Return the measurement with its stamps on the body's clock."""
    if isinstance(measurement, Imu):
        return replace(measurement, stamps=measurement.stamps - epoch)
    record: Any = measurement  # a frozen dataclass
    moved: Measurement = replace(record, stamp=measurement.stamp - epoch)
    return moved


def _joined(samples: list[Imu]) -> dict[str, Measurement]:
    if not samples:
        return {}
    return {
        "imu": Imu(
            np.concatenate([item.stamps for item in samples]),
            np.concatenate([item.angular_velocity for item in samples]),
            np.concatenate([item.linear_acceleration for item in samples]),
        )
    }


def _with_twist(last: Odometry | None, odometry: Odometry, epoch: float) -> Odometry:
    """Return odometry on the body's clock, with the mean velocity since the last one."""
    stamp = odometry.stamp - epoch
    if last is None:
        return replace(odometry, stamp=stamp, twist=Twist())
    elapsed = stamp - last.stamp
    if elapsed < SHORTEST_STEP:
        return replace(odometry, stamp=stamp, twist=last.twist)
    moved = odometry.pose.relative_to(last.pose)
    twist = Twist(moved.x / elapsed, moved.heading / elapsed, moved.y / elapsed)
    return replace(odometry, stamp=stamp, twist=twist)


def _interpolated(before: Odometry, after: Odometry, stamp: float) -> Odometry:
    """Return the odometry at a stamp between two; the base moves along the chord."""
    span = after.stamp - before.stamp
    share = 1.0 if span <= 0.0 else min(max((stamp - before.stamp) / span, 0.0), 1.0)
    one, other = before.pose, after.pose
    pose = Pose2D(
        one.x + share * (other.x - one.x),
        one.y + share * (other.y - one.y),
        wrap_angle(one.heading + share * wrap_angle(other.heading - one.heading)),
    )
    return Odometry(stamp, pose, after.twist)
