"""follow_line on a kinematic robot that sees the floor from 0.8 m ahead."""

from math import cos, pi, radians, sin

import numpy as np
import pytest
from py_trees.common import Status

from behaviours.following.follow_line import FollowLine
from behaviours.testing import tick
from stack.sim.worlds.polylines import rounded
from stack.types import Pose2D
from tests.behaviours.line_robot import LineRobot, distances


def line(*points, radius=0.0):
    return rounded(np.array(points, dtype=float), radius)


def follow(robot, seconds=60.0, **ports):
    behaviour = FollowLine(**ports)
    tick(behaviour, robot, seconds)
    return behaviour


def track(robot):
    return np.array([(pose.x, pose.y) for pose in robot.way])


BAR = line([4.0, 1.35], [4.0, 1.65])
BEND = line([0.5, 0.0], [2.0, 0.0], [2.0, 1.5], [4.0, 1.5], radius=0.7)


def test_it_follows_a_bend_to_the_end_mark():
    robot = LineRobot(floor=(BEND, BAR))
    behaviour = follow(robot, speed=0.4)
    assert behaviour.status is Status.SUCCESS, behaviour.failure
    assert (robot.pose.x, robot.pose.y) == pytest.approx((4.0, 1.5), abs=0.06)
    on_line = track(robot)[60:]
    assert np.sqrt(np.mean(distances(on_line, (BEND,)) ** 2)) < 0.02
    # 3.5 m + 1.5 m, less what two quarters of a circle cut off, 2 (2 - pi / 2) 0.7 m = 0.60 m, and
    # the first 0.3 m, which the camera never sees.
    assert behaviour.travelled == pytest.approx(4.1, abs=0.15)
    assert behaviour.error_rms < 0.02 and behaviour.junctions == 0


@pytest.mark.parametrize(("word", "end"), [("left", 0.8), ("right", -0.8)])
def test_it_takes_the_branch_it_is_told(word, end):
    trunk = line([0.5, 0.0], [2.0, 0.0])
    branches = [line([2.0, 0.0], [3.0, side], [4.5, side], radius=0.5) for side in (0.8, -0.8)]
    robot = LineRobot(floor=(trunk, *branches))
    behaviour = follow(robot, at_junction=[word], until_travelled=3.5)
    assert behaviour.status is Status.SUCCESS and behaviour.junctions == 1
    assert robot.pose.y == pytest.approx(end, abs=0.1)


def test_each_junction_has_its_own_word():
    trunk = line([0.5, 0.0], [5.5, 0.0])
    first, second = line([1.8, 0.0], [2.6, 0.8]), line([3.6, 0.0], [4.6, -1.0], [6.0, -1.0])
    robot = LineRobot(floor=(trunk, first, second))
    behaviour = follow(robot, at_junction=["straight", "right"], until_travelled=4.5)
    assert behaviour.status is Status.SUCCESS and behaviour.junctions == 2
    assert robot.pose.y == pytest.approx(-1.0, abs=0.15)


@pytest.mark.parametrize("angle", [45.0, 60.0, 90.0])
@pytest.mark.parametrize("word", ["left", "straight", "right"])
def test_a_crossing_is_a_junction_with_three_branches(word, angle):
    towards = np.array([cos(radians(angle)), sin(radians(angle))])
    middle = np.array([2.5, 0.0])
    main, cross = line([0.5, 0.0], [4.5, 0.0]), line(middle - 1.5 * towards, middle + 1.5 * towards)
    end = {"left": cross[1], "straight": main[1], "right": cross[0]}[word]
    way = (end - middle) / np.linalg.norm(end - middle)
    mark = line(*(end + side * np.array([-way[1], way[0]]) for side in (-0.15, 0.15)))
    robot = LineRobot(floor=(main, cross, mark))
    behaviour = follow(robot, at_junction=[word])
    assert behaviour.status is Status.SUCCESS and behaviour.junctions == 1
    assert (robot.pose.x, robot.pose.y) == pytest.approx(end, abs=0.06)
    on_line, route = track(robot)[70:], (line(main[0], middle, end),)
    assert np.sqrt(np.mean(distances(on_line, route) ** 2)) < 0.025


def test_a_line_beside_it_is_no_branch():
    beside = line([0.5, -0.3], [2.3, -0.3], [2.3, 1.2], [4.0, 1.2], radius=0.7)
    robot = LineRobot(floor=(BEND, beside, BAR))
    behaviour = follow(robot)
    assert behaviour.status is Status.SUCCESS and behaviour.junctions == 0
    assert np.sqrt(np.mean(distances(track(robot)[60:], (BEND,)) ** 2)) < 0.02


@pytest.mark.parametrize(("aside", "heading"), [(0.2, 0.5), (0.2, -0.4), (-0.2, 0.3)])
def test_it_starts_beside_its_line(aside, heading):
    bend, bar = (Pose2D(0.0, aside, heading).inverse().transform(one) for one in (BEND, BAR))
    robot = LineRobot(floor=(bend, bar))
    behaviour = follow(robot)
    assert behaviour.status is Status.SUCCESS
    away = distances(track(robot), (bend,))
    assert away[np.argmax(away < 0.03) :].max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_it_follows_a_worn_line(seed):
    # A fifth of the paint is off, in squares of 3 cm.
    robot = LineRobot(floor=(BEND, BAR))
    robot.wear(0.2, 0.03, seed)
    behaviour = follow(robot)
    assert behaviour.status is Status.SUCCESS and behaviour.junctions == 0
    assert np.sqrt(np.mean(distances(track(robot)[60:], (BEND,)) ** 2)) < 0.03


def test_it_stands_first_so_that_the_gyro_is_calibrated():
    robot = LineRobot(floor=(BEND, BAR))
    follow(robot, seconds=0.95)
    assert robot.known is not None and np.abs(track(robot)).max() == 0.0
    follow(robot, seconds=2.0)
    assert robot.pose.x > 0.2


def test_it_crosses_a_gap():
    parts = line([0.5, 0.0], [2.0, 0.0]), line([2.4, 0.0], [4.5, 0.0])
    robot = LineRobot(floor=parts)
    behaviour = follow(robot, until_place=Pose2D(4.2, 0.0), place_radius=0.1)
    assert behaviour.status is Status.SUCCESS and abs(robot.pose.y) < 0.03


def test_it_approaches_a_line_that_begins_aside():
    robot = LineRobot(floor=(line([1.0, 0.35], [5.0, 0.35]),))
    behaviour = follow(robot, until_travelled=2.0)
    assert behaviour.status is Status.SUCCESS and robot.pose.y == pytest.approx(0.35, abs=0.03)


def test_it_turns_to_look_for_a_line_beside_it():
    robot = LineRobot(floor=(line([0.3, 1.2], [-3.0, 1.2]),))
    behaviour = follow(robot, until_travelled=2.0)
    assert behaviour.status is Status.SUCCESS and robot.pose.y == pytest.approx(1.2, abs=0.05)


def test_a_line_that_ends_without_a_mark_is_lost():
    robot = LineRobot(floor=(line([0.5, 0.0], [2.5, 0.0]),))
    behaviour = follow(robot)
    assert behaviour.status is Status.FAILURE and behaviour.failure.code == "NO_LINE"
    assert "lost after 2." in behaviour.failure.sentence
    assert robot.pose.x == pytest.approx(3.0, abs=0.15)  # the line and a gap of 0.5 m


def test_without_a_line_it_stays_where_it_is():
    robot = LineRobot()
    behaviour = follow(robot)
    assert behaviour.failure.code == "NO_LINE" and "no dark line" in behaviour.failure.sentence
    assert np.abs(track(robot)).max() < 0.01


def test_a_camera_that_stops_stops_the_robot():
    robot = LineRobot(floor=(line([0.5, 0.0], [9.0, 0.0]),))
    behaviour = follow(robot, seconds=5.0)
    robot.camera_works = False
    tick(behaviour, robot, 5.0)
    assert behaviour.failure.code == "NO_IMAGE" and robot.twist.linear == 0.0
    assert robot.time == pytest.approx(5.0 + 2.0, abs=0.4)


def test_a_robot_that_is_held_fast_notices():
    class Stuck(LineRobot):
        def _moved(self, pose, distance, turn):
            return pose

    behaviour = follow(Stuck(floor=(line([0.5, 0.0], [9.0, 0.0]),)))
    assert behaviour.failure.code == "NO_PROGRESS"


def test_a_circle_is_followed_for_a_time():
    angles = np.linspace(-pi / 2, 1.5 * pi, 200)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]) * 1.2 + [0.0, 1.2]
    robot = LineRobot(floor=(circle,))
    behaviour = follow(robot, seconds=90.0, until_time=40.0)
    assert behaviour.status is Status.SUCCESS
    assert np.sqrt(np.mean(distances(track(robot)[100:], (circle,)) ** 2)) < 0.02
