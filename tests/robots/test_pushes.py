"""Pushes of a simulated robot: the body moves, its wheels do not measure it."""

from dataclasses import replace
from math import hypot, radians

import numpy as np
import pytest

from stack.body import ContactTally
from stack.sim.worlds.world import Box, Push, Trigger, WorldEvent
from stack.types import Pose2D, Twist, wrap_angle
from tests.stack.sim.sim_rover import EMPTY, EQUIPPED, drive


@pytest.fixture
def pushed(build):
    def make(push, world=EMPTY, start=Pose2D(0.0, 0.0), more=()):
        event = WorldEvent(Trigger(time=1.0), push=push)
        return build(EQUIPPED, replace(world, timeline=(event, *more)), start)

    return make


@pytest.mark.parametrize("by", [Pose2D(0.5, 0.0, 0.0), Pose2D(-0.1, 0.4, radians(60))])
@pytest.mark.parametrize("frame", ["robot", "map"])
def test_a_standing_robot_is_displaced_and_its_wheels_stand(pushed, by, frame):
    start = Pose2D(1.0, 2.0, 0.7)
    body = pushed(Push(by, 0.6, frame), start=start)
    felt = drive(body, Twist(), 2.5)
    end = start.compose(by) if frame == "robot" else Pose2D(1.0 + by.x, 2.0 + by.y)
    truth = body.truth.pose
    assert truth.distance_to(end) < 0.01
    assert wrap_angle(truth.heading - start.heading) == pytest.approx(by.heading, abs=0.01)
    assert hypot(body.truth.twist.linear, body.truth.twist.lateral) < 1e-3
    wheels = felt[-1].wheels.pose
    assert hypot(wheels.x, wheels.y) < 3e-3 and abs(wheels.heading) < 0.02
    kinds, texts, _ = zip(*body.take_events(), strict=True)
    assert kinds == ("pushed", "pushed")
    assert texts[1].startswith("the push ended; the robot moved by (")


def test_the_imu_feels_the_push(pushed):
    body = pushed(Push(Pose2D(0.4, 0.0, radians(40)), 0.5))
    imu = [sensed.imu for sensed in drive(body, Twist(), 2.0) if sensed.imu is not None]
    stamps = np.concatenate([samples.stamps for samples in imu])
    rates = np.concatenate([samples.angular_velocity[:, 2] for samples in imu])
    during = (stamps > 0.99) & (stamps < 1.51)
    turned = float(np.mean(rates[during])) * 0.52
    assert turned == pytest.approx(radians(40), abs=0.05)
    forward = np.concatenate([samples.linear_acceleration[:, 0] for samples in imu])
    # s'' of u - sin(2 pi u) / (2 pi): 2 pi * 0.4 m / (0.5 s)^2
    assert float(np.max(forward)) == pytest.approx(10.05, rel=0.3)


def test_a_push_adds_to_the_motion_of_a_driving_robot(pushed):
    body = pushed(Push(Pose2D(0.0, 0.3, 0.0), 0.5))
    felt = drive(body, Twist(0.4), 3.0)
    wheels, truth = felt[-1].wheels.pose, body.truth.pose
    assert truth.x == pytest.approx(wheels.x, abs=0.05)
    assert truth.y == pytest.approx(0.3, abs=0.02)
    assert abs(wheels.y) < 0.1
    assert body.truth.twist.linear == pytest.approx(0.4, abs=0.02)


def test_a_contact_during_a_push_is_not_one_of_the_driving_robot(pushed):
    world = replace(EMPTY, boxes=(Box(Pose2D(1.0, 0.0), (0.5, 2.0, 0.5)),))
    body = pushed(Push(Pose2D(2.0, 0.0, 0.0), 1.0), world)
    drive(body, Twist(-0.1), 1.8)
    assert body.tally == ContactTally(by_robot=0, against_standing=1)


def test_a_push_stops_at_an_obstacle(pushed):
    world = replace(EMPTY, boxes=(Box(Pose2D(1.0, 0.0), (0.5, 2.0, 0.5)),))
    body = pushed(Push(Pose2D(2.0, 0.0, 0.0), 1.0), world)
    drive(body, Twist(), 3.0)
    # The box begins at x = 0.75; the rover is 0.18 m long in front of its base.
    assert body.truth.pose.x == pytest.approx(0.57, abs=0.03)
    assert body.tally == ContactTally(by_robot=0, against_standing=1)
    texts = [event.text for event in body.take_events() if event.kind == "pushed"]
    assert texts[-1].startswith("the push was stopped by an obstacle; the robot moved by (0.5")


def test_a_lift_ends_a_push(pushed):
    lift = WorldEvent(Trigger(time=1.5), move_robot=Pose2D(5.0, 5.0))
    body = pushed(Push(Pose2D(1.0, 0.0, 0.0), 2.0), more=(lift,))
    drive(body, Twist(0.5), 3.0)
    assert body.truth.pose.y == pytest.approx(5.0, abs=0.02)
    assert body.truth.pose.x > 5.3  # the wheels have their grip again
    assert body.tally == ContactTally()
