import re
from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.omnidirectional import OmniWheels
from stack.errors import ParameterError
from stack.navigation.recoveries import MotionProfile
from stack.types import STANDSTILL, FailureCode, Footprint, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, robot, room

CAR = replace(robot(), wheels=SteeredWheels(("a", "b"), ("c", "d"), 0.05, 0.3, 0.25, 0.6, 2.0))
OMNI = replace(robot(lateral_speed=0.4), wheels=OmniWheels((), (), 0.05))
LONG = Footprint(np.array([[-0.2, -0.15], [0.6, -0.15], [0.6, 0.15], [-0.2, 0.15]]))


@pytest.mark.pain("n1655")
@settings(deadline=None, max_examples=60)
@given(st.floats(-8.0, 8.0), st.floats(-pi, pi), st.floats(0.4, 3.0))
def test_every_spin_ends_after_its_angle(angle, heading, speed):
    toy = ToyDrive(ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0, heading)))
    turned, before = 0.0, heading
    task = toy.navigator.base.spin(angle, speed=speed)
    while task.running and toy.world.time < 200:
        toy.step()
        turned += (toy.world.pose.heading - before + pi) % (2 * pi) - pi
        before = toy.world.pose.heading
    toy.navigator.close()
    assert task.status is TaskStatus.SUCCEEDED
    assert turned == pytest.approx(angle, abs=0.05)


@settings(deadline=None, max_examples=12)
@given(st.floats(0.02, 2.0), st.floats(-pi, pi), st.floats(0.05, 0.5))
def test_every_backing_up_ends_after_its_distance(distance, heading, speed):
    toy = ToyDrive(ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0, heading)))
    task = toy.navigator.base.back_up(distance, speed=speed)
    assert toy.finish(task, 200) is TaskStatus.SUCCEEDED
    toy.navigator.close()
    there = Pose2D(3.0, 3.0, heading).compose(Pose2D(-distance, 0.0))
    assert toy.world.pose.distance_to(there) < 0.03


@pytest.mark.pain("n2453")
def test_backing_up_stops_before_a_wall_and_fails(make):
    toy = make(ToyWorld(room(6, 6), robot(), Pose2D(0.6, 3.0)))
    task = toy.navigator.base.back_up(1.0)
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    behind = f"an obstacle {toy.world.pose.x:.1f} m behind is in the way, contact in 0."
    assert task.failure.sentence.startswith(behind)
    assert " m; drove 0." in task.failure.sentence
    assert toy.world.nearest > 0.03


def test_a_long_robot_does_not_spin_into_a_wall(make):
    toy = make(ToyWorld(room(6, 6), robot(LONG), Pose2D(3.0, 0.4, 0.0), beams=720))
    task = toy.navigator.base.spin(-pi)
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    # It turns to the right, from heading 0 towards the wall at y = 0.
    wanted = r"an obstacle 0\.[4-6] m ahead is in the way, contact in 0\.\d\d rad; drove 0\."
    assert re.match(wanted, task.failure.sentence)
    assert toy.world.nearest > 0.0


def test_it_waits_for_a_person_who_steps_aside_in_time(make):
    world = ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0), circles=[(2.3, 3.0, 0.2)])
    toy = make(world)
    task = toy.navigator.base.back_up(0.5)
    toy.run(1.5)
    world.circles.clear()
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_a_velocity_lives_as_long_as_asked_and_can_be_renewed(make):
    toy = make()
    toy.run(0.5)
    task = toy.navigator.base.drive_for(Twist(0.3), 0.5)
    toy.run(0.4)
    assert toy.navigator.base.drive_for(Twist(0.2, 0.1), 0.5) is task
    toy.run(0.4)
    assert toy.commands[-1] == Twist(0.2, 0.1)
    toy.run(0.2)
    assert toy.commands[-1] == STANDSTILL
    assert task.status is TaskStatus.SUCCEEDED


def test_a_velocity_cancels_a_drive(make):
    toy = make()
    drive = toy.navigator.base.navigate_to(Pose2D(7.0, 3.0))
    toy.run(1.0)
    toy.navigator.base.drive_for(Twist(0.1), 0.2)
    assert drive.status is TaskStatus.CANCELLED


@pytest.mark.parametrize("distance", [0.0, -0.3])
def test_backing_up_by_nothing_is_refused(make, distance):
    with pytest.raises(ParameterError, match="must be above 0"):
        make().navigator.base.back_up(distance)


def test_recoveries_are_counted(make):
    toy = make()
    toy.finish(toy.navigator.base.spin(0.5))
    toy.finish(toy.navigator.base.back_up(0.2))
    assert toy.kinds().count("recovery") == 2
    assert toy.kinds() == ["recovery", "task"] * 2


def test_a_car_says_that_it_cannot_turn_in_place(make):
    toy = make(ToyWorld(room(8, 6), CAR, Pose2D(3.0, 3.0)))
    task = toy.navigator.base.spin(1.0)
    assert (task.status, task.failure.code) == (TaskStatus.FAILED, FailureCode.UNSUPPORTED)
    # 0.3 m / tan(0.6 rad)
    assert "cannot turn in place: its turning radius is 0.44 m" in str(task.failure)
    toy.run(1.0)
    assert toy.world.pose == Pose2D(3.0, 3.0)


@settings(deadline=None, max_examples=30)
@given(st.floats(-2.0, 2.0), st.floats(-pi, pi), st.floats(0.05, 1.0))
def test_every_straight_drive_ends_after_its_distance(distance, heading, speed):
    toy = ToyDrive(ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0, heading)))
    task = toy.navigator.base.drive_on_heading(distance, speed=speed)
    assert toy.finish(task, 200) is TaskStatus.SUCCEEDED
    toy.navigator.close()
    there = Pose2D(3.0, 3.0, heading).compose(Pose2D(distance, 0.0))
    assert toy.world.pose.distance_to(there) < 0.04


@pytest.mark.parametrize("distance", [1.5, -1.5])
@pytest.mark.parametrize("who", [robot(), CAR], ids=["differential", "car"])
def test_a_straight_drive_holds_its_heading(make, who, distance):
    toy = make(ToyWorld(room(8, 6), who, Pose2D(4.0, 3.0, 0.3)))
    drive = toy.world.drive
    toy.world.drive = lambda twist: drive(replace(twist, angular=twist.angular + 0.05))
    task = toy.navigator.base.drive_on_heading(distance)
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    # Unheld, 0.05 rad/s would make 0.3 rad of the six seconds.
    assert toy.world.pose.heading == pytest.approx(0.3, abs=0.12)


def test_an_omnidirectional_robot_may_say_which_way(make):
    toy = make(ToyWorld(room(8, 6), OMNI, Pose2D(4.0, 3.0, 0.5)))
    task = toy.navigator.base.drive_on_heading(1.0, direction=2.0)
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert toy.world.pose.x == pytest.approx(4.0 + cos(2.5), abs=0.03)
    assert toy.world.pose.y == pytest.approx(3.0 + sin(2.5), abs=0.03)
    assert toy.world.pose.heading == pytest.approx(0.5, abs=0.01)


def test_others_say_that_they_cannot_drive_sideways(make):
    task = make().navigator.base.drive_on_heading(1.0, direction=pi / 2)
    assert "differential wheels and cannot drive towards 90 deg" in task.failure.sentence


def test_a_robot_without_reverse_says_so(make):
    toy = make(ToyWorld(room(8, 6), robot(reverse_speed=0.0), Pose2D(4.0, 3.0)))
    assert "limit there is 0 m/s" in toy.navigator.base.drive_on_heading(-1.0).failure.sentence


@pytest.mark.parametrize(("distance", "x"), [(2.0, 5.2), (-2.0, 0.8)])
def test_a_straight_drive_stops_before_a_wall_and_fails(make, distance, x):
    toy = make(ToyWorld(room(6, 6), robot(), Pose2D(x, 3.0)))
    task = toy.navigator.base.drive_on_heading(distance)
    toy.finish(task)
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    assert toy.world.nearest > 0.03


@pytest.mark.parametrize("begin", [
    lambda navigator: navigator.base.back_up(1.0),
    lambda navigator: navigator.base.drive_on_heading(1.0),
    lambda navigator: navigator.base.spin(20.0),
])  # fmt: skip
def test_every_recovery_notices_that_it_stalls_and_runs_out_of_time(make, begin):
    toy = make(ToyWorld(room(8, 6), robot(), Pose2D(4.0, 3.0)))
    drive = toy.world.drive
    toy.world.drive = lambda twist: drive(STANDSTILL)
    task = begin(toy.navigator)
    toy.finish(task)
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert toy.world.time == pytest.approx(3.0, abs=0.2)
    toy.world.drive = lambda twist: drive(Twist(0.1 * twist.linear, 0.1 * twist.angular))
    task = begin(toy.navigator)
    toy.finish(task, 300)
    assert task.failure.code == FailureCode.TIMED_OUT


@pytest.mark.parametrize(
    ("rate", "remaining", "expected"),
    [
        (0.0, 1.0, 0.05),  # 1.0 m/s² · 0.05 s
        (0.19, 1.0, 0.2),  # its top speed
        (0.2, 0.03, 0.1),  # sqrt(0.01 + 0.03) - 0.1
        (0.2, 0.0, 0.02),  # a tenth of the top speed is always driven
    ],
)
def test_a_stroke_speeds_up_and_slows_down_by_its_acceleration(rate, remaining, expected):
    """Two periods late, braking at half its acceleration: sqrt((2 a T)² + a s) - 2 a T."""
    stroke = MotionProfile(1.0, 0.2, 1.0, 0.0, "m")
    assert stroke.next_rate(rate, remaining, 0.05) == pytest.approx(expected)
