"""Our estimate of the pose as the rover's filter gets it."""

from math import inf, pi

import pytest
from pymavlink.dialects.v20 import all as dialect

from robots.mavlink.estimates import SentEstimate
from robots.mavlink.rover_link import Order, Phase
from tests.robots.mavlink.emulated_rover import Settings
from tests.robots.mavlink.virtual import World

ESTIMATE = SentEstimate(
    (3.0, 7.0, pi / 2), ((0.1, 0.02, 0.0), (0.02, 0.2, 0.0), (0.0, 0.0, 0.3)), (0.5, 0.1, 0.2), 7,
    100.0,
)  # fmt: skip


def test_bytes_give_the_same_estimate():
    assert SentEstimate.unpacked(ESTIMATE.packed()) == ESTIMATE
    standing = SentEstimate((1.0, 2.0, 0.5))
    assert SentEstimate.unpacked(standing.packed()) == standing and standing.until == inf


def test_vision_position_is_north_east_and_yaw():
    m = ESTIMATE.message("vision_position", dialect, 99.0)
    assert (m.x, m.y, m.yaw) == (7.0, 3.0, 0.0)  # facing north, on a map whose x axis points east
    assert (m.usec, m.reset_counter) == (99_000_000, 7)
    # North is our y: its variance comes first.
    assert (m.covariance[0], m.covariance[1], m.covariance[5]) == (0.2, 0.02, 0.0)


def test_odometry_is_in_frames_that_ardupilot_takes():
    m = ESTIMATE.message("odometry", dialect, 99.0)
    assert (m.frame_id, m.child_frame_id) == (20, 12)  # LOCAL_FRD and BODY_FRD
    assert (m.x, m.y) == (3.0, -7.0) and (m.vx, m.vy, m.yawspeed) == (0.5, -0.1, -0.2)
    w, x, y, z = m.q
    assert (w, x, y, z) == pytest.approx((0.5**0.5, 0.0, 0.0, -(0.5**0.5)))
    packed = m.pose_covariance  # of x with x, y and yaw
    assert (packed[0], packed[1], packed[5]) == (0.1, -0.02, 0.0)


def test_an_old_estimate_is_not_sent():
    assert ESTIMATE.message("odometry", dialect, 100.1) is None


def test_a_rover_without_gps_drives_by_our_estimate():
    """It needs an origin first, and estimates that do not stop."""
    world = World(Settings(vision_only=True), origin=(48.0, 11.0))
    world.run(5.0, Order(engagement=1))
    assert world.link.phase is Phase.ENGAGING  # it has no position
    estimate = SentEstimate((1.0, 2.0, 0.0))
    world.link.estimate = lambda d, now: estimate.message("vision_position", d, now)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, Order(engagement=1))
    seen = len(world.rover.visions)
    world.run(5.0, Order(0.5, 0.0, 1))
    assert len(world.rover.visions) - seen == pytest.approx(100, abs=2)  # 20 Hz
    assert world.rover.visions[-1][1:4] == pytest.approx((2.0, 1.0, pi / 2))
