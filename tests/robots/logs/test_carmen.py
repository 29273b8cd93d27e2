"""CARMEN logs as observations: geometry, stamps, codes of the laser, damaged files."""

import gzip
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.logs.opening import open_log
from robots.logs.recording import in_order
from stack.errors import InputError
from stack.types import Pose2D, Scan
from tests.robots.logs.log_writers import flaser, odom, robotlaser
from tests.stack.sim.sim_rover import ROVER

RANGES = np.linspace(1.0, 2.79, 180)


def log(folder, *lines, name="a.log"):
    file = folder / name
    file.write_text("".join(lines))
    return file


def test_an_old_laser_has_the_geometry_of_its_number_of_readings(tmp_path):
    """180 readings of a SICK LMS are 1 deg apart from -90 deg on; the offset is a parameter."""
    ranges = RANGES.copy()
    ranges[:3] = 81.91, 81.83, 0.0
    ranges[3] = 81.82
    file = log(tmp_path, "# comment\n", "PARAM robot_frontlaser_offset 0.15\n",
               "PARAM robot_length 0.7\n", "PARAM robot_width 0.5\n",
               flaser(100.0, ranges, Pose2D(1.0, 2.0, 0.5)))  # fmt: skip
    found = open_log(file)
    (observation,) = found.play()
    scan = observation.measurements["lidar"]
    assert isinstance(scan, Scan)
    assert (scan.stamp, observation.time) == (0.0, 0.0)
    assert scan.mount == Pose2D(0.15, 0.0, 0.0)
    assert scan.angles[0] == pytest.approx(-pi / 2)
    assert scan.angles[-1] == pytest.approx(radians(89.0))
    assert np.isinf(scan.ranges[:2]).all() and np.isnan(scan.ranges[2])
    assert scan.ranges[3] == pytest.approx(81.82)
    assert observation.wheels.pose == Pose2D(1.0, 2.0, 0.5)
    robot = found.describe(ROVER)
    assert robot.name == "a"
    assert robot.lidar.mount.x == 0.15
    assert robot.footprint.points[:, 0].max() == pytest.approx(0.35)
    assert (robot.sonars, robot.camera, robot.body) == ({}, None, "replayed")


@pytest.mark.parametrize("code", [8.0, 29.99, 51.1, 120.0])
def test_a_code_for_no_return_that_the_log_does_not_state_is_found(tmp_path, code):
    """Walls lie at any distance; 2 % of the readings within 4 cm at the upper end do not."""
    rng = np.random.default_rng(1)
    lines = []
    for k in range(60):
        ranges = rng.uniform(0.5, 0.9 * code, 180)
        ranges[rng.random(180) < 0.02] = code + rng.uniform(-0.02, 0.02)
        lines.append(flaser(100.0 + k, ranges, Pose2D(0.0, 0.0)))
    found = open_log(log(tmp_path, *lines))
    scans = [observation.measurements["lidar"] for observation in found.play()]
    shares = [np.isinf(scan.ranges).mean() for scan in scans]
    assert np.mean(shares) == pytest.approx(0.02, abs=0.005)
    assert max(scan.ranges[np.isfinite(scan.ranges)].max() for scan in scans) < 0.91 * code
    assert any("taken for no return" in note for note in found.notes)


def test_far_walls_are_not_taken_for_a_code(tmp_path):
    rng = np.random.default_rng(2)
    lines = [flaser(100.0 + k, rng.uniform(0.5, 20.0, 180), Pose2D(0.0, 0.0)) for k in range(60)]
    found = open_log(log(tmp_path, *lines))
    assert all(np.isfinite(o.measurements["lidar"].ranges).all() for o in found.play())
    assert found.notes == ()


@pytest.mark.parametrize(
    ("count", "first", "spacing"), [(181, -90.0, 1.0), (361, -90.0, 0.5), (401, -50.0, 0.25)]
)
def test_spacing_of_other_numbers_of_readings(tmp_path, count, first, spacing):
    file = log(tmp_path, flaser(1.0, np.full(count, 3.0), Pose2D(0.0, 0.0)))
    (observation,) = open_log(file).play()
    scan = observation.measurements["lidar"]
    assert np.degrees(scan.angles[0]) == pytest.approx(first)
    assert np.degrees(scan.angle_increment) == pytest.approx(spacing)


def test_a_new_laser_states_its_geometry(tmp_path):
    mount = Pose2D(0.2, 0.05, 0.1)
    line = robotlaser(5.0, [1.0, 2.0, 8.0, 9.0], Pose2D(3.0, 1.0, 2.0), mount, start=-0.3,
                      spacing=0.2, range_max=8.0)  # fmt: skip
    (observation,) = open_log(log(tmp_path, line)).play()
    scan = observation.measurements["lidar"]
    assert (scan.angle_min, scan.angle_increment, scan.range_max) == (-0.3, 0.2, 8.0)
    assert scan.ranges.tolist() == [1.0, 2.0, np.inf, np.inf]
    assert scan.mount.distance_to(mount) < 1e-3
    assert scan.mount.heading == pytest.approx(0.1, abs=1e-4)


def test_messages_are_sorted_by_their_stamps_and_say_so(tmp_path):
    """Two computers disagree by 30 ms: the file is in the order of arrival."""
    stamps = [10.0, 10.2, 10.17, 10.4]
    file = log(tmp_path, *(flaser(t, RANGES, Pose2D(t - 10.0, 0.0)) for t in stamps))
    found = open_log(file)
    assert any("1 messages are older" in note for note in found.notes)
    times = [observation.time for observation in found.play()]
    assert times == pytest.approx([0.0, 0.17, 0.2, 0.4])
    assert (found.epoch, found.duration) == (10.0, pytest.approx(0.4))


def test_odometry_between_scans_and_the_velocity_from_it(tmp_path):
    file = log(tmp_path, odom(0.5, Pose2D(0.0, 0.0)), flaser(1.0, RANGES, Pose2D(0.1, 0.0)),
               odom(1.5, Pose2D(0.3, 0.0)))  # fmt: skip
    first, second, third = open_log(file).play()
    assert "lidar" not in first.measurements
    assert "lidar" in second.measurements
    assert second.wheels.twist.linear == pytest.approx(0.2)
    assert third.wheels.twist.linear == pytest.approx(0.4)


def test_a_compressed_log_with_a_rear_laser(tmp_path):
    file = tmp_path / "a.clf.gz"
    text = flaser(1.0, RANGES, Pose2D(0.0, 0.0)) + flaser(1.0, RANGES, Pose2D(0.0, 0.0), "RLASER")
    file.write_bytes(gzip.compress(text.encode()))
    found = open_log(file)
    assert list(found.lidars) == ["lidar", "rear_lidar"]
    mounts = [scan.mount.heading for item in found.play() for scan in item.of(Scan).values()]
    assert mounts == [0.0, pi]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the log is empty"),
        (b"hello\nworld\n", "it has no measurements"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "this is a picture"),
        (b"a" * 5000 + b"\0", "it is not text in lines"),
        (gzip.compress(flaser(1.0, RANGES, Pose2D(0.0, 0.0)).encode() * 50)[:-90], "compressed"),
        (b"FLASER 180 1.0 2.0\nODOM 0 0 0 0 0 0 1.0 h 1.0\n", "it has 2 of 180 readings"),
        (b"ODOM 0 nan 0 0 0 0 1.0 h 1.0\n", "its pose is not finite"),
        (b"ODOM 0 0\nODOM 0 0 0 0 0 0 1.0 h 1.0\n", "the ODOM message is damaged"),
    ],
    ids=["empty", "text", "picture", "no text", "cut gzip", "few readings", "NaN", "short"],
)
def test_a_wrong_file_is_refused_with_the_reason(tmp_path, content, words):
    file = tmp_path / "a.log"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as error:
        open_log(file)
    assert error.value.findings[0].mark.file == str(file)


def test_a_cut_last_line_is_left_out(tmp_path):
    """The logger was killed while it wrote."""
    whole = flaser(1.0, RANGES, Pose2D(0.0, 0.0))
    found = open_log(log(tmp_path, whole, whole[:200]))
    assert len(list(found.play())) == 1
    assert any("last line is incomplete" in note for note in found.notes)


def test_a_missing_log_suggests_the_most_similar(tmp_path):
    log(tmp_path, name="intel.log")
    with pytest.raises(InputError, match=r"no such log; did you mean 'intel\.log'"):
        open_log(tmp_path / "intl.log")


class _At:
    def __init__(self, stamp):
        self.stamp = stamp


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 40), max_size=40), st.integers(0, 10))
def test_events_within_the_window_are_sorted_and_none_is_lost(shifts, window):
    """Stamps that run backwards by at most the window come out in order, all of them."""
    stamps = [n + min(shift, window) for n, shift in enumerate(shifts)]
    out = [item.stamp for item in in_order(map(_At, stamps), window)]
    assert out == sorted(stamps)
