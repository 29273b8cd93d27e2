"""Reader of ROS bags with standard messages: rosbag2 (MCAP, SQLite) and rosbag1.

LaserScan, Odometry, Imu and TFMessage are read. Mounts of sensors come from the static transforms
base -> sensor; a lidar mounted upside down is turned over. Without an Odometry topic the transform
odom -> base is the odometry; without that too, the robot seems to stand. Stamps are those of the
headers, and those of the file where a header has none; messages are sorted by them within
REORDER_WINDOW seconds. The stamp of a LaserScan is that of its first beam, the stamp of a `Scan`
its middle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from math import atan2, degrees, inf, isfinite, pi
from pathlib import Path
from typing import Any

import numpy as np

from robots.logs.bag_reader import BagReader, damaged
from robots.logs.imu_mount import upright
from robots.logs.recording import (
    NOT_A_LOG,
    WHEELS,
    Event,
    Recording,
    in_order,
    observations,
    refuse,
    without_jumps,
)
from robots.logs.transforms import add_transforms, between
from stack.drivetrain.description import ImuDescription, LidarDescription
from stack.errors import InputError
from stack.frames.tree import FrameTree
from stack.types import FloatArray, Imu, Odometry, Pose2D, Scan, Twist, on_floor

REORDER_WINDOW = 1.0
MOST_TILT = np.radians(10.0)
"""Lidars that are tilted by more do not scan parallel to the floor."""

IMU_SAMPLES = 50
"""Messages of the IMU whose mean acceleration tells which way is up."""

MOST_SEARCHED = 5000
"""Messages among which the transforms are searched."""

SCAN, ODOMETRY, IMU, TF = (
    "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu",
    "tf2_msgs/msg/TFMessage",
)  # fmt: skip
BASES = ("base_link", "base_footprint", "base")
ODOM_FRAMES = ("odom", "odom_combined")


@dataclass(frozen=True)
class Topics:
    """Topics that are read; empty: all lidars, the first odometry, the first IMU.

    Attributes:
        lidars: the first one is the sensor `lidar`.
    """

    lidars: tuple[str, ...] = ()
    odometry: str = ""
    imu: str = ""


@dataclass(frozen=True, slots=True)
class _Mount:
    """A planar mount, and whether the sensor is upside down."""

    pose: Pose2D
    flipped: bool = False


@dataclass
class _Layout:
    """What a bag contains: topics by role, mounts and first scans by lidar.

    Attributes:
        lidars: name of each topic of a lidar.
        odometry: topic; empty: none.
        imu: topic; empty: none.
        transforms: topics of TFMessage.
        counts: number of messages by sensor.
        end: time after the last message, seconds.
    """

    lidars: dict[str, str]
    odometry: str
    imu: str
    transforms: list[str]
    counts: dict[str, int]
    end: float
    base: str = "base_link"
    mounts: dict[str, _Mount] = field(default_factory=dict)
    first_scans: dict[str, Any] = field(default_factory=dict)
    imu_turn: FloatArray = field(default_factory=lambda: np.eye(3))
    notes: list[str] = field(default_factory=list)


def read_bag(path: Path, topics: Topics = Topics()) -> Recording:
    """Read a ROS bag: a folder with metadata.yaml, or an .mcap, .db3 or .bag file.

    Raises:
        InputError: `rosbags` is not installed, or the bag is missing, damaged, or has neither scans
            nor odometry.
    """
    reader = BagReader(path)
    try:
        with reader:
            layout = _layout(reader, path, topics)
            _read_geometry(reader, layout)
    except InputError:
        raise
    except Exception as error:  # of a library that parses foreign files
        raise damaged(path, error) from error

    def events() -> Iterator[Event]:
        return in_order(without_jumps(_events(path, layout), path), REORDER_WINDOW)

    epoch = next((item.stamp for item in events() if isinstance(item.measurement, Odometry)), None)
    if epoch is None:
        raise refuse(path, NOT_A_LOG, "the bag has no odometry and no scans with a stamp")
    span = max(layout.end - epoch, 1e-3)
    lidars = {
        name: _description(layout, name, layout.counts[name] / span)
        for name in layout.lidars.values()
    }
    imu = ImuDescription(rate=max(layout.counts["imu"] / span, 0.01)) if layout.imu else None
    return Recording(
        path, "ROS bag", epoch, span, layout.counts, lidars, lambda: observations(events(), epoch),
        imu=imu, notes=tuple(layout.notes),
    )  # fmt: skip


def _layout(reader: BagReader, path: Path, topics: Topics) -> _Layout:
    """Choose the topics.

    Raises:
        InputError: a topic is not in the bag, or there are neither scans nor odometry.
    """
    counts = {name: count for name, (_, count) in reader.topics.items()}
    used: dict[str, list[str]] = {SCAN: [], ODOMETRY: [], IMU: [], TF: []}
    for name, (kind, count) in sorted(reader.topics.items()):
        if count and kind in used:
            used[kind].append(name)
    lidars = _wanted(path, topics.lidars, used[SCAN])
    odometry = _wanted(path, (topics.odometry,) if topics.odometry else (), used[ODOMETRY])
    imus = _wanted(path, (topics.imu,) if topics.imu else (), used[IMU])
    if not lidars and not odometry:
        found = ", ".join(sorted(counts)) or "none"
        sentence = "the bag has no LaserScan and no Odometry messages"
        raise refuse(path, NOT_A_LOG, sentence, f"its topics: {found}")
    names = {topic: _sensor_name(n, topic) for n, topic in enumerate(lidars)}
    chosen = {WHEELS: next(iter(odometry), ""), "imu": next(iter(imus), "")}
    measured = {name: counts[topic] for topic, name in names.items()}
    measured[WHEELS] = counts.get(chosen[WHEELS], 0)
    if chosen["imu"]:
        measured["imu"] = counts[chosen["imu"]]
    layout = _Layout(names, chosen[WHEELS], chosen["imu"], used[TF], measured, reader.end_time)
    for kind, sensor in ((ODOMETRY, WHEELS), (IMU, "imu")):
        others = [name for name in used[kind] if name != chosen[sensor]]
        if others:
            layout.notes.append(f"not used: {', '.join(others)}; {chosen[sensor]} is")
    return layout


def _wanted(path: Path, chosen: tuple[str, ...], found: list[str]) -> list[str]:
    for name in chosen:
        if name not in found:
            have = ", ".join(found) or "none"
            raise refuse(path, NOT_A_LOG, f"the bag has no such topic {name!r}", f"it has: {have}")
    return list(chosen) or found


def _sensor_name(number: int, topic: str) -> str:
    return "lidar" if number == 0 else topic.strip("/").replace("/", "_")


def _read_geometry(reader: BagReader, layout: _Layout) -> None:
    """Read the first scan of each lidar, the static transforms and the frame of the odometry."""
    wanted = {*layout.lidars, *(name for name in (layout.odometry, layout.imu) if name)}
    frames = FrameTree()
    base = ""
    static = [topic for topic in layout.transforms if "static" in topic] or layout.transforms
    for seen, (topic, _, message) in enumerate(reader.messages((*wanted, *static))):
        if not wanted and seen > MOST_SEARCHED:
            break
        if topic in static:
            add_transforms(frames, message)
        elif topic in wanted:
            wanted.discard(topic)
            if topic in layout.lidars:
                layout.first_scans[layout.lidars[topic]] = message
            elif topic == layout.odometry:
                base = message.child_frame_id.lstrip("/")
    known = [name for name in BASES if name in frames.names]
    layout.base = base or next(iter(known), "base_link")
    for name, scan in layout.first_scans.items():
        frame = scan.header.frame_id.lstrip("/")
        layout.mounts[name] = _mount(layout, name, between(frames, layout.base, frame), frame)
    if layout.imu:
        _read_imu_mount(reader, layout, frames)


def _read_imu_mount(reader: BagReader, layout: _Layout, frames: FrameTree) -> None:
    """Find how the IMU is turned, by its frame and the acceleration of its first messages."""
    frame = ""
    forces: list[tuple[float, float, float]] = []
    for _, _, message in islice(reader.messages([layout.imu]), IMU_SAMPLES):
        a, frame = message.linear_acceleration, message.header.frame_id.lstrip("/")
        force = float(a.x), float(a.y), float(a.z)
        if all(map(isfinite, force)):
            forces.append(force)
    known = between(frames, layout.base, frame)
    turn = None if known is None else known[:3, :3]
    mean = np.mean(forces or [(0.0, 0.0, 0.0)], axis=0)
    layout.imu_turn, note = upright(layout.imu, turn, mean)
    layout.notes += [note] if note else []


def _mount(layout: _Layout, name: str, matrix: FloatArray | None, frame: str) -> _Mount:
    if matrix is None:
        layout.notes.append(
            f"no transform {layout.base} -> {frame}: {name} is assumed at the base's origin"
        )
        return _Mount(Pose2D(0.0, 0.0))
    up = float(np.clip(matrix[2, 2], -1.0, 1.0))
    tilt = float(np.arccos(abs(up)))
    if tilt > MOST_TILT:
        layout.notes.append(f"{name} is tilted by {degrees(tilt):.0f} deg; it is used as level")
    return _Mount(on_floor(matrix), up < 0.0)


def _description(layout: _Layout, name: str, rate: float) -> LidarDescription:
    scan = layout.first_scans[name]
    spacing = abs(float(scan.angle_increment)) or 2.0 * pi / max(len(scan.ranges), 1)
    view = min(spacing * len(scan.ranges), 2.0 * pi)
    return LidarDescription(
        layout.mounts[name].pose, beams=min(max(round(2.0 * pi / spacing), 3), 4096),
        field_of_view=view, rate=max(rate, 0.01), range_min=max(float(scan.range_min), 0.0),
        range_max=float(scan.range_max), noise=0.01, dropout=0.0,
        rotation_time=min(abs(float(scan.time_increment)) * 2.0 * pi / spacing, 1.0),
    )  # fmt: skip


def _events(path: Path, layout: _Layout) -> Iterator[Event]:
    """Yield the messages of the bag as measurements, in the order of the file.

    Raises:
        InputError: a message is damaged.
    """
    topics = {*layout.lidars, layout.odometry, layout.imu}
    if not layout.odometry:
        topics |= set(layout.transforms)
    reader = BagReader(path)
    count = 0
    try:
        with reader:
            stands = not layout.odometry and not _has_odometry(reader, layout)
            for topic, logged, message in reader.messages(topics):
                count += 1
                if topic in layout.transforms:
                    yield from _tf_odometry(message, layout.base, logged)
                    continue
                stamp = _stamp(message.header, logged)
                if topic in layout.lidars:
                    name = layout.lidars[topic]
                    scan = _scan(message, stamp, layout.mounts[name])
                    first, last = scan.interval
                    if stands and first < last:
                        yield _standing(first)
                    yield Event(last, name, scan)
                    if stands:
                        yield _standing(last)
                elif topic == layout.odometry:
                    pose = _planar(message.pose.pose.position, message.pose.pose.orientation)
                    yield Event(stamp, WHEELS, Odometry(stamp, pose, Twist()))
                else:
                    yield Event(stamp, "imu", _imu(message, stamp, layout.imu_turn))
    except InputError:
        raise
    except Exception as error:
        raise damaged(path, error, f" after {count} messages") from error


def _standing(stamp: float) -> Event:
    """Return the odometry of a robot that stands."""
    return Event(stamp, WHEELS, Odometry(stamp, Pose2D(0.0, 0.0), Twist()))


def _has_odometry(reader: BagReader, layout: _Layout) -> bool:
    """Whether the transforms contain odom -> base; a note otherwise."""
    for number, (_, logged, message) in enumerate(reader.messages(layout.transforms)):
        if any(_tf_odometry(message, layout.base, logged)):
            return True
        if number > MOST_SEARCHED:
            break
    note = "the bag has no odometry: the robot seems to stand, only scans show its motion"
    if note not in layout.notes:
        layout.notes.append(note)
    return False


def _tf_odometry(message: Any, base: str, logged: float) -> Iterator[Event]:
    """Yield the transforms odom -> base of a TFMessage."""
    for item in message.transforms:
        parent, child = item.header.frame_id.lstrip("/"), item.child_frame_id.lstrip("/")
        if parent in ODOM_FRAMES and child in (base, *BASES):
            stamp = _stamp(item.header, logged)
            pose = _planar(item.transform.translation, item.transform.rotation)
            yield Event(stamp, WHEELS, Odometry(stamp, pose, Twist()))


def _stamp(header: Any, logged: float) -> float:
    stamp = header.stamp.sec + header.stamp.nanosec * 1e-9
    return float(stamp) if stamp > 0.0 else logged


def _planar(position: Any, q: Any) -> Pose2D:
    heading = atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    pose = Pose2D(float(position.x), float(position.y), heading)
    if not all(isfinite(value) for value in (pose.x, pose.y, pose.heading)):
        raise ValueError("an odometry pose is not finite")
    return pose


def _scan(message: Any, stamp: float, mount: _Mount) -> Scan:
    """Return a scan; REP 117: +inf is no return, -inf too near, NaN invalid."""
    ranges = np.array(message.ranges, np.float32)
    least, most = float(message.range_min), float(message.range_max)
    with np.errstate(invalid="ignore"):
        ranges[ranges < least] = np.nan
        ranges[ranges >= most] = inf
    start, spacing = float(message.angle_min), float(message.angle_increment)
    step = float(message.time_increment)
    if mount.flipped:  # seen from above, the beams run the other way
        start, spacing = -start, -spacing
    if spacing < 0.0:
        ranges = ranges[::-1].copy()
        start, spacing, step = start + spacing * (ranges.size - 1), -spacing, -step
    middle = stamp + 0.5 * float(message.time_increment) * (ranges.size - 1)
    return Scan(middle, ranges, start, spacing, least, most, mount.pose, step)


def _imu(message: Any, stamp: float, turn: FloatArray) -> Imu:
    """Return one sample, turned into the base frame."""
    w, a = message.angular_velocity, message.linear_acceleration
    return Imu(
        np.array([stamp]), (turn @ [w.x, w.y, w.z])[None, :], (turn @ [a.x, a.y, a.z])[None, :]
    )
