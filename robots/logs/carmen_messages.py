"""Messages of a CARMEN log: one line each, and what a log contains of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robots.logs.recording import DAMAGED_LOG, NOT_A_LOG, refuse
from stack.types import Pose2D

FLASER_SENSORS = {b"FLASER": "lidar", b"RLASER": "rear_lidar"}
ROBOTLASER_SENSORS = {b"ROBOTLASER1": "lidar", b"ROBOTLASER2": "rear_lidar"}

GFS_KINDS = (b"LASER_READING", b"ODO_UPDATE", b"SM_UPDATE", b"SCANMATCH", b"NEFF", b"RESAMPLE")
GFS_ODOM = 5
"""Words of its ODOM messages: `ODOM x y theta stamp`."""

GFS = "this is a GFS log, the result of GMapping, not a CARMEN log"


class _Damaged(Exception):
    """A message cannot be read; the text continues "the message is damaged: …"."""


@dataclass(frozen=True, slots=True)
class Laser:
    """Geometry of a laser: direction of the first reading and spacing (rad), range limit (m)."""

    readings: int
    start: float
    spacing: float
    range_max: float
    mount: Pose2D


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings of a laser as in the file, and its geometry if the message has it."""

    sensor: str
    ranges: NDArray[np.float32]
    laser: Laser | None


Measured = list[tuple[float, int, Readings | Pose2D]]
"""Stamp, number of the line, and what was measured: a pose of the odometry, or readings."""


@dataclass
class Content:
    """What a log contains, in the order of its lines."""

    measured: Measured = field(default_factory=list)
    parameters: dict[str, str] = field(default_factory=dict)
    ignored: dict[str, int] = field(default_factory=dict)
    cut: bool = False


def add_message(content: Content, line: bytes, file: Path, number: int) -> None:
    """Add one line; a line without its end is the last one of a logger that was killed."""
    words = line.split()
    if not words or words[0].startswith(b"#"):
        return
    kind = words[0]
    try:
        if kind in GFS_KINDS or (kind == b"ODOM" and len(words) == GFS_ODOM and line[-1:] == b"\n"):
            raise refuse(file, NOT_A_LOG, GFS, "convert it with GMapping's gfs2log", number)
        if kind in FLASER_SENSORS:
            content.measured += _old_laser(FLASER_SENSORS[kind], words, number)
        elif kind in ROBOTLASER_SENSORS:
            content.measured += _robot_laser(ROBOTLASER_SENSORS[kind], words, number)
        elif kind == b"ODOM":
            content.measured.append((_stamp(words, 7), number, _pose(words, 1)))
        elif kind == b"PARAM" and len(words) >= 3:
            content.parameters[_text(words[1])] = _text(words[2])
        elif kind.isascii() and kind.decode().isidentifier() and len(content.ignored) < 100:
            word = kind.decode()
            content.ignored[word] = content.ignored.get(word, 0) + 1
    except _Damaged as error:
        if not line.endswith(b"\n"):
            content.cut = True
            return
        sentence = f"the {kind.decode()} message is damaged: {error}"
        raise refuse(file, DAMAGED_LOG, sentence, "remove the line", number) from None


def _old_laser(sensor: str, words: list[bytes], number: int) -> Measured:
    """Read `FLASER n readings… x y theta odom_x odom_y odom_theta stamp host logger_stamp`."""
    count = _count(words, 1)
    ranges = _numbers(words, 2, count)
    at = 2 + count
    stamp, pose = _stamp(words, at + 6), _pose(words, at + 3)
    return [(stamp, number, Readings(sensor, ranges, None)), (stamp, number, pose)]


def _robot_laser(sensor: str, words: list[bytes], number: int) -> Measured:
    """Read `ROBOTLASER1 type start fov spacing range_max accuracy mode n readings… m remissions…
    laser_pose robot_pose tv rv forward side turn stamp host logger_stamp`.
    """  # noqa: D205
    start, spacing, range_max = (_float(words, n) for n in (2, 4, 5))
    if not 0.0 < spacing < inf or not np.isfinite(start) or not range_max > 0.0:
        raise _Damaged(f"a spacing of {spacing:g} rad and a range of {range_max:g} m")
    count = _count(words, 8)
    ranges = _numbers(words, 9, count)
    at = 9 + count
    at += 1 + _count(words, at)
    laser, robot = _pose(words, at), _pose(words, at + 3)
    stamp = _stamp(words, at + 11)
    mount = laser.relative_to(robot)
    mount = Pose2D(round(mount.x, 4), round(mount.y, 4), round(mount.heading, 5))
    readings = Readings(sensor, ranges, Laser(count, start, spacing, range_max, mount))
    return [(stamp, number, readings), (stamp, number, robot)]


def _numbers(words: list[bytes], start: int, count: int) -> NDArray[np.float32]:
    found = words[start : start + count]
    if len(found) != count or count < 1:
        raise _Damaged(f"it has {len(found)} of {count} readings")
    try:
        return np.array(found, dtype="S").astype(np.float32)
    except ValueError:
        raise _Damaged("a reading is not a number") from None


def _pose(words: list[bytes], at: int) -> Pose2D:
    x, y, heading = (_float(words, at + n) for n in range(3))
    if not np.isfinite((x, y, heading)).all():
        raise _Damaged("its pose is not finite")
    return Pose2D(x, y, heading)


def _stamp(words: list[bytes], at: int) -> float:
    """Return the stamp of the sender, or else that of the logger, seconds."""
    stamp, logged = _float(words, at), _float(words, at + 2) if len(words) > at + 2 else 0.0
    stamp = stamp if stamp > 0.0 else logged
    if not np.isfinite(stamp):
        raise _Damaged("its stamp is not finite")
    return stamp


def _word(words: list[bytes], at: int) -> bytes:
    if not 0 <= at < len(words):
        raise _Damaged(f"it has only {len(words)} words")
    return words[at]


def _float(words: list[bytes], at: int) -> float:
    word = _word(words, at)
    try:
        return float(word)
    except ValueError:
        raise _Damaged(f"{_shown(word)} is not a number") from None


def _count(words: list[bytes], at: int) -> int:
    word = _word(words, at)
    if not word.isdigit():
        raise _Damaged(f"{_shown(word)} is not a number of readings")
    return int(word)


def _shown(word: bytes) -> str:
    return repr(_text(word[:20]))


def _text(word: bytes) -> str:
    return word.decode("ascii", "replace")
