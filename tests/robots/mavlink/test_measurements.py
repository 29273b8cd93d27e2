"""Messages of emulated rovers as measurements, on a virtual clock, against the rover's truth."""

from math import hypot, inf, isnan, nan, pi

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as d

from robots.mavlink.measurements import Measurements, Stamps
from robots.mavlink.rover_link import Order, Phase
from stack.mavlink.link import Received
from stack.types import Battery, Imu, RangeReading, Scan
from tests.robots.mavlink.emulated_rover import Settings
from tests.robots.mavlink.virtual import World, heading_of


@pytest.fixture
def measured(description):
    """Drives a rover along orders; returns the world, the measurements and what they gave."""

    def drive(orders, odometry="auto", rangefinders=(), **settings):
        world = World(Settings(refuses_arming=0, **settings))
        measurements = Measurements(description, odometry, "lidar", rangefinders)
        world.run_until(lambda: world.link.phase is Phase.DRIVING, Order(engagement=1))
        found = []

        def each():
            for item in world.received:
                measurements.add(item)
            world.received.clear()
            found.append(measurements.take())

        each()
        found.clear()
        for linear, angular, seconds in orders:
            measurements.odometry.stands = linear == angular == 0.0
            world.run(seconds, Order(linear, angular, 1), each)
        return world, measurements, found

    return drive


CURVES = [(0.0, 0.0, 2.0), (0.6, 0.4, 5.0), (0.0, -1.0, 2.0), (-0.3, 0.0, 3.0), (0.5, -0.3, 5.0)]


@pytest.mark.parametrize("wheels", [False, True])
def test_odometry_follows_the_rover_in_motion(measured, wheels):
    world, measurements, _ = measured(CURVES, wheels=wheels)
    assert measurements.source == (
        "WHEEL_DISTANCE" if wheels else "ATTITUDE and LOCAL_POSITION_NED"
    )
    odometry, rover = measurements.odometry.at(world.now), world.rover
    # It moves at 0.5 m/s: 1 cm are 20 ms; the link's shortest delay is 2 ms, a cycle 10 ms.
    assert (odometry.pose.x, odometry.pose.y) == pytest.approx(
        (rover.north, -rover.east), abs=0.015
    )
    assert odometry.pose.heading == pytest.approx(heading_of(rover), abs=0.01)
    assert odometry.twist.linear == pytest.approx(0.5, abs=0.01)
    assert odometry.twist.angular == pytest.approx(-0.3, abs=0.01)


def test_noise_loss_delays_and_drift_are_borne(measured):
    world, measurements, _ = measured(
        [*CURVES, (0.0, 0.0, 3.0)], noise=1.0, loss=0.2, jitter=0.02, clock_drift=-1e-4
    )
    odometry, rover = measurements.odometry.at(world.now), world.rover
    # 20 s of velocities with 2 cm/s of noise each, 16 a second: 2 cm/s * sqrt(20 s / 16 Hz) = 2 cm
    place = hypot(odometry.pose.x - rover.north, odometry.pose.y + rover.east)
    assert place < 0.1
    assert odometry.pose.heading == pytest.approx(heading_of(rover), abs=0.03)
    assert odometry.twist.stands


def test_a_standing_rover_stays_where_it_is_in_spite_of_noise(measured):
    world, measurements, _ = measured([(0.0, 0.0, 30.0)], noise=1.0)
    # Some seconds before, it was not known yet that the rover stands.
    pose = measurements.odometry.at(world.now).pose
    assert hypot(pose.x, pose.y) < 0.02 and abs(pose.heading) < 0.03


def test_a_reset_of_the_autopilot_s_yaw_or_position_is_no_motion(measured):
    world, measurements, _ = measured([(0.0, 0.0, 1.0)])
    world.rover.yaw, world.rover.north = 1.0, 50.0  # its compass and its GPS have found themselves
    world.run(1.0, Order(engagement=1))
    for item in world.received:
        measurements.add(item)
    pose = measurements.odometry.at(world.now).pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_scans_show_the_room_at_their_stamps(measured):
    world, _, found = measured([(0.0, 0.5, 4.0)])
    scans = [new["lidar"] for new in found if "lidar" in new]
    assert len(scans) == pytest.approx(40, abs=2)
    scan = scans[-1]
    assert isinstance(scan, Scan) and scan.ranges.shape == (72,)
    assert scan.angle_increment == pytest.approx(pi / 36)
    assert abs(scan.angle_min + pi) < pi / 36  # behind the robot, to the left from there
    # At its stamp the rover was turned by 0.5 rad/s times its age less than now.
    turned = heading_of(world.rover) - 0.5 * (world.now - scan.stamp)
    c, s = np.cos(turned), np.sin(turned)
    walls = np.abs(scan.points() @ np.array([[c, s], [-s, c]]))
    assert np.allclose(walls.max(axis=1), 4.0, atol=0.02)  # a room of 8 m, from its middle


def test_beams_without_return_and_invalid_ones(description):
    measurements = Measurements(description, "auto", "lidar", ())
    distances = [65535] * 72
    distances[0], distances[1], distances[71] = 1201, 5, 300  # ahead, to the right, to the left
    measurements.add(
        Received(d.MAVLink_obstacle_distance_message(0, 0, distances, 5, 10, 1200, 0, 0, 12), 1.0)
    )
    scan = measurements.take()["lidar"]
    at = {round(np.degrees(angle)): r for angle, r in zip(scan.angles, scan.ranges, strict=True)}
    assert at[0] == inf and isnan(at[-5]) and at[5] == pytest.approx(3.0)
    assert isnan(at[90]) and (scan.range_min, scan.range_max) == (0.1, 12.0)


def test_part_of_a_turn(description):
    """A sensor that sees from 45° on the left to 45° on the right, with 10° between the beams."""
    measurements = Measurements(description, "auto", "lidar", ())
    distances = [100 + n for n in range(10)] + [65535] * 62
    message = d.MAVLink_obstacle_distance_message(0, 0, distances, 0, 10, 1200, 10.0, -45.0, 12)
    measurements.add(Received(message, 1.0))
    scan = measurements.take()["lidar"]
    left = int(np.argmin(np.abs(scan.angles - pi / 4)))
    right = int(np.argmin(np.abs(scan.angles + pi / 4)))
    assert scan.ranges[left] == pytest.approx(1.00) and scan.ranges[right] == pytest.approx(1.09)


def test_inertial_samples(measured):
    _, _, found = measured([(0.0, 0.0, 1.0), (0.0, 0.5, 3.0)])
    imus = [new["imu"] for new in found if "imu" in new]
    stamps = np.concatenate([imu.stamps for imu in imus])
    assert len(stamps) == pytest.approx(200, abs=10) and np.all(np.diff(stamps) > 0.0)
    last: Imu = imus[-1]
    assert last.angular_velocity[0] == pytest.approx([0.0, 0.0, 0.5], abs=0.001)  # to the left
    assert last.linear_acceleration[0] == pytest.approx([0.0, 0.0, 9.80665], abs=1e-4)  # upwards


@pytest.mark.parametrize("names", [(), ("front_left", "front")])
def test_rangefinders_by_direction_or_by_number(measured, names):
    """The emulated ones look to the left of ahead (0), ahead (1) and to the right of it (2)."""
    world, _, found = measured([(0.8, 0.0, 2.0), (0.0, 0.0, 1.0)], rangefinders=names)
    readings = {}
    for new in found:
        readings |= {n: one for n, one in new.items() if isinstance(one, RangeReading)}
    assert readings.keys() == {"front_left", "front"}
    ahead = world.rover.range_at(0.0)
    assert ahead < 3.0 and readings["front"].distance == pytest.approx(ahead, abs=0.01)
    assert readings["front"].mount.x == 0.22


def test_battery(measured, description):
    _, measurements, found = measured([(0.0, 0.0, 3.0)], battery=42)
    assert [new["battery"].charge for new in found if "battery" in new] == [0.42] * 3
    # One whose charge is not told: by its voltage, between 20.0 and 25.2 V of the robot file.
    measurements = Measurements(description, "auto", "lidar", ())
    cells = [11300, 11300, *[65535] * 8]
    measurements.add(
        Received(d.MAVLink_battery_status_message(0, 0, 0, 0, cells, -1, -1, -1, -1), 1.0)
    )
    battery: Battery = measurements.take()["battery"]
    assert battery.charge == pytest.approx((22.6 - 20.0) / 5.2) and battery.voltage == 22.6


def test_the_milliseconds_since_the_start_wrap_after_49_days():
    stamps, begin = Stamps(), (1 << 32) - 5000
    for n in range(200):
        milliseconds = (begin + 50 * n) % (1 << 32)
        message = d.MAVLink_attitude_message(milliseconds, nan, nan, nan, nan, nan, nan)
        at = 1000.0 + 0.05 * n
        assert stamps.of(Received(message, at)) == pytest.approx(at, abs=1e-6)
    assert stamps.clocks["boot"].restarts == 0
    late = d.MAVLink_attitude_message(4500, nan, nan, nan, nan, nan, nan)
    assert stamps.of(Received(late, 1009.95)) == pytest.approx(1009.5, abs=1e-3)
