"""Zones round the robot, speed limits of a place, closed loop and dead band, by hand."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import ParameterError
from stack.safety.parameters import SafetyParameters
from stack.safety.smoother import beyond_dead_band
from stack.safety.zones import SafetyZone, ZoneMonitor, read_safety_zones
from stack.types import STANDSTILL, Footprint, Pose2D, Twist
from tests.stack.navigation.toy_world import ToyWorld, robot, room
from tests.stack.safety.obstacles import SafetyStage, standing

PERIOD = 0.05
FRONT = [[0.2, -0.4], [1.2, -0.4], [1.2, 0.4], [0.2, 0.4]]
ROUND = Footprint.circle(0.25)
SOMETHING = np.array([[0.8, y] for y in (-0.1, 0.0, 0.1, 0.2)])


def monitor(**values):
    return ZoneMonitor(read_safety_zones([{"corners": FRONT, **values}]), ROUND)


def limited(twist, things=SOMETHING, **values):
    return said(*monitor(**values).limited(twist, things))


def said(twist, limitation):
    """The twist, and the limitation as a sentence; empty without one."""
    return twist, "" if limitation is None else limitation.text


def test_a_slow_down_zone_drives_at_its_share():
    twist, reason = limited(Twist(0.8, 0.2), action="slow_down", ratio="30 %", name="front")
    assert (twist.linear, twist.angular) == (pytest.approx(0.24), pytest.approx(0.06))
    assert reason == "slower: obstacle in the zone 'front', 30% of the speed"


def test_a_limit_zone_keeps_the_arc_below_both_limits():
    twist, _ = limited(Twist(0.8, 0.4), action="limit", linear=0.4, angular=0.5)
    assert (twist.linear, twist.angular) == (pytest.approx(0.4), pytest.approx(0.2))
    twist, _ = limited(Twist(0.3, 1.5), action="limit", linear=0.4, angular=0.5)
    assert (twist.linear, twist.angular) == (pytest.approx(0.1), pytest.approx(0.5))
    assert limited(Twist(0.3, 0.4), action="limit") == (Twist(0.3, 0.4), "")


def test_a_stop_zone_lets_the_robot_only_drive_away():
    assert limited(Twist(0.3), name="front") == (
        STANDSTILL, "stopped: obstacle in the zone 'front'",
    )  # fmt: skip
    assert limited(Twist(angular=1.0))[0] == STANDSTILL
    assert limited(Twist(-0.2)) == (Twist(-0.2), "")


def test_an_approach_zone_keeps_its_time_to_contact():
    # the outline's front edge at 1.2 m: something 2.2 m ahead is met after 1 m, 2 s at 0.5 m/s
    far = np.array([[2.2, 0.0]])
    twist, _ = limited(Twist(0.5), far, action="approach", time=4.0)
    assert twist.linear == pytest.approx(0.5 * 2.0 / 4.0, abs=0.005)
    assert limited(Twist(0.5), far, action="approach", time=1.9) == (Twist(0.5), "")


def test_fewer_points_than_it_takes_are_nothing():
    assert limited(Twist(0.3), SOMETHING[:3]) == (Twist(0.3), "")
    assert limited(Twist(0.3), SOMETHING[:3], points=3)[0] == STANDSTILL
    assert limited(Twist(0.3), np.empty((0, 2))) == (Twist(0.3), "")


def test_a_zone_may_hold_for_some_speeds_only():
    assert limited(Twist(0.3), speed_from=0.5) == (Twist(0.3), "")
    assert limited(Twist(0.6), speed_from=0.5)[0] == STANDSTILL
    assert limited(Twist(0.6), speed_to=0.5) == (Twist(0.6), "")


def test_a_zone_may_hold_for_one_speed_alone():
    assert limited(Twist(0.3), speed_from=0.3, speed_to=0.3)[0] == STANDSTILL
    for other in (Twist(0.29), Twist(0.31)):
        assert limited(other, speed_from=0.3, speed_to=0.3) == (other, "")


def test_a_zone_for_driving_backward_leaves_driving_forward_alone():
    assert limited(Twist(0.2), speed_to=0.0) == (Twist(0.2), "")
    behind = np.array([[0.8 - 1.5, y] for y in (-0.1, 0.0, 0.1, 0.2)])
    corners = [[-1.2, -0.4], [-0.2, -0.4], [-0.2, 0.4], [-1.2, 0.4]]
    for twist, driven in ((Twist(-0.2), STANDSTILL), (Twist(0.2), Twist(0.2))):
        assert limited(twist, behind, corners=corners, speed_to=0.0)[0] == driven


def test_the_strictest_zone_has_its_say():
    zones = read_safety_zones([
        {"action": "slow_down", "radius": 2.0, "ratio": 0.5, "name": "wide"},
        {"action": "slow_down", "radius": 1.0, "ratio": 0.2, "name": "near"},
    ])  # fmt: skip
    twist, reason = said(*ZoneMonitor(zones, ROUND).limited(Twist(1.0), SOMETHING))
    assert twist.linear == pytest.approx(0.2) and "'near'" in reason


def test_a_zone_without_outline_is_the_footprint():
    touching = np.array([[0.24, 0.0]] * 4)
    zones = read_safety_zones([{"action": "stop"}])
    assert ZoneMonitor(zones, ROUND).limited(Twist(0.3), touching)[0] == STANDSTILL
    assert ZoneMonitor(zones, ROUND).limited(Twist(0.3), SOMETHING)[0] == Twist(0.3)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"action": "halt"}, "'halt' is not one of stop"),
        ({"corners": [[0, 0], [1, 0]]}, "expected at least three corners"),
        ({"corners": FRONT, "radius": 1.0}, "or a radius"),
        ({"corners": [1, 2, 3]}, "a corner is"),
        ({"ratio": 2.0}, "at most 1"),
        ({"speed_from": 1.0, "speed_to": 0.0}, "is above"),
        ("stop", "expected a mapping"),
    ],
)
def test_a_zone_that_will_not_do_is_named(entry, words):
    with pytest.raises(ParameterError, match="zone 2: ") as raised:
        read_safety_zones([{}, entry])
    assert words in str(raised.value)


def test_a_stop_zone_stops_the_robot_at_its_edge_and_lets_it_back_off():
    world = ToyWorld(room(8, 8), robot(ROUND), Pose2D(4.0, 4.0), beams=720)
    zones = [SafetyZone(corners=tuple(FRONT))]
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD, zones)
    for _ in range(200):
        world.drive(safety.limit(Twist(0.6), world.odometry, world.obstacles))
    # the zone reaches 1.2 m; from 0.6 m/s at 1.5 m/s² it needs 0.12 m more, and the scan's age
    assert 8.0 - 1.2 - 0.01 < world.pose.x < 8.0 - 1.2 + 0.2
    assert safety.reason == "stopped: obstacle in the zone 'stop'"
    for _ in range(40):
        world.drive(safety.limit(Twist(-0.2), world.odometry, world.obstacles))
    assert world.pose.x < 6.7


@given(
    st.floats(1.5, 6.5), st.floats(1.5, 6.5), st.floats(-pi, pi), st.floats(-0.3, 0.8),
    st.floats(-1.8, 1.8), st.sampled_from(["stop", "slow_down", "limit", "approach"]),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_a_zone_never_makes_the_robot_faster(x, y, heading, linear, angular, action):
    world = ToyWorld(room(8, 8), robot(ROUND), Pose2D(x, y, heading))
    points = world.scan.points()
    zones = ZoneMonitor([SafetyZone(action=action, radius=1.0)], ROUND)
    wanted = Twist(linear, angular)
    twist, reason = said(*zones.limited(wanted, points))
    assert abs(twist.linear) <= abs(linear) and abs(twist.angular) <= abs(angular)
    assert twist.linear * angular == pytest.approx(twist.angular * linear, abs=1e-9)  # same arc
    assert bool(reason) == (twist != wanted)


def driven(safety, wanted, steps, **more):
    world = ToyWorld(room(60, 60), robot(), Pose2D(30.0, 30.0))
    twists = []
    for _ in range(steps):
        twist = safety.limit(wanted, world.odometry, world.obstacles, **more)
        world.drive(twist)
        twists.append(twist)
    return twists


def test_the_speed_limit_of_a_place_holds_and_says_so():
    safety = SafetyStage(robot(), SafetyParameters(), PERIOD)
    last = driven(safety, Twist(0.8, 0.6), 40, speed_limit=0.2)[-1]
    assert (last.linear, last.angular) == (pytest.approx(0.2), pytest.approx(0.15))
    assert safety.reason == "slower: the speed limit here is 0.20 m/s"
    driven(safety, Twist(0.1), 40, speed_limit=0.2)
    assert safety.reason == ""
    driven(safety, Twist(0.8), 2, speed_limit=inf)
    assert safety.reason == ""


def test_a_closed_loop_counts_from_what_is_measured():
    safety = SafetyStage(robot(), replace(SafetyParameters(), closed_loop=True), PERIOD)
    world = ToyWorld(room(60, 60), robot(), Pose2D(30.0, 30.0))
    for _ in range(5):  # the wheels do not turn
        twist = safety.limit(Twist(0.8), standing(), world.obstacles)
        assert twist.linear == pytest.approx(0.05)  # 1.0 m/s² · 0.05 s from zero, again
    fast = safety.limit(Twist(0.8), replace(standing(), twist=Twist(0.6)), world.obstacles)
    assert fast.linear == pytest.approx(0.65)


def test_a_drive_with_a_dead_band_gets_going_and_stops_clean():
    parameters = replace(SafetyParameters(), dead_band=0.12, turning_dead_band=0.3)
    safety = SafetyStage(robot(), parameters, PERIOD)
    up = [twist.linear for twist in driven(safety, Twist(0.5), 12)]
    assert up[:4] == pytest.approx([0.12, 0.12, 0.15, 0.2])
    assert driven(safety, Twist(0.1, 0.2), 12)[-1] == STANDSTILL


@pytest.mark.parametrize(
    ("smooth", "wanted", "expected"),
    [(0.05, 0.5, 0.1), (-0.05, -0.5, -0.1), (0.05, 0.0, 0.0), (0.05, -0.5, 0.0),
     (0.05, 0.08, 0.0), (0.1, 0.5, 0.1), (0.3, 0.0, 0.3), (0.0, 0.5, 0.0)],
)  # fmt: skip
def test_the_edge_of_the_dead_band(smooth, wanted, expected):
    twist = beyond_dead_band(Twist(smooth), Twist(wanted), 0.1, 0.0)
    assert twist == Twist(expected)


def test_an_outline_may_end_with_the_corner_that_it_began_with():
    closed = ZoneMonitor(read_safety_zones([{"corners": [*FRONT, FRONT[0]], "ratio": 0.3}]), ROUND)
    open_ = monitor(ratio=0.3)
    assert closed.limited(Twist(0.8), SOMETHING) == open_.limited(Twist(0.8), SOMETHING)
