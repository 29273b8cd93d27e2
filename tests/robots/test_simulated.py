from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import stack.sim.pace
from stack.body import BodyCommand
from stack.errors import ParameterError
from stack.sim.worlds.world import FrictionZone
from stack.types import Image, Pose2D, Scan, Twist
from tests.stack.sim.sim_rover import CAMERA, EMPTY, EQUIPPED, LIDAR, ROVER, drive, square_room

ORIGIN = Pose2D(0.0, 0.0)


def test_straight_ahead(build):
    body = build()
    drive(body, Twist(0.5), 4.0)
    steady = body.truth.twist
    drive(body, Twist(), 1.0)
    pose = body.truth.pose
    # 0.5 m/s for 4 s, less 0.5^2 / 2 while speeding up at 1, plus 0.5^2 / 3 while slowing at 1.5
    assert pose.x == pytest.approx(4.0 * 0.5 - 0.125 + 0.0833, rel=0.01)
    assert abs(pose.y) < 0.01
    assert steady.linear == pytest.approx(0.5, rel=0.01)
    assert abs(steady.angular) < 0.005


def test_spin_on_the_spot(build):
    body = build()
    drive(body, Twist(0.0, 1.0), 1.5)
    assert body.truth.twist.angular == pytest.approx(1.0, rel=0.01)
    drive(body, Twist(), 0.8)
    # Both ramps alike, so the angle is speed times time.
    assert body.truth.pose.heading == pytest.approx(1.5, rel=0.01)
    assert np.hypot(body.truth.pose.x, body.truth.pose.y) < 0.01


def test_it_stops_within_the_braking_distance(build):
    body = build()
    drive(body, Twist(0.6), 2.0)
    before = body.truth.pose.x
    drive(body, Twist(), 1.0)
    assert body.truth.pose.x - before == pytest.approx(0.6**2 / (2 * 1.5), abs=0.004)
    assert abs(body.truth.twist.linear) < 1e-3


def test_ramps_respect_the_acceleration_limits(build):
    body = build()
    body.wait(0.5)  # for the springs of the casters to settle
    speeds = [0.0]
    for target in (0.8, 0.0):
        for _ in range(100):
            body.command(BodyCommand(Twist(target)))
            body.wait(0.01)
            speeds.append(body.truth.twist.linear)
    gains = [(b - a) / 0.01 for a, b in pairwise(speeds)]
    assert max(gains) < 1.0 * 1.1
    assert min(gains) > -1.5 * 1.1


def test_without_commands_it_stops(build):
    body = build()
    drive(body, Twist(0.5), 2.0)
    begin = body.truth.pose.x
    body.wait(0.1)  # it begins 0.15 s after the last command, which came 0.05 s ago
    assert body.truth.twist.linear == pytest.approx(0.5, rel=0.01)
    body.wait(1.0)
    assert abs(body.truth.twist.linear) < 1e-3
    # 0.1 s at 0.5 m/s, then 0.5^2 / (2 * 3)
    assert body.truth.pose.x - begin == pytest.approx(0.5 * 0.1 + 0.0417, abs=0.005)


def test_odometry_follows_the_truth_within_its_errors(build):
    perfect = replace(ROVER.odometry, scale_error=0.0, slip=0.0)
    body = build(replace(ROVER, odometry=perfect))
    drive(body, Twist(0.4, 0.5), 5.0)
    drive(body, Twist(), 0.5)
    odometry, truth = body.sense().wheels, body.truth
    assert odometry.stamp == pytest.approx(5.5)
    assert odometry.pose.distance_to(truth.pose) < 0.01
    assert odometry.pose.heading == pytest.approx(truth.pose.heading, abs=0.01)


def test_observations_come_at_the_sensors_rates(build):
    body = build(replace(EQUIPPED, lidar=replace(LIDAR, rate=10.0)), square_room(4.0))
    first = body.sense()
    assert first.named("lidar", Scan).stamp == 0.0
    assert first.imu is None
    seen = drive(body, Twist(0.3), 1.0)
    scans = [o.named("lidar", Scan).stamp for o in seen if o.named("lidar", Scan) is not None]
    assert scans == pytest.approx(np.arange(1, 11) / 10)
    stamps = np.concatenate([o.imu.stamps for o in seen])
    assert stamps == pytest.approx(np.arange(1, 101) / 100)
    assert not any("camera" in o.measurements for o in seen)


def test_the_imu_feels_gravity_acceleration_and_turning(build):
    quiet = replace(EQUIPPED.imu, gyro_noise=0.0, gyro_bias=0.0,
                    accelerometer_noise=0.0, accelerometer_bias=0.0)  # fmt: skip
    body = build(replace(EQUIPPED, imu=quiet))
    speeding = drive(body, Twist(0.5), 0.45)[-1].imu
    assert speeding.linear_acceleration[:, 0].mean() == pytest.approx(1.0, abs=0.1)
    assert speeding.linear_acceleration[:, 2].mean() == pytest.approx(9.81, abs=0.1)
    drive(body, Twist(0.5, 1.0), 1.0)
    turning = drive(body, Twist(0.5, 1.0), 0.5)[-1].imu
    assert turning.angular_velocity[:, 2].mean() == pytest.approx(1.0, rel=0.01)
    # v w = 0.5 m/s2 towards the middle of the circle, to the left
    assert turning.linear_acceleration[:, 1].mean() == pytest.approx(0.5, abs=0.05)


def test_ice_lets_the_wheels_spin(build):
    ice = FrictionZone((-1.0, -1.0, 5.0, 1.0), 0.02)
    body = build(world=replace(EMPTY, friction_zones=(ice,)))
    drive(body, Twist(0.5), 1.0)
    # A grip of 0.02 g = 0.196 m/s2 at the most, so 0.2 m/s after a second.
    assert 0.02 < body.truth.twist.linear < 0.2
    assert body.sense().wheels.twist.linear == pytest.approx(0.5, rel=0.05)
    beside = build(world=replace(EMPTY, friction_zones=(ice,)), start=Pose2D(0.0, 4.0))
    drive(beside, Twist(0.5), 1.0)
    assert beside.truth.twist.linear == pytest.approx(0.5, rel=0.01)


def test_a_control_period_that_does_not_divide_is_refused(build):
    body = build()
    with pytest.raises(ParameterError, match=r"0\.003 s is not a multiple .* period 0\.002 s"):
        body.wait(0.003)


class Clock:
    """Stands for the time module: sleeping is all that lets it pass."""

    def __init__(self):
        self.now, self.slept = 0.0, []

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds


def test_pace_is_kept_against_the_wall_clock(build, monkeypatch):
    clock = Clock()
    monkeypatch.setattr(stack.sim.pace, "wall_clock", clock)
    body = build(pace=2.0)
    for _ in range(4):
        body.wait(0.1)
    assert clock.now == pytest.approx(0.15)  # the last tenth of a second is still to be slept
    assert body.rest(1.0)
    assert clock.now == pytest.approx(0.2)
    clock.now += 0.03  # slow for once: made up for
    body.wait(0.1)
    assert body.rest(1.0)
    assert clock.now == pytest.approx(0.25)
    clock.now += 1.0  # too far behind: forgotten
    body.wait(0.1)
    assert body.rest(1.0)
    assert clock.now == pytest.approx(1.3)
    body.pace = 0.0
    body.wait(0.1)
    assert body.rest(1.0)
    assert clock.now == pytest.approx(1.3)


def test_slow_motion_rests_in_short_pieces_and_ends_with_a_new_pace(build, monkeypatch):
    """At a pace of 0.001 a wait of 0.05 s used to sleep for 50 s without a break."""
    clock = Clock()
    monkeypatch.setattr(stack.sim.pace, "wall_clock", clock)
    body = build(pace=0.001)
    body.wait(0.05)
    assert [body.rest(0.01) for _ in range(3)] == [False, False, False]
    assert clock.slept == pytest.approx([0.01, 0.01, 0.01])
    body.pace = 1.0
    assert body.rest(0.01) and clock.now == pytest.approx(0.03)


def test_images_arrive_after_their_latency(build):
    body = build(replace(EQUIPPED, camera=replace(CAMERA, rate=5.0, latency=0.1)))
    arrivals = []
    for _ in range(12):
        body.command(BodyCommand(capture=True))
        body.wait(0.05)
        image = body.sense().named("camera", Image)
        if image is not None:
            arrivals.append((round(image.stamp, 6), round(body.time, 6)))
    assert arrivals == [(0.0, 0.1), (0.2, 0.3), (0.4, 0.5)]


def test_closing_twice_is_safe(build):
    body = build()
    body.close()
    body.close()
