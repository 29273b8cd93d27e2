"""Every sensor with a rate delivers its number of measurements, whatever the physics period."""

from dataclasses import replace
from math import floor, pi

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots.scripted import scans_of
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.drivetrain.description import ImuDescription, SonarDescription
from stack.types import Image, Pose2D, RangeReading, Scan, Twist
from tests.stack.sim.sim_rover import CAMERA, EQUIPPED, LIDAR, ROVER, square_room

ORIGIN = Pose2D(0.0, 0.0)
ROOM = square_room(4.0)
PERIOD = 0.002
"""Of the physics, seconds: each step is looked at, so that no measurement replaces another one."""


def lidar(rate, rotation, view=2.0 * pi):
    return replace(LIDAR, rate=rate, rotation_time=rotation, field_of_view=view, beams=12)


def observed(description, seconds, period=PERIOD, **command):
    body = SimulatedBody(description, ROOM, start=ORIGIN, seed=1)
    try:
        seen = [body.sense()]
        for _ in range(round(seconds / period)):
            body.command(BodyCommand(Twist(0.2, 0.5), **command))
            body.wait(period)
            seen.append(body.sense())
        return seen
    finally:
        body.close()


LIDARS = st.lists(
    st.tuples(st.floats(1.0, 60.0), st.floats(0.0, 1.0)), min_size=1, max_size=4
)  # fmt: skip
"""Rate, and the share of the period in which the lidar turns once."""


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(lidars=LIDARS, sonar=st.floats(1.0, 60.0), imu=st.floats(1.0, 500.0))
def test_lidars_sonars_and_imu_deliver_at_any_rate(lidars, sonar, imu):
    described = {f"lidar_{n}": lidar(rate, share / rate) for n, (rate, share) in enumerate(lidars)}
    robot = replace(
        ROVER, lidars=described, imu=ImuDescription(rate=imu),
        sonars={"sonar": SonarDescription(ORIGIN, rate=sonar)},
    )  # fmt: skip
    seen = observed(robot, 3.0)
    for name, sensor in described.items():
        scans = [o.named(name, Scan) for o in seen if o.named(name, Scan)]
        # one more at time 0 without a turn; one less by a turn that ends before the next is due
        assert abs(len(scans) - floor(3.0 * sensor.rate)) <= 1, (name, sensor.rate)
        gaps = np.diff([scan.stamp for scan in scans])
        assert np.abs(gaps - 1.0 / sensor.rate).max(initial=0.0) <= PERIOD + 1e-9
    assert abs(sum("sonar" in o.of(RangeReading) for o in seen) - (1 + floor(3.0 * sonar))) <= 1
    assert abs(sum(o.imu.stamps.size for o in seen if o.imu) - floor(3.0 * imu)) <= 1


@pytest.mark.parametrize("rate", [5.0, 10.0, 12.0, 12.5, 15.0, 20.0])
def test_one_turning_lidar_or_three_lose_no_scan_in_control_periods(rate):
    """Its time of a turn is its period, as of real lidars: all but the first turn are delivered."""
    turning = lidar(rate, 1.0 / rate)
    robot = replace(ROVER, lidars={"a": turning, "b": turning, "c": replace(turning, mount=ORIGIN)})
    seen = observed(robot, 10.0, period=0.05)
    for name in robot.lidars:
        assert abs(sum(name in o.measurements for o in seen) - 10.0 * rate) <= 1


def test_a_lidar_that_turns_longer_than_its_period_begins_late_and_then_keeps_its_rate():
    slow = replace(ROVER, lidars={"a": lidar(40.0, 0.15)})
    stamps = [o.named("a", Scan).stamp for o in observed(slow, 2.0) if o.named("a", Scan)]
    assert len(stamps) == pytest.approx((2.0 - 0.15 * 11 / 12) * 40.0, abs=1)


@pytest.mark.parametrize(("rate", "latency"), [(12.0, 0.0), (15.0, 0.02), (15.0, 0.3)])
def test_a_camera_delivers_at_a_rate_that_no_control_period_divides(rate, latency):
    small = replace(CAMERA, rate=rate, latency=latency)
    robot = replace(ROVER, camera=replace(small, model=replace(small.model, width=32, height=24)))
    seen = observed(robot, 2.0, period=0.05, capture=True)
    pictures = [o.named("camera", Image) for o in seen if o.named("camera", Image)]
    assert abs(len(pictures) - rate * (2.0 - latency)) <= 1


def test_scripted_lidars_keep_their_rate():
    measure = scans_of(replace(EQUIPPED, lidar=replace(LIDAR, rate=15.0)), ROOM)
    assert abs(sum("lidar" in measure(n * 0.05, ORIGIN) for n in range(200)) - 150) <= 1


def test_the_imu_measures_an_acceleration_between_uneven_steps():
    quiet = ImuDescription(150.0, 0.0, 0.0, 0.0, 0.0)  # samples 3 and 4 physics steps apart
    body = SimulatedBody(replace(EQUIPPED, imu=quiet), ROOM, start=ORIGIN, seed=1)
    try:
        for _ in range(8):
            body.command(BodyCommand(Twist(0.5)))
            body.wait(0.05)
            imu = body.sense().imu
        assert imu.linear_acceleration[:, 0].mean() == pytest.approx(1.0, abs=0.1)
    finally:
        body.close()
