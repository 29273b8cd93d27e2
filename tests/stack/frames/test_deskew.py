"""Deskewed scans of a lidar that moves while it turns, against the walls of a room."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.description import LidarDescription
from stack.frames.buffer import TransformBuffer
from stack.frames.deskew import Deskewer, deskew
from stack.sim.scene_state import SceneState
from stack.sim.sensors.lidar import Lidar
from stack.types import STANDSTILL, Observation, Odometry, Pose2D, Scan
from tests.stack.sim.sim_rover import square_room

PERIOD, HALF = 0.01, 4.0
PERFECT = LidarDescription(
    Pose2D(0.15, 0.05, 0.3), beams=360, noise=0.0, dropout=0.0, rotation_time=0.1
)


def driven(linear: float, lateral: float, angular: float) -> list[tuple[float, Pose2D]]:
    pose, trail = Pose2D(0.4, -0.3, 1.0), [(0.0, Pose2D(0.4, -0.3, 1.0))]
    for step in range(1, 41):
        pose = pose.compose(Pose2D(linear * PERIOD, lateral * PERIOD, angular * PERIOD))
        trail.append((step * PERIOD, pose))
    return trail


def distance_to_walls(points: np.ndarray) -> np.ndarray:
    return np.abs(np.abs(points).max(axis=1) - HALF)


@settings(deadline=None, max_examples=40)
@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(-4.0, 4.0))
def test_end_points_are_on_the_walls(linear, lateral, angular):
    """At 4 rad/s and 2 m/s, raw end points are up to 1 m off: 0.2 rad at 5 m."""
    trail = driven(linear, lateral, angular)
    scan = Lidar(PERFECT, square_room(HALF), 1).scan(trail, SceneState(), 1, 0.4)
    frames = TransformBuffer()
    for stamp, pose in trail:
        frames.add(Odometry(stamp, pose, STANDSTILL))
    assert scan.stamp == pytest.approx(0.4 - 0.05, abs=2e-4)
    points = frames.pose_at("odom", scan.stamp).transform(deskew(scan, frames).points())
    # chords of 10 ms at 4 rad/s and float32 ranges leave less than 2 mm
    assert distance_to_walls(points).max() < 0.002


def test_a_turning_lidar_is_wrong_without_deskewing():
    trail = driven(0.0, 0.0, 4.0)
    scan = Lidar(PERFECT, square_room(HALF), 1).scan(trail, SceneState(), 1, 0.4)
    frames = TransformBuffer()
    for stamp, pose in trail:
        frames.add(Odometry(stamp, pose, STANDSTILL))
    points = frames.pose_at("odom", scan.stamp).transform(scan.points())
    assert distance_to_walls(points).max() > 0.3


def test_a_moving_cast_of_a_standing_lidar_is_the_cast_of_one_instant():
    still = [(0.1 * n, Pose2D(0.4, -0.3, 1.0)) for n in range(5)]
    at_once = LidarDescription(PERFECT.mount, beams=360, noise=0.0, dropout=0.0)
    world = square_room(HALF)
    people = np.array([[1.0, 1.0, 0.3], [-2.0, 0.5, 0.2]])
    turned, instant = (
        Lidar(d, world, 1).scan(still, SceneState(people), 1, 0.4) for d in (PERFECT, at_once)
    )
    assert turned.ranges == pytest.approx(instant.ranges, abs=1e-5)
    assert (turned.time_increment, instant.time_increment) == (pytest.approx(0.1 / 360), 0.0)


def turning_scan(stamp, turn=0.1):
    return Scan(
        stamp, np.ones(4, np.float32), 0.0, pi / 2, 0.1, 9.0, time_increment=turn / 3,
    )  # fmt: skip


def test_a_scan_of_one_instant_is_not_copied_and_one_before_odometry_is_dropped_and_counted():
    frames, deskewer = TransformBuffer(), Deskewer()
    frames.add(Odometry(1.0, Pose2D(0.0, 0.0), STANDSTILL))
    instant = Scan(1.0, np.ones(4, np.float32), 0.0, pi / 2, 0.1, 9.0)
    observation = Observation(1.0, {"lidar": instant})
    assert deskewer.update(observation, frames) is observation
    both = Observation(1.0, {"lidar": instant, "rear": turning_scan(0.95)})
    assert deskewer.update(both, frames).measurements == {"lidar": instant}
    assert deskewer.dropped == {"rear": 1}


def test_a_scan_waits_for_the_odometry_at_its_last_beam():
    frames, deskewer, used = TransformBuffer(), Deskewer(), []
    for n in range(11):
        frames.add(Odometry(0.05 * n, Pose2D(0.0, 0.0), STANDSTILL))
        fresh = {"lidar": turning_scan(0.07 + 0.05 * n)} if n % 3 == 0 else {}
        seen = deskewer.update(Observation(0.05 * n, fresh), frames)
        used += [(n, scan.stamp) for scan in seen.of(Scan).values()]
    # ends at 0.12, 0.27 and 0.42 s; the last one at 0.57 s still waits
    assert used == [(3, 0.07), (6, pytest.approx(0.22)), (9, pytest.approx(0.37))]
    assert deskewer.dropped == {}


def test_of_two_scans_that_become_ready_at_once_the_newer_is_used():
    frames, deskewer = TransformBuffer(), Deskewer()
    frames.add(Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL))
    for stamp in (0.1, 0.2):
        fresh = Observation(0.0, {"lidar": turning_scan(stamp)})
        assert not deskewer.update(fresh, frames).measurements
    frames.add(Odometry(0.5, Pose2D(0.0, 0.0), STANDSTILL))
    assert deskewer.update(Observation(0.5, {}), frames).measurements["lidar"].stamp == 0.2
    assert deskewer.dropped == {"lidar": 1}


def test_scans_do_not_pile_up_without_odometry():
    frames, deskewer = TransformBuffer(), Deskewer()
    frames.add(Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL))
    for n in range(25):
        deskewer.update(Observation(0.0, {"lidar": turning_scan(1.0 + n)}), frames)
    assert deskewer.dropped == {"lidar": 5}  # 20 wait
