"""A skid-steered robot turns about the centres of rotation of its sides, and odometry suffers."""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from robots.simulated import SimulatedBody
from stack.drivetrain.description import OdometryNoise
from stack.drivetrain.limits import Limits
from stack.drivetrain.skid_steered import Skid, SkidWheels
from stack.sim.worlds.world import FrictionZone
from stack.types import Pose2D, Twist, wrap_angle
from tests.stack.sim.sim_rover import EMPTY, drive

TRACK = 0.376
EXACT = Skid(icr_ratio=1.5, floor_variation=0.0, variation=0.0)
JACKAL = replace(
    read_robot(find_robot("jackal", Path())), camera=None, lidar=None,
    odometry=OdometryNoise(scale_error=0.0, slip=0.0, ticks_per_turn=1 << 20),
)  # fmt: skip


def turned(skid, effective_track, *, seed=1, seconds=4.0, world=EMPTY, start=Pose2D(0.0, 0.0)):
    """Angles that the robot and its odometry turned at 1 rad/s, radians."""
    wheels = replace(JACKAL.wheels, effective_track=effective_track)
    body = SimulatedBody(replace(JACKAL, skid=skid, wheels=wheels), world, start=start, seed=seed)
    truth = odometry = 0.0
    last, estimated = body.truth.pose.heading, 0.0
    for _ in range(round(seconds / 0.05)):
        (seen,) = drive(body, Twist(0.0, 1.0), 0.05)
        truth += wrap_angle(body.truth.pose.heading - last)
        odometry += wrap_angle(seen.wheels.pose.heading - estimated)
        last, estimated = body.truth.pose.heading, seen.wheels.pose.heading
    body.close()
    return truth, odometry


def test_wheels_and_base_are_joined_by_the_effective_track():
    """Mandow et al. 2007: w = (vr - vl) / (yl - yr), and vy = -x0 w off the ICRs."""
    wheels = SkidWheels(("l",), ("r",), 0.1, track=0.4, effective_track=0.6, icr_offset=0.05)
    drivetrain = wheels.drivetrain(Limits())
    assert drivetrain.skids and drivetrain.turns_in_place
    moved = drivetrain.from_wheels([-0.3, 0.3], [0.0, 0.0])
    assert (moved.x, moved.y, moved.heading) == pytest.approx((0.0, -0.05, 1.0))
    speeds = drivetrain.to_wheels(drivetrain.state_at(Twist(0.5, 1.0), drivetrain.at_rest)).speeds
    assert speeds == pytest.approx((2.0, 8.0))  # (0.5 -+ 0.3) / 0.1


def test_a_robot_that_is_not_calibrated_turns_less_and_believes_more():
    # 1 rad/s for the plain track is 1 / 1.5 rad/s for centres of rotation 1.5 times as far apart.
    truth, odometry = turned(EXACT, TRACK)
    assert odometry == pytest.approx(4.0, abs=0.1)  # less what speeding up at 10 rad/s² takes
    assert truth == pytest.approx(odometry / 1.5, rel=5e-3)


def test_a_calibrated_robot_turns_as_commanded_and_its_odometry_agrees():
    truth, odometry = turned(EXACT, 1.5 * TRACK)
    assert truth == pytest.approx(4.0, abs=0.1)
    assert odometry == pytest.approx(truth, rel=5e-3)


def test_the_calibrated_odometry_still_varies():
    skid = replace(EXACT, floor_variation=0.05)
    ratios = []
    for seed in range(12):
        truth, odometry = turned(skid, 1.5 * TRACK, seed=seed, seconds=1.0)
        ratios.append(odometry / truth)
    # One draw for each run; 12 samples estimate 0.05 within a factor of two (chi², 99 %).
    assert 0.025 < np.std(ratios) < 0.1


def test_the_variation_along_the_way_averages_out():
    # The mean of a Gauss-Markov process over n lengths has 2 / n of its variance. In 6 s the wheels
    # roll 0.282 m/s * 6 s = 34 lengths of 5 cm: 0.1 sqrt(2 / 34) = 0.024, within a factor of two.
    skid = replace(EXACT, variation=0.1, variation_length=0.05)
    runs = [turned(skid, 1.5 * TRACK, seed=seed, seconds=6.0) for seed in range(12)]
    assert 0.012 < np.std([odometry / truth for truth, odometry in runs]) < 0.048


def test_slip_0_switches_the_sliding_off():
    truth, odometry = turned(replace(Skid(), slip=0.0), TRACK)
    assert truth == pytest.approx(odometry, rel=5e-3)
    assert truth == pytest.approx(4.0, abs=0.1)


def test_each_floor_has_its_own_ratio():
    zone = FrictionZone((-1.0, -1.0, 1.0, 1.0), 0.9)
    world = replace(EMPTY, friction_zones=(zone,))
    skid = replace(EXACT, floor_variation=0.1)
    inside, outside = (
        turned(skid, 1.5 * TRACK, world=world, start=Pose2D(x, 0.0)) for x in (0.0, 5.0)
    )
    assert inside[1] / inside[0] != pytest.approx(outside[1] / outside[0], rel=0.01)
    elsewhere = turned(skid, 1.5 * TRACK, world=world, start=Pose2D(-5.0, 3.0))
    assert elsewhere == pytest.approx(outside, rel=1e-3)


def test_straight_drives_do_not_skid():
    body = SimulatedBody(
        replace(JACKAL, skid=Skid(variation=0.2, floor_variation=0.2)), EMPTY,
        start=Pose2D(0.0, 0.0), seed=3,
    )  # fmt: skip
    seen = drive(body, Twist(0.5), 2.0)[-1]
    assert body.truth.pose.heading == pytest.approx(0.0, abs=1e-3)
    assert seen.wheels.pose.x == pytest.approx(body.truth.pose.x, rel=2e-3)
    body.close()


def test_the_same_seed_gives_the_same_run():
    runs = [turned(Skid(), 1.5 * TRACK, seed=seed, seconds=1.0) for seed in (4, 4, 5)]
    assert runs[0] == runs[1] != runs[2]


def test_the_axle_of_the_urdf_is_the_line_of_the_centres():
    """With the axle 5 cm ahead the base's origin moves by -0.05 w sideways, as the model says."""
    urdf = JACKAL.model
    for side in ("0 0.117 0.098", "0 -0.117 0.098"):
        assert side in urdf
        urdf = urdf.replace(f'"{side}"', f'"0.05{side[1:]}"')
    wheels = replace(JACKAL.wheels, icr_offset=0.05)
    robot = replace(JACKAL, model=urdf, wheels=wheels, skid=EXACT)
    body = SimulatedBody(robot, EMPTY, start=Pose2D(0.0, 0.0), seed=1)
    seen = drive(body, Twist(0.0, 1.0), 0.5 * pi)[-1]
    truth, odometry = body.truth.pose, seen.wheels.pose
    # A turn by the angle a about (0.05, 0): the origin ends at 0.05 (1 - cos a, -sin a).
    expected = 0.05 * (1.0 - np.cos(truth.heading)), -0.05 * np.sin(truth.heading)
    assert (truth.x, truth.y) == pytest.approx(expected, abs=2e-3)
    assert (odometry.x, odometry.y) == pytest.approx(expected, abs=2e-3)
    body.close()
