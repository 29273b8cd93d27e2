"""A depth camera that grows old: first slower, then standstill; a lidar stops at once."""

from math import hypot, inf
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.safety.parameters import SafetyParameters
from stack.types import STANDSTILL, ObstaclePoints, Odometry, Pose2D, Twist
from tests.stack.safety.obstacles import SafetyStage

SCOUT = read_robot(find_robot("scout", Path()))
RIM = SCOUT.footprint.circumscribed_radius


def limited(wanted, steps=60, **ages):
    """The twist after some steps with these ages, and why it is limited."""
    safety, twist = SafetyStage(SCOUT, SafetyParameters(), 0.05), STANDSTILL
    for _ in range(steps):
        motion = Odometry(0.0, Pose2D(0.0, 0.0), twist)
        twist = safety.limit(wanted, motion, ObstaclePoints(ages={"lidar": 0.05, **ages}))
    return twist, safety.reason


@pytest.mark.parametrize(
    ("age", "speed", "reason"),
    [
        (0.3, 0.6, ""),
        (0.31, 0.15, "slower: the newest depth picture is 0.31 s old"),
        (1.0, 0.15, "slower: the newest depth picture is 1.00 s old"),
        (1.01, 0.0, "stopped: the newest depth picture is 1.01 s old"),
        (inf, 0.0, "stopped: no depth picture yet"),
    ],
)
def test_the_age_of_the_picture_decides(age, speed, reason):
    twist, found = limited(Twist(0.6), depth=age)
    assert twist.linear == pytest.approx(speed) and found == reason


def test_a_turn_is_limited_at_the_outline():
    twist, _ = limited(Twist(angular=1.5), depth=0.5)
    assert twist.angular * RIM == pytest.approx(0.15, rel=1e-6)


def test_a_lidar_stops_the_robot_without_a_warning_speed():
    assert limited(Twist(0.6), lidar=0.31)[0] == STANDSTILL


@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(-0.3, 0.8), st.floats(-1.8, 1.8))
def test_an_older_picture_never_allows_more_speed(one, other, linear, angular):
    young, old = sorted((one, other))
    speeds = []
    for age in (young, old):
        twist, _ = limited(Twist(linear, angular), steps=1, depth=age)
        speeds.append(hypot(twist.linear, RIM * twist.angular))
    assert speeds[1] <= speeds[0] + 1e-9
