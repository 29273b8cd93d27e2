"""Logs of other kinds, with strange stamps, mounts and lines: each is named or read."""

import re
from math import pi

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots.logs.imu_mount import upright
from robots.logs.opening import open_log
from stack.errors import InputError
from stack.types import Imu, Pose2D
from tests.robots.logs.log_writers import BagWriter, flaser, odom

HERE = Pose2D(0.0, 0.0)
POINTER = (
    "version https://git-lfs.github.com/spec/v1\n"
    "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 123456\n"
)
SERVICE_EVENT = """\
builtin_interfaces/Time stamp
example_interfaces/srv/Add_Request[<=1] request
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: example_interfaces/srv/Add_Request
int64 a
"""
PYTHON = re.compile(r"Error|list index|could not convert|NoneType|b'|invalid literal|Traceback")
"""Words of Python's own messages."""


def refused(file):
    with pytest.raises(InputError) as refusal:
        list(open_log(file).play())
    return refusal.value.findings[0]


@pytest.mark.parametrize(
    ("stamps", "words", "line"),
    [
        ((0.0, 1.13486e9, 1.13486e9 + 1.0), "jump by 36 years at line 2", 2),
        ((10.0, 11.0, 11.0 + 7200.0), "jump by 2 hours at line 3", 3),
        ((200000.0, 200001.0, 10.0), "jump back by 2 days at line 3", 3),
    ],
)
def test_stamps_of_two_clocks_are_refused_with_their_line(tmp_path, stamps, words, line):
    file = tmp_path / "a.log"
    file.write_text("".join(odom(stamp, HERE) for stamp in stamps))
    finding = refused(file)
    assert (finding.code, finding.mark.line) == ("E502", line)
    assert words in finding.sentence


def test_a_pause_of_less_than_an_hour_is_played(tmp_path):
    file = tmp_path / "a.log"
    file.write_text("".join(odom(stamp, HERE) for stamp in (10.0, 11.0, 3000.0)))
    assert open_log(file).duration == pytest.approx(2990.0)


def test_a_bag_with_sensors_on_two_clocks_is_refused(tmp_path):
    """The odometry has simulated time, the scans have that of a computer."""
    writer = BagWriter(tmp_path / "bag")
    for n in range(5):
        writer.odometry(5.0 + 0.1 * n, HERE, base="base_link")
        writer.scan(1.7e9 + 0.1 * n, [2.0] * 12)
    writer.close()
    finding = refused(tmp_path / "bag")
    assert finding.code == "E502"
    assert "years at a measurement of" in finding.sentence


def test_a_bag_with_types_that_nobody_knows_is_read(tmp_path):
    """The events of a service: their definition refers to itself and is not complete."""
    writer = BagWriter(tmp_path / "bag")
    for n in range(5):
        writer.odometry(5.0 + 0.1 * n, HERE, base="base_link")
    connection = writer.writer.add_connection(
        "/add/_service_event", "example_interfaces/srv/Add_Event", msgdef=SERVICE_EVENT,
        rihs01="RIHS01_" + 64 * "0",
    )  # fmt: skip
    writer.writer.write(connection, int(5.2e9), bytes(16))
    writer.close()
    found = open_log(tmp_path / "bag")
    assert found.counts == {"wheels": 5}
    assert len(list(found.play())) == 5


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "a.db3", "a.clf", "a.log.gz"])
def test_a_git_lfs_pointer_is_called_so(tmp_path, name):
    (tmp_path / name).write_text(POINTER)
    finding = refused(tmp_path / name)
    assert finding.code == "E501"
    assert "pointer of Git LFS" in finding.sentence and "123456 bytes" in finding.sentence
    assert finding.hint == f"run: git lfs pull --include {name}"


def test_a_git_lfs_pointer_in_the_folder_of_a_bag_is_called_so(tmp_path):
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (tmp_path / "bag_0.mcap").write_text(POINTER)
    assert "pointer of Git LFS" in refused(tmp_path).sentence


@pytest.mark.parametrize("first", ["LASER_READING 2 1.0 2.0 0 0 0 5.0\n", "ODOM 0.1 0.2 0.3 5.0\n"])
def test_a_gfs_log_is_called_so(tmp_path, first):
    file = tmp_path / "a.gfs"
    file.write_text(first)
    finding = refused(file)
    assert finding.code == "E501"
    assert "GFS log" in finding.sentence and "gfs2log" in finding.hint


LINES = [
    flaser(10.0, np.full(180, 2.0), HERE).split(),
    odom(10.0, HERE).split(),
    "ROBOTLASER1 0 -1.57 3.14 1.57 80 0.01 0 3 2 2 2 0 0 0 0 0 0 0 0 0 0 0 0 10.0 h 10.0".split(),
]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    line=st.sampled_from(LINES), at=st.integers(1, 30),
    word=st.sampled_from(["", "x", "nan", "-1", "inf", "9" * 30, "1e400", "0", "é"]),
    cut=st.booleans(),
)  # fmt: skip
def test_a_damaged_line_is_read_or_refused_in_a_sentence(tmp_path_factory, line, at, word, cut):
    words = [*line[:at], word] if cut else [*line[:at], word, *line[at + 1 :]]
    file = tmp_path_factory.getbasetemp() / "damaged.log"
    file.write_text(odom(9.0, HERE) + " ".join(words) + "\n" + odom(11.0, HERE), "utf-8")
    try:
        list(open_log(file).play())
    except InputError as error:
        assert not PYTHON.search(error.findings[0].sentence), error.findings[0].sentence


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("kept", [0.02, 0.3, 0.6, 0.95])
def test_a_cut_bag_is_read_or_refused_without_the_words_of_python(tmp_path, storage, kept):
    writer = BagWriter(tmp_path / "bag", storage)
    for n in range(50):
        writer.odometry(5.0 + 0.1 * n, HERE, base="base_link")
    writer.close()
    file = next(item for item in (tmp_path / "bag").iterdir() if item.suffix != ".yaml")
    file.write_bytes(file.read_bytes()[: int(kept * file.stat().st_size)])
    finding = refused(tmp_path / "bag")
    assert finding.code in ("E501", "E502")
    assert not PYTHON.search(finding.sentence), finding.sentence


@given(st.floats(-pi, pi), st.floats(-pi / 2, pi / 2), st.floats(-2.0, 2.0))
def test_gravity_gives_the_yaw_rate_however_the_imu_is_turned(roll, pitch, rate):
    """Up in the frame of an IMU turned by roll and pitch; it turns about up."""
    up = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    turn, note = upright("/imu", None, 9.81 * up)
    turned = turn @ (rate * up)
    tilt = float(np.arccos(np.clip(up[2], -1.0, 1.0)))
    if np.degrees(tilt) > 20.01:
        assert turned == pytest.approx([0.0, 0.0, rate], abs=1e-9)
        assert "by gravity it is tilted" in note
    elif np.degrees(tilt) < 19.99:
        assert (turn == np.eye(3)).all() and "used as level" in note
    assert np.linalg.det(turn) == pytest.approx(1.0)


@pytest.mark.parametrize("up", [(0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
def test_an_imu_on_its_side_keeps_the_heading_of_a_circle(tmp_path, up):
    writer = BagWriter(tmp_path / "bag")
    for n in range(50):
        stamp = 5.0 + 0.02 * n
        writer.imu(stamp, 0.0, up=up, turning=tuple(0.25 * part for part in up))
        writer.odometry(stamp, Pose2D(0.0, 0.0, 0.005 * n), base="base_link")
    writer.close()
    found = open_log(tmp_path / "bag")
    assert any("by gravity" in note for note in found.notes)
    rates = np.concatenate(
        [imu.angular_velocity for item in found.play() for imu in item.of(Imu).values()]
    )
    assert rates[:, 2] == pytest.approx(0.25)


def test_an_imu_that_contradicts_its_transform_is_noted(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.static(4.9, "base_link", "imu_link", HERE)
    for n in range(10):
        writer.imu(5.0 + 0.02 * n, 0.0, up=(0.0, 1.0, 0.0))
        writer.odometry(5.0 + 0.02 * n, HERE, base="base_link")
    writer.close()
    (note,) = open_log(tmp_path / "bag").notes
    assert note == "by gravity /imu is tilted by 90 deg against its transform, which is used"
