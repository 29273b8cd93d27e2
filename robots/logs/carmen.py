"""Reader of CARMEN logs (.log, .clf, also compressed with gzip).

Format: http://carmen.sourceforge.net, module logger. A message is one line: FLASER and RLASER (old
front and rear laser), ROBOTLASER1 and ROBOTLASER2 (with geometry), ODOM, PARAM. Others are ignored.

* The order of a file is the order in which a logger received the messages. Stamps of the sending
  program are used, and messages are sorted by them: a file may contain stamps that run backwards,
  where they were inferred or computers disagree.
* FLASER has no geometry: 180 or 181 readings are 1 deg apart, 360 or 361 readings 0.5 deg, 401
  readings 0.25 deg; other numbers share 180 deg. The first reading is at the right end. The sensor
  is `robot_frontlaser_offset` in front of the base.
* SICK lasers report errors and missing returns as the readings 8183 to 8191 of their unit: 81.83 m
  and more in centimetres. They are no returns. A reading of 0 is invalid.
* Readings of FLASER that shift against the turns of the robot run from left to right.
* Other lasers have a code of their own, which the log does not tell. Many readings at the upper
  end, with hardly any just below them, are one: walls are at any distance.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from itertools import pairwise
from math import pi, radians
from pathlib import Path
from typing import BinaryIO

import numpy as np

from robots.logs.beam_order import runs_clockwise
from robots.logs.carmen_messages import Content, Laser, Readings, add_message
from robots.logs.recording import (
    DAMAGED_LOG,
    LONGEST_GAP,
    NOT_A_LOG,
    WHEELS,
    Event,
    Recording,
    observations,
    refuse,
    refuse_jump,
)
from stack.documents.files import open_regular
from stack.drivetrain.description import LidarDescription
from stack.types import FloatArray, Footprint, Odometry, Pose2D, Scan, Twist

GZIP = b"\x1f\x8b"

LOG_BYTES = 1 << 30
"""Of the text of a log: it is sorted in memory."""

LINE_BYTES = 1 << 20

FIRST_ERROR_READING = 8183
"""Readings of a SICK LMS from here on are error codes, in units of its resolution."""

CODE_WIDTH, CODE_GAP = 0.2, 0.5
"""Metres: by which readings of a code for no return differ, and below them that are compared."""

CODE_SHARE, CODE_DENSITY = 0.001, 50.0
"""Share of all readings that a code has at least; readings a metre, of those a metre below it."""

SPACINGS = {180: 1.0, 181: 1.0, 201: 0.5, 360: 0.5, 361: 0.5, 401: 0.25, 721: 0.25}
"""Degrees between the readings of an FLASER line, by their number."""

OFFSETS = {
    "lidar": ("robot_frontlaser_offset", "robot_front_laser_offset"),
    "rear_lidar": ("robot_rearlaser_offset", "robot_rear_laser_offset"),
}


def read_carmen_log(file: Path) -> Recording:
    """Read a CARMEN log.

    Raises:
        InputError: the file is missing, not a CARMEN log, or damaged; with the line.
    """
    content = _read(file)
    poses = sum(isinstance(value, Pose2D) for _, _, value in content.measured)
    if not content.measured:
        hint = "expected lines that begin with FLASER, ROBOTLASER1 or ODOM"
        raise refuse(file, NOT_A_LOG, "this is not a CARMEN log: it has no measurements", hint)
    if not poses:
        raise refuse(file, NOT_A_LOG, "the log has no odometry: no FLASER, ROBOTLASER1 or ODOM")
    stamps = np.array([stamp for stamp, _, _ in content.measured])
    _check_gaps(content, stamps, file)
    backwards = int(np.count_nonzero(np.diff(stamps) < 0.0))
    repeated = sum(count - len(found) for count, found in _stamps_of_scans(content))
    first, last = float(stamps.min()), float(stamps.max())
    factory = _ScanFactory(content)
    span = max(last - first, 1e-3)
    lidars, counts = {}, {WHEELS: poses}
    for name, number in sorted(factory.counts.items()):
        lidars[name], counts[name] = factory.description(name, number / span), number
    return Recording(
        file, "CARMEN log", first, last - first, counts, lidars,
        lambda: observations(_events(content, factory), first),
        footprint=_footprint(content.parameters),
        notes=(*factory.notes, *_notes(content, backwards, repeated)),
    )  # fmt: skip


def _check_gaps(content: Content, stamps: FloatArray, file: Path) -> None:
    """Refuse stamps that are further apart than LONGEST_GAP, sorted; with the line of a jump.

    Raises:
        InputError: there are such stamps.
    """
    if np.diff(np.sort(stamps)).max(initial=0.0) <= LONGEST_GAP:
        return
    steps = np.diff(stamps)
    at = int(np.flatnonzero(np.abs(steps) > LONGEST_GAP)[0])
    raise refuse_jump(file, float(steps[at]), "the log", content.measured[at + 1][1])


def _read(file: Path) -> Content:
    content = Content()
    try:
        with open_regular(file) as raw:
            for number, line in enumerate(_lines(_unpacked(raw), file), 1):
                add_message(content, line, file, number)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise refuse(file, DAMAGED_LOG, f"the compressed file is damaged: {error}") from None
    except OSError as error:
        raise refuse(file, "E001", f"cannot be read: {error.strerror}") from None
    return content


def _unpacked(raw: BinaryIO) -> BinaryIO:
    magic = raw.read(2)
    raw.seek(0)
    if magic != GZIP:
        return raw
    unpacked: BinaryIO = gzip.GzipFile(fileobj=raw)  # type: ignore[assignment]
    return unpacked


def _lines(stream: BinaryIO, file: Path) -> Iterator[bytes]:
    """Yield lines of at most LINE_BYTES, LOG_BYTES in all."""
    total = 0
    while line := stream.readline(LINE_BYTES):
        total += len(line)
        if len(line) == LINE_BYTES or b"\0" in line:
            raise refuse(file, NOT_A_LOG, "this is not a CARMEN log: it is not text in lines")
        if total > LOG_BYTES:
            raise refuse(file, "E002", f"more than {LOG_BYTES} bytes of text; cut the log")
        yield line


class _ScanFactory:
    """Scans of a log, with the geometry of its lasers.

    Attributes:
        counts: number of scans by sensor.
        notes: about what the log does not state.
    """

    def __init__(self, content: Content) -> None:
        self._parameters = content.parameters
        self._codes: dict[str, float] = {}
        self._clockwise: set[str] = set()
        self._lasers: dict[tuple[str, int], Laser] = {}
        self._first: dict[str, Laser] = {}
        self.counts: dict[str, int] = {}
        found = [value for _, _, value in content.measured if isinstance(value, Readings)]
        self.notes: list[str] = []
        for sensor in sorted({item.sensor for item in found if item.laser is None}):
            old = [i.ranges for i in found if i.laser is None and i.sensor == sensor]
            self._codes[sensor] = self._first_code(sensor, np.concatenate(old))
            if runs_clockwise(self._with_poses(content, sensor), radians(_spacing(old[0].size))):
                self._clockwise.add(sensor)
                self.notes.append(f"{sensor}: the readings run clockwise, as turns show")
        for item in found:
            self._first.setdefault(item.sensor, self._laser(item))
            self.counts[item.sensor] = self.counts.get(item.sensor, 0) + 1

    def scan(self, stamp: float, readings: Readings) -> Scan:
        """Return a scan."""
        laser, ranges = self._laser(readings), readings.ranges.copy()
        ranges[ranges >= laser.range_max] = np.inf
        ranges[~(ranges > 0.0)] = np.nan
        if readings.laser is None and readings.sensor in self._clockwise:
            ranges = ranges[::-1]
        return Scan(
            stamp, ranges, laser.start, laser.spacing, 0.0, laser.range_max, laser.mount
        )  # fmt: skip

    def description(self, sensor: str, rate: float) -> LidarDescription:
        """Return the description of a laser, from its first scan."""
        laser = self._first[sensor]
        view = min(laser.spacing * laser.readings, 2.0 * pi)
        beams = min(max(round(2.0 * pi / laser.spacing), 3), 4096)
        return LidarDescription(
            laser.mount, beams=beams, field_of_view=view, rate=max(rate, 0.01), range_min=0.0,
            range_max=laser.range_max, noise=0.01, dropout=0.0,
        )  # fmt: skip

    def _laser(self, readings: Readings) -> Laser:
        return readings.laser or self._guessed(readings.sensor, readings.ranges.size)

    def _guessed(self, sensor: str, readings: int) -> Laser:
        """Return the geometry of an FLASER or RLASER line with this number of readings."""
        key = (sensor, readings)
        if key not in self._lasers:
            spacing = _spacing(readings)
            start = -spacing * (readings // 2)
            heading = pi if sensor == "rear_lidar" else 0.0
            mount = Pose2D(self._offset(sensor), 0.0, heading)
            limit = self._codes[sensor]
            self._lasers[key] = Laser(readings, radians(start), radians(spacing), limit, mount)
        return self._lasers[key]

    def _with_poses(self, content: Content, sensor: str) -> Iterator[tuple[FloatArray, Pose2D]]:
        """Yield the readings of a sensor up to its limit, with the pose of their line."""
        for (_, _, value), (_, _, pose) in pairwise(content.measured):
            if isinstance(value, Readings) and value.sensor == sensor and isinstance(pose, Pose2D):
                yield np.where(value.ranges < self._codes[sensor], value.ranges, np.nan), pose

    def _offset(self, sensor: str) -> float:
        for name in OFFSETS[sensor]:
            if name in self._parameters:
                return _as_number(self._parameters[name]) or 0.0
        return 0.0

    def _first_code(self, sensor: str, ranges: FloatArray) -> float:
        """Return the range from which readings are codes for no return, metres."""
        ranges = ranges[np.isfinite(ranges)]
        largest = float(ranges.max(initial=0.0))
        for unit in (0.001, 0.01):
            if FIRST_ERROR_READING * unit <= largest <= 8191.5 * unit:
                return FIRST_ERROR_READING * unit
        code = ranges >= largest - CODE_WIDTH
        below = (ranges >= largest - CODE_WIDTH - CODE_GAP) & ~code
        count, usual = int(np.count_nonzero(code)), np.count_nonzero(below) / CODE_GAP
        if count < CODE_SHARE * ranges.size or count / CODE_WIDTH < CODE_DENSITY * usual:
            return largest + 1.0
        first = float(ranges[code].min())
        self.notes.append(
            f"{sensor}: {count} readings of {first:.2f} m and more are taken for no return; hardly "
            "any are just below"
        )
        return first


def _spacing(readings: int) -> float:
    """Return the degrees between the readings of an FLASER line."""
    return SPACINGS.get(readings, 180.0 / max(readings - 1, 1))


def _events(content: Content, factory: _ScanFactory) -> Iterator[Event]:
    """Yield the messages sorted by their stamps; a scan precedes the pose of its line."""
    for stamp, _, value in sorted(content.measured, key=lambda entry: entry[0]):
        if isinstance(value, Pose2D):
            yield Event(stamp, WHEELS, Odometry(stamp, value, Twist()))
        else:
            yield Event(stamp, value.sensor, factory.scan(stamp, value))


def _stamps_of_scans(content: Content) -> Iterator[tuple[int, set[float]]]:
    """Yield the number of scans of each sensor, and their stamps."""
    scans = [(v.sensor, stamp) for stamp, _, v in content.measured if isinstance(v, Readings)]
    for sensor in {name for name, _ in scans}:
        stamps = [stamp for name, stamp in scans if name == sensor]
        yield len(stamps), set(stamps)


def _notes(content: Content, backwards: int, repeated: int) -> tuple[str, ...]:
    notes = []
    if repeated:
        notes.append(f"{repeated} scans have the stamp of another one; used in the file's order")
    if backwards:
        notes.append(f"{backwards} messages are older than the one before; sorted by stamp")
    if content.ignored:
        names = ", ".join(f"{name} ({count})" for name, count in sorted(content.ignored.items()))
        notes.append(f"ignored messages: {names}")
    if content.cut:
        notes.append("the last line is incomplete; it is left out")
    return tuple(notes)


def _footprint(parameters: dict[str, str]) -> Footprint | None:
    """Return the rectangle of `robot_length` and `robot_width`; None without them."""
    length, width = (
        _as_number(parameters.get(name, "")) for name in ("robot_length", "robot_width")
    )
    if length is None or width is None or not (0.05 < length < 20.0 and 0.05 < width < 20.0):
        return None
    x, y = 0.5 * length, 0.5 * width
    return Footprint(np.array([[x, y], [-x, y], [-x, -y], [x, -y]]))


def _as_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
