"""Omnidirectional and car-like robots in the physics, against closed forms."""

from dataclasses import replace
from math import atan, hypot, pi, tan
from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.parameters import EkfParameters
from stack.sim.worlds.world import Box, FrictionZone
from stack.types import Pose2D, Twist
from tests.stack.sim.sim_rover import EMPTY, drive

OMNI, CAR = (read_robot(find_robot(name, Path())) for name in ("glide", "buggy"))
ROBOTS = pytest.mark.parametrize("robot", [OMNI, CAR], ids=["omni", "car"])
ORIGIN = Pose2D(0.0, 0.0)


def without_errors(robot):
    return replace(robot, odometry=replace(robot.odometry, scale_error=0.0, slip=0.0))


def way(speed, seconds):
    """Metres: speeding up at 1 m/s², then a while, then slowing down at 1.5 m/s²."""
    return speed * seconds - speed**2 / 2.0 + speed**2 / 3.0


@ROBOTS
def test_straight_ahead(build, robot):
    body = build(robot)
    drive(body, Twist(0.5), 4.0)
    assert body.truth.twist.linear == pytest.approx(0.5, rel=1e-3)
    drive(body, Twist(), 1.0)
    pose = body.truth.pose
    assert pose.x == pytest.approx(way(0.5, 4.0), rel=2e-3)
    assert abs(pose.y) < 1e-3
    assert abs(pose.heading) < 1e-3


@pytest.mark.parametrize("direction", np.arange(8) * pi / 4)
def test_the_omnidirectional_robot_drives_in_any_direction_without_turning(build, direction):
    body = build(OMNI)
    twist = Twist(0.4 * np.cos(direction), 0.0, 0.4 * np.sin(direction))
    drive(body, twist, 2.0)
    assert body.truth.twist.linear == pytest.approx(twist.linear, abs=1e-3)
    assert body.truth.twist.lateral == pytest.approx(twist.lateral, abs=1e-3)
    assert abs(body.truth.pose.heading) < 3e-3


def test_the_omnidirectional_robot_turns_while_driving(build):
    body = build(OMNI, start=Pose2D(1.0, 2.0, 0.0))
    drive(body, Twist(0.0, 0.8, 0.4), 1.0)
    seen = []
    for _ in range(160):
        drive(body, Twist(0.0, 0.8, 0.4), 0.05)
        seen.append(body.truth.pose)
    # Sideways at 0.4 m/s and turning at 0.8 rad/s: a circle of 0.5 m about a point behind it.
    centre, radius = fitted_circle(seen)
    assert radius == pytest.approx(0.5, rel=5e-3)
    middle = seen[80].compose(Pose2D(-0.5, 0.0))
    assert hypot(middle.x - centre[0], middle.y - centre[1]) < 5e-3


@pytest.mark.parametrize(("speed", "side"), [(0.6, 1.0), (0.6, -1.0), (-0.4, 1.0), (1.1, 1.0)])
def test_the_car_s_tightest_circle(build, speed, side):
    body = build(CAR)
    radius = 0.44 / tan(32 * pi / 180)  # wheelbase over the tangent of the steering angle
    assert CAR.turning_radius == pytest.approx(radius)
    drive(body, Twist(speed, side * 9.0), 1.5)
    seen = []
    for _ in range(round(2 * pi * radius / abs(speed) / 0.05)):
        drive(body, Twist(speed, side * 9.0), 0.05)
        seen.append(body.truth.pose)
    centre, found = fitted_circle(seen)
    assert found == pytest.approx(radius, rel=5e-3)
    # The centre lies on the rear axle's line, on the side that the wheels point at.
    left = side if speed > 0.0 else -side
    axis = seen[10].compose(Pose2D(0.0, left * radius))
    assert hypot(axis.x - centre[0], axis.y - centre[1]) < 0.01
    assert body.truth.twist.angular == pytest.approx(speed * left / radius, rel=5e-3)


def fitted_circle(poses):
    """Middle and radius, least squares (I. Kåsa, 1976)."""
    points = np.array([[pose.x, pose.y] for pose in poses])
    rows = np.column_stack([2.0 * points, np.ones(len(points))])
    x, y, rest = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    return (x, y), np.sqrt(rest + x * x + y * y)


def test_the_car_never_turns_in_place(build):
    body = build(CAR)
    drive(body, Twist(0.0, 1.5), 2.0)
    assert body.truth.pose.distance_to(ORIGIN) < 1e-3
    assert abs(body.truth.pose.heading) < 1e-3
    # Whatever is asked for, it turns no more than its way over its turning radius.
    random, turned, gone = np.random.default_rng(3), 0.0, 0.0
    for _ in range(60):
        before = body.truth.pose
        drive(body, Twist(random.uniform(-0.6, 1.2), random.uniform(-2, 2), 0.5), 0.25, 0.05)
        after = body.truth.pose
        step = before.distance_to(after)
        turn = abs(after.relative_to(before).heading)
        turned, gone = turned + turn, gone + step
        # A chord is shorter than its arc, and a step may hold a cusp; half a degree to spare.
        assert 2 * np.sin(min(turn, pi) / 2) * CAR.turning_radius <= step + 0.012 + 0.03
    assert turned > 3.0
    assert turned <= 1.1 * gone / CAR.turning_radius + 0.1


def test_the_car_s_front_wheels_stand_as_ackermann_says(build):
    body = build(CAR)
    drive(body, Twist(0.6, 9.0), 2.0)
    radius, half = CAR.turning_radius, CAR.wheels.track / 2
    left, right = body._robot.physics.steering_angles()
    assert left == pytest.approx(atan(0.44 / (radius - half)), abs=2e-3)
    assert right == pytest.approx(atan(0.44 / (radius + half)), abs=2e-3)


def test_the_car_steers_at_its_own_pace(build):
    body = build(CAR)
    drive(body, Twist(0.3), 1.0)
    angles = []
    for _ in range(20):
        drive(body, Twist(0.3, 9.0), 0.02, 0.02)
        angles.append(body._robot.drive.setpoint.steering)
    # 2 rad/s to 32 degrees: 0.279 s.
    assert np.diff(angles).max() <= 2.0 * 0.02 + 1e-9
    assert np.argmax(np.array(angles) >= 32 * pi / 180 - 1e-9) == round(0.28 / 0.02) - 1


@ROBOTS
def test_it_stands_still_where_it_stopped(build, robot):
    body = build(robot)
    drive(body, Twist(0.5, 0.6, 0.3), 2.0)
    drive(body, Twist(), 1.0)
    before = body.truth.pose
    drive(body, Twist(), 2.0)
    assert before.distance_to(body.truth.pose) < 1e-4
    assert abs(body.truth.pose.heading - before.heading) < 1e-4


MOTIONS = {
    "ahead": Twist(0.5), "left": Twist(0.0, 0.0, 0.5), "askew": Twist(0.3, 0.0, -0.3),
    "arc": Twist(0.5, 0.5), "back": Twist(-0.4, 0.4), "all": Twist(0.3, 0.7, 0.2),
}  # fmt: skip


@ROBOTS
@pytest.mark.parametrize("motion", MOTIONS)
def test_perfect_encoders_follow_the_truth(build, robot, motion):
    body = build(without_errors(robot))
    drive(body, MOTIONS[motion], 4.0)
    odometry, truth = body.sense().wheels, body.truth
    # 2 m on: ticks of 0.15 mm, and 0.2 mrad of steering.
    assert odometry.pose.distance_to(truth.pose) < 0.015
    assert abs(odometry.pose.heading - truth.pose.heading) < 0.01
    assert odometry.twist.linear == pytest.approx(truth.twist.linear, abs=0.01)
    assert odometry.twist.lateral == pytest.approx(truth.twist.lateral, abs=0.01)
    assert odometry.twist.angular == pytest.approx(truth.twist.angular, abs=0.01)


@ROBOTS
def test_the_gyro_corrects_the_heading_but_not_the_distance(build, robot):
    errors = []
    for seed in range(4):
        body = build(robot, seed=seed)
        fusion = EkfOdometry(EkfParameters(), robot)
        for seen in drive(body, Twist(), 1.0) + drive(body, Twist(0.4, 0.3, 0.3), 10.0):
            fused = fusion.update(seen)
        errors.append(fused.pose.distance_to(body.truth.pose))
        assert abs(fused.pose.heading - body.truth.pose.heading) < 0.02
        assert fused.twist.lateral == pytest.approx(body.truth.twist.lateral, abs=0.03)
    # 4 m: 1 % of scale error a wheel, 3 % of slip per root metre in three wheels at the most.
    assert max(errors) < 0.12
    assert max(errors) > 0.005


@pytest.mark.parametrize(
    ("robot", "twist", "heading"),
    [(OMNI, Twist(0.7), 0.0), (OMNI, Twist(0.0, 0.0, 0.7), -pi / 2),
     (OMNI, Twist(0.5, 0.0, 0.5), -pi / 4), (CAR, Twist(1.2), 0.0), (CAR, Twist(-0.6), pi),
     (CAR, Twist(0.8, 0.4), 0.0)],
    ids=["omni ahead", "omni sideways", "omni askew", "car ahead", "car back", "car on an arc"],
)  # fmt: skip
def test_a_wall_stops_it(build, robot, twist, heading):
    """The wall begins at x = 1.5; whatever it pushes, no corner of it gets 1 cm farther."""
    wall = Box(Pose2D(1.55, 0.0), (0.1, 8.0, 0.5))
    body = build(robot, replace(EMPTY, boxes=(wall,)), Pose2D(0.0, 0.0, heading))
    body.wait(0.3)
    farthest = []
    for _ in range(100):
        drive(body, twist, 0.05)
        farthest.append(body.truth.pose.transform(robot.footprint.points)[:, 0].max())
    assert 1.48 < max(farthest) < 1.51
    assert body.tally.by_robot >= 1
    assert body._robot.physics.base_state().rotation[8] > 0.999  # nor does it climb


@pytest.mark.parametrize(("robot", "twist"), [(OMNI, Twist(0.0, 0.0, 0.5)), (CAR, Twist(0.5))])
def test_ice_lets_the_wheels_spin(build, robot, twist):
    ice = FrictionZone((-3.0, -3.0, 3.0, 3.0), 0.02)
    body = build(robot, replace(EMPTY, friction_zones=(ice,)))
    drive(body, twist, 1.0)
    truth = body.truth.twist
    assert 0.02 < hypot(truth.linear, truth.lateral) < 0.3
    seen = body.sense().wheels.twist
    assert hypot(seen.linear, seen.lateral) == pytest.approx(0.5, rel=0.1)


def test_sideways_motion_is_not_a_standstill():
    assert Twist(0.001).stands
    assert not Twist(0.0, 0.0, 0.3).stands
