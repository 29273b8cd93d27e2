"""Timers on the scripted robot's clock; all expected numbers are sums and differences by hand."""

import pytest

from behaviours.testing import ScriptedRobot
from behaviours.timer import Timer


@pytest.fixture
def robot():
    return ScriptedRobot(time=10.0)


@pytest.fixture
def timer(robot):
    timer = Timer(robot)
    timer.restart()
    return timer


def test_it_counts_from_its_start(robot, timer):
    robot.advance(1.5)
    assert timer.elapsed == 1.5
    assert timer.left(2.0) == 0.5
    assert not timer.is_over(2.0)
    robot.advance(0.5)
    assert timer.is_over(2.0)
    timer.restart()
    assert timer.elapsed == 0.0


def test_a_limit_is_over_in_spite_of_the_rounding_of_a_summed_clock(robot):
    robot.time = 0.1 + 0.2  # 0.30000000000000004
    timer = Timer(robot)
    timer.restart()
    robot.time = 0.4
    assert timer.elapsed < 0.1
    assert timer.is_over(0.1)


def test_it_stands_still_in_a_pause_and_goes_on_after_it(robot, timer):
    robot.advance(1.0)
    timer.pause(robot.time)
    robot.advance(60.0)
    assert timer.elapsed == 1.0
    timer.resume(robot.time)
    assert timer.elapsed == 1.0
    robot.advance(0.25)
    assert timer.elapsed == 1.25


def test_a_second_pause_and_a_second_resume_change_nothing(robot, timer):
    timer.resume(robot.time)
    timer.pause(robot.time)
    robot.advance(5.0)
    timer.pause(robot.time)
    robot.advance(5.0)
    timer.resume(robot.time)
    robot.advance(1.0)
    timer.resume(robot.time)
    assert timer.elapsed == 1.0


def test_a_restart_ends_a_pause(robot, timer):
    timer.pause(robot.time)
    robot.advance(3.0)
    timer.restart()
    robot.advance(1.0)
    assert timer.elapsed == 1.0
