"""A lost robot stands: a path from a wrong pose is useless, and so is a motion without one."""

from math import hypot

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.types import STANDSTILL, FailureCode, Pose2D, PoseEstimate, RivalPose, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyWorld, moving, room

HERE = Pose2D(0.0, 0.0)
GOAL = Pose2D(7.0, 3.0)
LOST, FINE = 0.1, 0.9

MOTIONS = {
    "spin": lambda robot, **more: robot.spin(3.0, **more),
    "back_up": lambda robot, **more: robot.back_up(0.5, **more),
    "drive_on_heading": lambda robot, **more: robot.drive_on_heading(2.0, **more),
    "escape": lambda robot, **more: robot.escape(clearance=0.7, distance=1.0, **more),
    "drive_for": lambda robot, **more: robot.drive_for(Twist(0.2), 5.0, **more),
}
"""The motions without a path."""

motions = pytest.mark.parametrize("begin", MOTIONS.values(), ids=MOTIONS)


@pytest.fixture
def make(make):
    """make(**settings): a robot with a wall at its side, which an escape leaves."""
    walls = [*room(8, 6), (0.5, 2.5, 1.6, 2.5)]
    world = ToyWorld(walls, moving("differential"), Pose2D(1.0, 3.0))
    return lambda **settings: make(world, **settings)


def doubts(toy) -> list[str]:
    return [fields["doubt"] for kind, _, fields in toy.events if kind == "doubt"]


def test_ambiguity_alone_is_not_being_lost():
    """A health of 0.2 with three equal rivals: each fits with 0.8."""
    rivals = tuple(RivalPose(HERE, 0.25) for _ in range(3))
    assert not PoseEstimate(HERE, np.eye(3), 0.2, rivals=rivals).is_lost
    assert PoseEstimate(HERE, np.eye(3), 0.2).is_lost


@motions
def test_no_motion_without_a_path_begins_while_lost(make, begin):
    toy = make()
    toy.health = LOST
    toy.run(2.0)
    try:
        task = begin(toy.navigator.base)
    except NavigationError as error:
        failure = error.failure
    else:
        toy.step()
        failure = task.failure
    assert failure.code == FailureCode.LOST
    assert "health 0.10, below 0.3" in failure.sentence and "run `relocalise`" in failure.sentence
    assert all(twist == STANDSTILL for twist in toy.commands)


@motions
def test_a_motion_that_is_under_way_stands_while_lost_and_fails_after_lost_time(make, begin):
    toy = make()
    task = begin(toy.navigator.base)
    toy.run(0.5)
    toy.health = LOST
    toy.commands.clear()
    assert toy.run(5.0, lambda: not task.running) == pytest.approx(1.55)  # lost_time, and a step
    assert task.failure.code == FailureCode.LOST
    assert all(twist == STANDSTILL for twist in toy.commands)


@motions
def test_a_motion_goes_on_when_the_scans_fit_again(make, begin):
    """The time limits of the motion stand still meanwhile, also in several short doubts."""
    toy = make()
    task = begin(toy.navigator.base)
    for _ in range(4):
        toy.health = FINE
        toy.run(0.2)
        toy.health = LOST
        toy.run(1.2)  # 4.8 s in all, more than stall_time
    toy.health = FINE
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure


@motions
def test_a_behaviour_that_finds_the_pose_drives_while_lost(make, begin):
    toy = make()
    toy.health = LOST
    toy.run(2.0)
    task = begin(toy.navigator.base, while_lost=True)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure


@motions
def test_a_user_may_let_them_drive(make, begin):
    toy = make(lost_motions="drive")
    toy.health = LOST
    toy.run(2.0)
    assert toy.finish(begin(toy.navigator.base)) is TaskStatus.SUCCEEDED


def test_a_robot_that_is_lost_can_be_stopped(make):
    toy = make()
    toy.health = LOST
    toy.run(2.0)
    assert toy.finish(toy.navigator.base.drive_for(STANDSTILL, 0.3)) is TaskStatus.SUCCEEDED


def test_a_velocity_does_not_outlive_its_time_after_a_doubt(make):
    toy = make()
    toy.navigator.base.drive_for(Twist(0.2), 0.3)
    toy.health = LOST
    toy.run(1.0, lambda: toy.navigator.base.drive_for(Twist(0.2), 0.3) is None)
    toy.health = FINE
    toy.commands.clear()
    toy.run(2.0)
    assert sum(twist != STANDSTILL for twist in toy.commands) <= 7  # 0.3 s, steps of 0.05 s


def test_the_operator_drives_a_lost_robot(make):
    toy = make()
    toy.health = LOST
    toy.run(2.0)
    task = toy.navigator.base.assisted_teleop(10.0)
    toy.step()
    toy.navigator.base.teleoperation.steer(Twist(0.2))
    toy.step()
    assert task.running and toy.commands[-1] == Twist(0.2)


@pytest.mark.parametrize("lost_before", [0.0, 3.0])
def test_each_drive_waits_for_the_pose_before_it_fails(make, lost_before):
    """Recoveries are refused at once, but a drive can only wait: the estimator searches."""
    toy = make()
    toy.health = LOST
    toy.run(lost_before)
    task = toy.navigator.base.navigate_to(GOAL)
    assert toy.run(5.0, lambda: not task.running) == pytest.approx(1.55)
    assert task.failure.code == FailureCode.LOST
    assert all(twist == STANDSTILL for twist in toy.commands)


def test_a_drive_goes_on_when_the_scans_fit_again(make):
    toy = make()
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(1.0)
    toy.health = LOST
    toy.run(1.4)
    assert task.running and task.feedback == "standing: the scans do not fit the map"
    toy.health = FINE
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert doubts(toy) == ["lost", "none"]


def test_unmapped_things_let_the_robot_drive_on_slowly_for_a_distance(make):
    """1 m at 0.2 m/s: 5 s, then it stands for lost_time."""
    toy = make(obscured_distance=1.0)
    task = toy.navigator.base.navigate_to(GOAL)
    toy.run(2.0)
    before = toy.world.pose.x
    toy.health, toy.obscured = LOST, True
    toy.commands.clear()
    monitor = toy.navigator.localisation_monitor
    toy.step()
    assert monitor.speed_limit == 0.2
    assert monitor.limitation.text == "slower: 0.20 m/s by odometry, unmapped things hide the map"
    toy.run(20.0, lambda: not task.running)
    assert max(hypot(twist.linear, twist.lateral) for twist in toy.commands) <= 0.2 + 1e-9
    assert task.failure.code == FailureCode.LOST
    assert "the distance that may be driven by odometry meanwhile is used up" in (
        task.failure.sentence
    )
    # The robot brakes from 0.2 m/s after the metre, and from its cruising speed at the beginning.
    assert monitor.obscured_distance == pytest.approx(1.0, abs=0.05)
    assert toy.world.pose.x - before == pytest.approx(1.1, abs=0.15)
    assert doubts(toy) == ["obscured", "lost"]


def test_the_distance_by_odometry_is_not_renewed_by_another_goal(make):
    toy = make(obscured_distance=1.0)
    toy.health, toy.obscured = LOST, True
    toy.finish(toy.navigator.base.navigate_to(GOAL))
    toy.health = 0.4  # neither lost nor good
    toy.run(0.5)
    toy.health, spent = LOST, toy.world.pose.x
    task = toy.navigator.base.navigate_to(GOAL)
    toy.finish(task)
    assert task.failure.code == FailureCode.LOST
    assert toy.world.pose.x == pytest.approx(spent, abs=0.02)
    toy.health = FINE
    toy.step()
    toy.health = LOST
    toy.finish(toy.navigator.base.navigate_to(GOAL))
    assert toy.world.pose.x - spent > 0.9, "a good pose begins another metre"


@motions
def test_motions_without_a_path_are_slow_too_where_the_map_is_hidden(make, begin):
    toy = make(back_up_speed=0.5, straight_speed=0.5, escape_speed=0.5)
    toy.health, toy.obscured = LOST, True
    assert toy.finish(begin(toy.navigator.base)) is TaskStatus.SUCCEEDED
    assert max(hypot(twist.linear, twist.lateral) for twist in toy.commands) <= 0.2 + 1e-9


def test_a_robot_that_may_not_drive_by_odometry_stands(make):
    toy = make(obscured_speed=0.0)
    toy.health, toy.obscured = LOST, True
    task = toy.navigator.base.navigate_to(GOAL)
    toy.finish(task)
    assert task.failure.code == FailureCode.LOST
    assert all(twist == STANDSTILL for twist in toy.commands)


def test_a_drive_among_rivals_fails_at_once_although_the_robot_is_lost_too(make):
    """Waiting for the estimator is useless then: the mission is to tell them apart."""
    toy = make(ambiguous_goals="refuse")
    task = toy.navigator.base.navigate_to(GOAL)
    toy.health, toy.rivals = 0.1, (RivalPose(Pose2D(5.0, 5.0), 0.2),)
    toy.step()
    assert task.failure.code == FailureCode.AMBIGUOUS
    assert "2 places explain the scans" in task.failure.sentence
