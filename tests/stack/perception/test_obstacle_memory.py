"""Obstacle points of all sensors: motion compensation, coverage, memory in blind sectors."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.load import read_robot
from stack.drivetrain.description import LidarDescription, SonarDescription
from stack.frames.buffer import TransformBuffer
from stack.perception.obstacle_memory import ObstacleMemory, arc_points, blind_sectors
from stack.types import (
    STANDSTILL,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    RangeReading,
    Scan,
    TrackedObject,
)
from tests.stack.navigation.toy_world import ToyWorld, robot, room

ROOT = Path(__file__).parents[3]
HALF = Scan(0.0, np.full(180, np.inf, np.float32), -pi / 2, pi / 180, 0.05, 12.0)


def frames_of(*poses: tuple[float, Pose2D]) -> TransformBuffer:
    frames = TransformBuffer()
    for stamp, pose in poses:
        frames.add(Odometry(stamp, pose, STANDSTILL))
    return frames


def test_points_of_an_old_scan_are_moved_by_odometry():
    """On an arc of 0.2 s at 0.5 m/s and 45 deg/s the points stay on the walls of the room."""
    world = ToyWorld(room(8, 8), robot(), Pose2D(4.0, 4.0))
    moved = Pose2D(0.09961, 0.00784, pi / 20)  # closed form of the arc
    frames = frames_of((0.0, Pose2D(0.0, 0.0)), (0.2, moved))
    memory = ObstacleMemory(world.robot)
    memory.update(Observation(0.0, {"lidar": world.scan}), frames_of((0.0, Pose2D(0.0, 0.0))))
    later = memory.update(Observation(0.2, {}), frames)
    on_walls = world.pose.compose(moved).transform(later.points)
    distance = np.minimum(np.abs(on_walls - 8).min(axis=1), np.abs(on_walls).min(axis=1))
    assert distance.max() < 1e-5
    assert later.ages == {"lidar": 0.2}


def test_every_sensor_counts_and_a_missing_one_has_no_age():
    described = replace(
        robot(),
        lidars={"rear": LidarDescription(Pose2D(-0.2, 0.0, pi))},
        sonars={"left": SonarDescription(Pose2D(0.0, 0.2, pi / 2))},
    )
    reading = RangeReading(0.9, 1.0, 0.0, 0.05, 2.5, Pose2D(0.0, 0.2, pi / 2), "left")
    rear = replace(HALF, stamp=1.0, ranges=np.array([2.0], np.float32), angle_min=0.0,
                   mount=Pose2D(-0.2, 0.0, pi))  # fmt: skip
    obstacles = ObstacleMemory(described).update(
        Observation(1.0, {"rear": rear, "left": reading}),
        frames_of((0.9, Pose2D(0.0, 0.0)), (1.0, Pose2D(0.0, 0.0))),
    )
    assert obstacles.ages == {"lidar": inf, "rear": 0.0, "left": pytest.approx(0.1)}
    assert obstacles.points == pytest.approx(np.array([[-2.2, 0.0], [0.0, 1.2], [0.0, 1.2]]))


@given(st.floats(0.1, 2.5), st.floats(0.05, 1.6))
def test_an_arc_has_points_at_most_5_cm_apart_at_the_distance_of_the_reading(distance, width):
    mount = Pose2D(0.2, 0.1, 0.3)
    points = arc_points(RangeReading(0.0, distance, width, 0.05, 2.5, mount))
    assert np.hypot(*(points - (0.2, 0.1)).T) == pytest.approx(distance)
    assert np.hypot(*np.diff(points, axis=0).T).max() <= 0.0751
    assert arc_points(RangeReading(0.0, inf, width, 0.05, 2.5, mount)).shape == (0, 2)


def test_the_jackal_is_blind_behind():
    """Its lidar sees 270 degrees from 12 cm ahead of the middle, so more than 90 are hidden.

    0.833 m from the middle (the footprint's 0.333 m and 0.5 m) the outermost beam is at
    135 deg - asin(0.12 sin(135 deg) / 0.833) = 129.2 deg: 101.7 deg between the two.
    """
    sectors = blind_sectors(read_robot(ROOT / "robots/jackal/robot.yaml"))
    assert len(sectors) == 1
    first, width = np.degrees(sectors[0])
    assert first + width / 2 == pytest.approx(180.0, abs=0.5)
    assert width == pytest.approx(101.7, abs=1.0)
    assert blind_sectors(robot()).shape == (0, 2)
    assert blind_sectors(robot(lidar=False)) == pytest.approx(np.array([[-pi, 2 * pi]]))


def passed(described, place, steps, travel):
    """Distance of the nearest point to what stands at a place, step by step of 0.05 s.

    Args:
        described: the robot; its lidar sees nothing but one point.
        place: x, y of the point, odom frame.
        steps: number of steps.
        travel: x of the robot by time; it drives along the x axis.
    """
    memory, frames, lidar = ObstacleMemory(described), TransformBuffer(), described.lidar
    half, apart = lidar.field_of_view / 2.0, []
    beams = round(np.degrees(lidar.field_of_view)) + 1
    for step in range(steps):
        stamp = 0.05 * step
        x = travel(stamp)
        frames.add(Odometry(stamp, Pose2D(x, 0.0), STANDSTILL))
        away = np.subtract(place, (x, 0.0))
        ray = away - (lidar.mount.x, lidar.mount.y)
        ranges = np.full(beams, np.inf, np.float32)
        beam = round(np.degrees(np.arctan2(ray[1], ray[0]) + half))
        if 0 <= beam < beams:
            ranges[beam] = np.hypot(*ray)
        scan = Scan(stamp, ranges, -half, pi / 180, lidar.range_min, 12.0, lidar.mount)
        points = memory.update(Observation(stamp, {"lidar": scan}), frames).points
        apart.append(np.hypot(*(points - away).T).min() if len(points) else inf)
    return apart


def half_blind():
    return replace(robot(), lidar=LidarDescription(Pose2D(0.0, 0.0), field_of_view=pi))


def test_a_point_that_moves_into_a_blind_sector_is_remembered_for_ten_seconds():
    apart = passed(half_blind(), (0.5, 0.8), 300, lambda time: min(1.5, time))
    # a beam is a degree wide: 1.4 cm at 0.8 m; the point is passed at 0.5 s
    assert max(apart[:205]) < 0.03
    assert apart[215:] == [inf] * 85


def test_a_point_that_was_seen_in_one_place_for_two_seconds_is_remembered_for_a_minute():
    apart = passed(half_blind(), (0.5, 0.8), 1290, lambda time: max(0.0, min(1.5, time - 2.0)))
    assert max(apart[:1245]) < 0.03  # last seen after 2.5 s
    assert apart[1255:] == [inf] * 35


def test_a_point_close_to_the_outline_is_remembered_as_soon_as_the_lidar_loses_it():
    """The jackal's lidar is 12 cm ahead of its middle and sees 135 degrees to each side.

    Half a metre outside the outline it loses a point at a bearing of 129 degrees; 0.33 m from the
    middle, at the rear corner, at 135 deg - asin(0.12 sin(135 deg) / 0.33) = 120 deg already.
    """
    jackal = read_robot(ROOT / "robots/jackal/robot.yaml")
    apart = passed(jackal, (0.3, 0.28), 80, lambda time: 0.25 * time)
    assert max(apart) < 0.02


def test_ground_is_seen_up_to_obstacles_and_where_the_robot_stood_and_for_ten_seconds():
    ranges = HALF.ranges.copy()
    ranges[80:101] = 0.5  # an obstacle ahead, 10 degrees to both sides
    memory, frames = ObstacleMemory(half_blind()), TransformBuffer()

    def ground(time, x, **scans):
        frames.add(Odometry(time, Pose2D(x, 0.0), STANDSTILL))
        return memory.update(Observation(time, scans), frames).ground

    seen = ground(0.0, 0.0, lidar=replace(HALF, ranges=ranges))
    unseen = [(0.4, 0.0), (0.7, 0.0), (0.3, 0.5), (-0.5, 0.0), (-0.2, 0.1), (3.0, 0.0)]
    assert [seen.is_unseen(*place) for place in unseen] == [False, True, False, True, False, True]
    moved = ground(1.0, 0.6)  # farther than the grid waits
    assert not moved.is_unseen(0.3 - 0.6, 0.5)
    assert not moved.is_unseen(-0.2 - 0.6, 0.1)
    assert moved.is_unseen(-0.1 - 0.6, 0.35)
    later = ground(10.5, 0.6)
    assert later.is_unseen(0.3 - 0.6, 0.5)
    assert not later.is_unseen(0.0, 0.0)


def someone(x, y, velocity, time) -> TrackedObject:
    return TrackedObject(1, time, (x, y), velocity, 0.2, np.eye(4))


@pytest.mark.parametrize(
    ("walks", "seconds", "remembered"),
    [(True, 3.0, True), (True, 4.5, False), (False, 4.5, True), (False, 12.0, False)],
)
def test_people_who_walk_are_remembered_for_a_short_time(walks, seconds, remembered):
    """Somebody 0.8 m to the left, 0.5 s later behind the half view: 3 s if they walk, else 10 s."""
    described, frames = half_blind(), TransformBuffer()
    memory, place = ObstacleMemory(described), (0.3, 0.8)
    frames.correct(PoseEstimate(Pose2D(0.0, 0.0), np.eye(3), 1.0))
    for step in range(round(20.0 * seconds)):
        stamp = 0.05 * step
        x = 0.5 * min(stamp, 2.0)
        frames.add(Odometry(stamp, Pose2D(x, 0.0), STANDSTILL))
        bearing, away = np.arctan2(place[1], place[0] - x), np.hypot(place[0] - x, place[1])
        ranges = HALF.ranges.copy()
        if abs(bearing) < pi / 2:
            ranges[round(np.degrees(bearing)) + 90 - 1] = away - 0.2
        scan = replace(HALF, stamp=stamp, ranges=ranges)
        who = [someone(*place, (0.0, 1.0) if walks else (0.0, 0.0), stamp)]
        points = memory.update(Observation(stamp, {"lidar": scan}), frames, tracks=who).points
    assert (len(points) > 0) is remembered


@pytest.mark.parametrize(("there", "count"), [((1.4, 0.0), 0), ((1.9, 0.0), 11)])
def test_the_arc_of_a_sonar_reading_that_shows_somebody_is_left_out(there, count):
    """At 1 m and 30 degrees, an arc of 0.52 m has 11 points about 5 cm apart."""
    described = replace(robot(), sonars={"front": SonarDescription(Pose2D(0.2, 0.0))})
    reading = RangeReading(0.0, 1.0, pi / 6, 0.05, 2.5, Pose2D(0.2, 0.0), "front")
    frames = frames_of((0.0, Pose2D(0.0, 0.0)))
    frames.correct(PoseEstimate(Pose2D(0.0, 0.0), np.eye(3), 1.0))
    who = [someone(*there, (1.0, 0.0), 0.0)]
    found = ObstacleMemory(described).update(
        Observation(0.0, {"front": reading}), frames, tracks=who
    )
    assert len(found.points) == count
