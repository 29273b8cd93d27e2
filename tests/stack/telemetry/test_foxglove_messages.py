"""Foxglove's messages, as Google's protobuf reads them."""

from dataclasses import replace

import numpy as np
import pytest

from stack.frames.buffer import TransformBuffer
from stack.frames.deskew import deskew
from stack.telemetry.foxglove.messages import nanoseconds, scan_message, stamp_of
from stack.types import Odometry, Pose2D, Scan, Twist
from tests.stack.telemetry.foxglove_reader import end_points, message_class, seconds


def decoded(message):
    schema = type(message).get_schema()
    return message_class(schema.name, schema.data).FromString(message.encode())


@pytest.mark.parametrize("time", [0.0, 0.05, 12.999_999_999_6, 86_400.25])
def test_stamps_are_whole_nanoseconds_of_the_robots_clock(time):
    assert nanoseconds(time) == round(time * 1e9)
    stamp = stamp_of(time)
    assert (stamp.sec, stamp.nsec) == divmod(round(time * 1e9), 1_000_000_000)


@pytest.fixture
def frames():
    """Odometry of a robot that drives with 0.5 m/s and turns with 1 rad/s for 0.2 s."""
    buffer = TransformBuffer()
    for step in range(21):
        time = 0.01 * step
        pose = Pose2D(0.5 * np.sin(time), 0.5 * (1.0 - np.cos(time)), time)
        buffer.add(Odometry(time, pose, Twist(0.5, 1.0)))
    return buffer


@pytest.mark.parametrize("near", [(), slice(0, 12), slice(100, 260), slice(340, 360)])
def test_the_scan_of_a_turning_lidar_keeps_the_places_of_its_points(frames, near):
    """Also with something 0.3 m beside the robot, whose bearings the motion changes most.

    A scan takes 0.1 s, so that its first and last beam are 0.05 s from its stamp, in which the
    robot moves by 2.5 cm.
    """
    ranges = np.full(360, 6.0, np.float32)
    ranges[list(range(360))[near] if near else []] = 0.3
    ranges[200:220] = np.inf
    turning = Scan(0.1, ranges, -np.pi, 2 * np.pi / 360, 0.1, 10.0, Pose2D(0.1, 0.0), 0.1 / 360)
    scan = deskew(turning, frames)
    assert scan.bearings is not None
    message = decoded(scan_message(scan))
    away = np.linalg.norm(end_points(message) - scan.points(), axis=1)
    assert away.max() < 0.03
    assert seconds(message.timestamp) == pytest.approx(0.1)


def test_a_scan_of_one_beam_has_one_direction():
    scan = Scan(0.0, np.ones(1, np.float32), 0.4, 0.0, 0.1, 5.0)
    for one in (scan, replace(scan, bearings=np.array([0.4]))):
        message = decoded(scan_message(one))
        assert (message.start_angle, message.end_angle) == (0.4, 0.4)
