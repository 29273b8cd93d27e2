"""The operator drives: time to live, what ends it, and safety behind it."""

import pytest

from stack.types import STANDSTILL, FailureCode, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyWorld, robot, room


def test_a_velocity_lives_for_half_a_second(make):
    toy = make()
    toy.navigator.base.assisted_teleop(20.0)
    toy.run(1.0)
    toy.navigator.base.teleoperation.steer(Twist(0.3, 0.1))
    toy.run(0.5)
    # It counts from the step before, the last that knew the time: nine steps of 0.05 s.
    assert toy.commands[-10:] == [Twist(0.3, 0.1)] * 9 + [STANDSTILL]


def test_velocities_that_keep_coming_drive_on(make):
    toy = make()
    toy.navigator.base.assisted_teleop(20.0)
    toy.step()
    for _ in range(10):
        toy.navigator.base.teleoperation.steer(Twist(0.3))
        toy.run(0.2)
    assert toy.world.pose.x == pytest.approx(1.0 + 0.3 * 2.0, abs=0.06)


def test_it_succeeds_when_the_operator_is_done(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(20.0)
    toy.step()
    toy.navigator.base.teleoperation.steer(Twist(0.3))
    toy.run(0.2)
    toy.navigator.base.teleoperation.release()
    assert task.status is TaskStatus.SUCCEEDED
    assert toy.navigator.base.teleoperation is None
    toy.step()
    assert toy.commands[-1] == STANDSTILL


def test_it_fails_when_its_time_is_over(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(5.0, silence=99.0)
    toy.finish(task)
    assert task.failure.code == FailureCode.TIMED_OUT
    assert toy.world.time == pytest.approx(5.0, abs=0.11)


def test_it_fails_without_velocity_commands(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(60.0, silence=3.0)
    toy.run(2.0)
    toy.navigator.base.teleoperation.steer(STANDSTILL)
    toy.finish(task)
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert "sent no velocity for 3 s" in task.failure.sentence
    assert toy.world.time == pytest.approx(5.0, abs=0.11)


def test_a_pause_does_not_count_as_time(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(5.0)
    toy.run(2.0)
    toy.navigator.pause(toy.world.time)
    toy.world.time += 100.0
    toy.navigator.resume(toy.world.time)
    toy.run(2.0)
    assert task.running


def test_another_task_ends_it(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(20.0)
    toy.step()
    toy.navigator.base.spin(1.0)
    assert task.status is TaskStatus.CANCELLED
    assert toy.navigator.base.teleoperation is None


@pytest.mark.parametrize("twist", [Twist(2.0), Twist(-2.0), Twist(1.0, 1.0), Twist(0.5, -2.0)])
def test_the_operator_cannot_cause_a_contact(make, twist):
    circles = [(2.0, 2.0, 0.2), (1.0, 3.0, 0.15), (3.0, 1.2, 0.2)]
    toy = make(ToyWorld(room(4, 4), robot(), Pose2D(2.0, 3.0, 0.7), circles=circles, beams=360))
    toy.navigator.base.assisted_teleop(60.0)
    toy.step()
    for _ in range(60):
        toy.navigator.base.teleoperation.steer(twist)
        toy.run(0.2)
    assert toy.world.nearest > 0.0


def test_a_velocity_from_before_a_pause_is_not_driven_after_it(make):
    toy = make()
    task = toy.navigator.base.assisted_teleop(20.0)
    toy.run(1.0)
    toy.navigator.base.teleoperation.steer(Twist(0.3))
    toy.run(0.1)
    toy.navigator.pause(toy.world.time)
    toy.world.time += 0.1
    toy.navigator.resume(toy.world.time)
    toy.run(0.3)
    assert toy.commands[-6:] == [STANDSTILL] * 6
    assert task.running
