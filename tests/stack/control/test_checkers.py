import pytest

from stack.control.checkers import GoalChecker, ProgressChecker
from stack.types import Pose2D

GOAL = Pose2D(1.0, 1.0, 0.0)


def test_a_goal_counts_once_the_robot_stands_within_both_tolerances():
    checker = GoalChecker(GOAL, 0.1, 0.1)
    assert not checker.reached(0.0, Pose2D(0.85, 1.0, 0.0), standing=True)
    assert not checker.reached(0.1, Pose2D(0.95, 1.0, 0.2), standing=True)
    assert not checker.reached(0.2, Pose2D(0.95, 1.0, 0.0), standing=False)
    assert checker.reached(0.3, Pose2D(0.95, 1.0, 0.0), standing=True)


@pytest.mark.pain("n4921", "n1492")
def test_a_goal_counts_after_a_while_within_though_moving():
    checker = GoalChecker(GOAL, 0.1, 0.1, settle=2.0)
    near = Pose2D(0.95, 1.0, 0.05)
    assert not checker.reached(0.0, near, standing=False)
    assert not checker.reached(1.9, near, standing=False)
    assert checker.reached(2.0, near, standing=False)


def test_position_is_remembered_while_turning_up_to_twice_its_tolerance():
    checker = GoalChecker(GOAL, 0.1, 0.1)
    checker.reached(0.0, Pose2D(0.95, 1.0, 1.0), standing=False)
    assert checker.reached(1.0, Pose2D(0.85, 1.0, 0.0), standing=True)
    assert not checker.reached(2.0, Pose2D(0.75, 1.0, 0.0), standing=True)
    assert not checker.reached(3.0, Pose2D(0.85, 1.0, 0.0), standing=True)


def test_headings_compare_across_the_turn():
    assert GoalChecker(Pose2D(0, 0, 3.1), 0.1, 0.1).reached(0, Pose2D(0, 0, -3.12), standing=True)


def test_standing_still_is_stuck_after_the_time():
    checker = ProgressChecker(0.3, 0.4, 8.0)
    assert not checker.stuck(0.0, Pose2D(0, 0))
    assert not checker.stuck(7.9, Pose2D(0.29, 0, 0.39))
    assert checker.stuck(8.0, Pose2D(0.29, 0, 0.39))


def test_enough_motion_or_rotation_restarts_the_time():
    checker = ProgressChecker(0.3, 0.4, 8.0)
    checker.stuck(0.0, Pose2D(0, 0))
    assert not checker.stuck(7.0, Pose2D(0.31, 0))
    assert not checker.stuck(14.0, Pose2D(0.31, 0, 0.41))
    assert not checker.stuck(21.9, Pose2D(0.31, 0, 0.41))
    assert checker.stuck(22.0, Pose2D(0.31, 0, 0.41))
