"""Logs with faults: the map stays as exact as without them, and a note says what was found.

A drive of a minute around a block, 181 beams of 1 degree, odometry that drives 2 % and turns 3 %
too far. The error of a map is the mean distance of the keyframes from the truth.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from robots.logs.opening import open_log
from stack.mapping.slam.mapper import Mapper
from stack.types import FloatArray, Pose2D, Scan
from tests.robots.logs.log_writers import flaser
from tests.stack.mapping.slam.drives import line
from tests.stack.mapping.slam.rooms import RING, ranges_at

EPOCH, PERIOD = 1000.0, 0.25
ANGLES = np.radians(np.arange(-90.0, 91.0))
ROUTE = ((1.0, 5.0), (1.0, 1.0), (13.0, 1.0), (13.0, 9.0), (1.0, 9.0), (1.0, 1.0), (5.0, 1.0))


@dataclass(frozen=True)
class Line:
    """A line of the log, and the truth."""

    stamp: float
    odometry: Pose2D
    ranges: FloatArray
    truth: Pose2D


def driven(*further: tuple[float, float]) -> list[Line]:
    rng = np.random.default_rng(5)
    poses = line(*ROUTE, *further, step=0.25)
    odometry, found = Pose2D(0.0, 0.0), []
    for k, (before, pose) in enumerate(pairwise([poses[0], *poses])):
        moved = pose.relative_to(before)
        odometry = odometry.compose(Pose2D(1.02 * moved.x, moved.y, 1.03 * moved.heading))
        ranges = ranges_at(RING, pose, ANGLES) + rng.normal(0.0, 0.01, ANGLES.size)
        found.append(Line(EPOCH + PERIOD * k, odometry, ranges, pose))
    return found


def mapped(lines: list[Line], file) -> tuple[float, str]:
    """Map a log as a mission does; return the error of the map, and all notes."""
    file.write_text("".join(flaser(one.stamp, one.ranges, one.odometry) for one in lines))
    log, mapper = open_log(file), Mapper(keep_trajectory=True)
    mapper.start(lines[0].truth)
    for observation in log.play():
        scan = observation.named("lidar", Scan)
        if scan is not None:
            mapper.add(scan.stamp, observation.wheels.pose, scan)
    stamps = np.array([one.stamp for one in lines])
    errors = []
    for keyframe in mapper.graph.keyframes.values():
        same = np.flatnonzero(np.abs(stamps - keyframe.stamp - log.epoch) < 1e-5)
        errors.append(min(keyframe.pose.distance_to(lines[k].truth) for k in same))
    return float(np.mean(errors)), "; ".join((*log.notes, *mapper.take_notes()))


@pytest.fixture(scope="module")
def lines():
    return driven()


@pytest.fixture(scope="module")
def clean(lines, tmp_path_factory):
    error, notes = mapped(lines, tmp_path_factory.mktemp("log") / "clean.log")
    assert error < 0.05 and notes == ""
    return error


def lost_scans(lines):
    rng = np.random.default_rng(1)
    return [one for one in lines if rng.random() > 0.1]


def gap(lines):
    """3 s without any line, on the way around a corner."""
    return [one for one in lines if not 7.0 < one.stamp - EPOCH < 10.0]


def repeated(lines):
    return [replace(one, stamp=lines[k - k % 3].stamp) for k, one in enumerate(lines)]


def backwards(lines):
    """The clock is set back by 1 s in the middle."""
    middle = len(lines) // 2
    return [replace(one, stamp=one.stamp - (k > middle)) for k, one in enumerate(lines)]


def late(lines):
    return [replace(one, odometry=lines[max(0, k - 1)].odometry) for k, one in enumerate(lines)]


def reset(lines):
    start = lines[100].odometry
    return [
        one if k < 100 else replace(one, odometry=one.odometry.relative_to(start))
        for k, one in enumerate(lines)
    ]


def jump(lines):
    away = Pose2D(4.0, -3.0, np.radians(60.0))
    return [
        one if k < 100 else replace(one, odometry=away.compose(one.odometry))
        for k, one in enumerate(lines)
    ]


def far_jump(lines):
    """A search as wide as the error of such a motion would take all memory."""
    return [
        one if k < 100 else replace(one, odometry=Pose2D(5e3, 0.0, 2.0).compose(one.odometry))
        for k, one in enumerate(lines)
    ]


def code(lines):
    """The lidar reports 31.99 m for no return: for 2 % of the beams, at random."""
    rng = np.random.default_rng(2)
    return [
        replace(one, ranges=np.where(rng.random(one.ranges.size) < 0.02, 31.99, one.ranges))
        for one in lines
    ]


def mirrored(lines):
    return [replace(one, ranges=one.ranges[::-1]) for one in lines]


FAULTS = {
    lost_scans: "", gap: "no scan for 3.", repeated: "have the stamp of another one",
    backwards: "are older than the one before", late: "odometry is one scan late",
    reset: "odometry reports a motion of", jump: "odometry reports a motion of",
    far_jump: "odometry reports a motion of", code: "taken for no return",
    mirrored: "run clockwise",
}  # fmt: skip


@pytest.mark.parametrize(("fault", "note"), FAULTS.items(), ids=[f.__name__ for f in FAULTS])
def test_a_fault_of_a_log_is_noted_and_leaves_the_map_exact(lines, clean, tmp_path, fault, note):
    error, notes = mapped(fault(lines), tmp_path / "fault.log")
    assert error < 1.2 * clean + 0.002, notes
    assert note in notes and bool(notes) == bool(note)


def test_a_restart_of_the_odometry_in_a_gap_is_joined_by_the_scans(tmp_path):
    """3 s without any line, in which the robot drives on and its odometry begins again at zero.

    Where the robot is after it only the scans can tell, when it comes back to the corridors before.
    """
    lines = driven((13.0, 1.0), (13.0, 8.0))
    first = next(k for k, one in enumerate(lines) if one.stamp >= EPOCH + 33.0)
    start = lines[first].odometry
    found = [
        one if k < first else replace(one, odometry=one.odometry.relative_to(start))
        for k, one in enumerate(lines)
        if k >= first or one.stamp < EPOCH + 30.0
    ]
    error, notes = mapped(found, tmp_path / "restart.log")
    assert "the scans fit neither odometry nor the map" in notes
    assert error < 0.03
