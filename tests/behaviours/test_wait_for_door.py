"""wait_for_door in front of a wall with a doorway from (-0.5, 2) to (0.5, 2)."""

from math import pi

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._sensing.doorway import Doorway
from behaviours.perception.wait_for_door import WaitForDoor
from behaviours.testing import tick
from stack.types import FailureCode, Pose2D
from tests.behaviours.kinematic_robot import KinematicRobot, segments_of

DOOR = Pose2D(0.0, 2.0, 0.5 * pi)
WALL = ([(-4.0, 2.0), (-0.5, 2.0)], [(0.5, 2.0), (4.0, 2.0)])
HERE = Pose2D(0.0, 0.5, 0.5 * pi)


def robot(*more, pose=HERE, **rest):
    return KinematicRobot(segments=segments_of(*WALL, *more), pose=pose, **rest)


def free_width(made, width=1.0):
    return Doorway(DOOR, width).free_width(made.scan, made.pose, 0.4)


CLOSED = [(-0.5, 2.0), (0.5, 2.0)]
HALF_OPEN = [(-0.5, 2.0), (0.1, 2.0)]


@pytest.mark.parametrize("pose", [HERE, Pose2D(0.7, 0.8, 2.0), Pose2D(0.0, 3.5, 0.3)])
def test_the_free_width_of_an_open_a_closed_and_a_half_open_door(pose):
    # A beam every degree is 3 cm apart at 1.5 m: the measured width is short by two of them.
    assert free_width(robot(pose=pose)) == pytest.approx(1.0, abs=0.1)
    assert free_width(robot(CLOSED, pose=pose)) == pytest.approx(0.0, abs=0.06)
    assert free_width(robot(HALF_OPEN, pose=pose)) == pytest.approx(0.4, abs=0.1)


def test_somebody_behind_or_before_the_door_is_in_the_way():
    behind = [(-0.2, 2.3), (0.2, 2.3)]
    before = [(-0.2, 1.5), (0.2, 1.5)]
    assert free_width(robot(behind)) < 0.4
    assert free_width(robot(before)) < 0.4


def test_a_door_at_a_right_angle_to_the_view_is_not_judged():
    assert free_width(robot(pose=Pose2D(-3.0, 1.95, 0.0))) is None
    assert free_width(robot(pose=HERE, field_of_view=0.3, beams=4)) is None


def test_a_part_that_no_beam_sees_is_not_free():
    # 10 beams within 0.3 rad, 1.5 m away, see 0.45 m of the doorway.
    made = robot(pose=HERE, field_of_view=0.3, beams=10)
    assert free_width(made) == pytest.approx(0.45, abs=0.06)
    made.scan.ranges[3:7] = np.nan
    assert free_width(made) < 0.2


def test_it_waits_until_the_door_is_open_for_a_while():
    made, behaviour = robot(CLOSED), WaitForDoor(door=DOOR, width=1.0)
    assert tick(behaviour, made, 4.0) is Status.RUNNING
    assert "0.54 m are needed" in behaviour.feedback_message  # 2 · (0.22 + 0.05)
    made.segments = segments_of(*WALL)
    opened = made.time
    assert tick(behaviour, made, 5.0) is Status.SUCCESS
    assert made.time - opened == pytest.approx(1.0, abs=0.25)
    assert behaviour.waited == pytest.approx(made.time, abs=0.15)
    assert behaviour.free_width == pytest.approx(1.0, abs=0.1)
    assert all(call["twist"].linear == 0.0 for call in made.calls_of("drive_for"))


def test_a_gap_that_is_too_narrow_is_closed():
    made, behaviour = robot(HALF_OPEN), WaitForDoor(door=DOOR, width=1.0, patience=3.0)
    assert tick(behaviour, made, 5.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.DOOR_CLOSED
    assert "of 1 m are free" in behaviour.failure.sentence
    enough = WaitForDoor(door=DOOR, width=1.0, least_width=0.3)
    assert tick(enough, robot(HALF_OPEN), 5.0) is Status.SUCCESS


def test_a_door_out_of_view_is_said():
    made, behaviour = robot(pose=Pose2D(-3.0, 1.95)), WaitForDoor(door=DOOR, patience=2.0)
    assert tick(behaviour, made, 5.0) is Status.FAILURE
    assert "not in the lidar's view" in behaviour.failure.sentence


@pytest.mark.parametrize(("start", "sign"), [(Pose2D(1.0, 0.0), -1.0), (Pose2D(1.0, 4.0), 1.0)])
def test_it_waits_at_a_distance_on_its_side_of_the_door(start, sign):
    made, behaviour = robot(pose=start), WaitForDoor(door=DOOR, width=1.0, distance=1.0)
    assert tick(behaviour, made, 1.0) is Status.RUNNING
    (call,) = made.calls_of("navigate_to")
    goal = call["goal"]
    away = 1.0 + made.footprint.front
    assert (goal.x, goal.y) == pytest.approx((0.0, 2.0 + sign * away))
    assert goal.heading == pytest.approx(-sign * 0.5 * pi)
    made.pose = goal
    made.task.succeed()
    assert tick(behaviour, made, 5.0) is Status.SUCCESS


def test_a_failed_drive_to_the_door_is_its_failure():
    made, behaviour = robot(), WaitForDoor(door=DOOR, distance=1.0)
    tick(behaviour, made)
    made.task.fail(FailureCode.GOAL_OCCUPIED, "a box")
    assert tick(behaviour, made, 1.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.GOAL_OCCUPIED


def test_nan_beams_count_for_nothing():
    made = robot()
    made.scan.ranges[:] = np.nan
    assert free_width(made) is None
