"""Contacts with objects that move: times in closed form, and against small steps."""

from __future__ import annotations

from math import cos, inf, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.safety.kernels import signed_distance
from stack.safety.monitor import NOTHING_MOVES, CollisionMonitor, moving_discs
from stack.types import Pose2D, TrackedObject, Twist
from tests.stack.navigation.toy_world import RECTANGLE, robot

NO_POINTS = np.empty((0, 2))


def time_of(twist, disc, horizon=5.0, padding=0.0):
    monitor = CollisionMonitor(robot())
    return monitor.contact(twist, NO_POINTS, horizon, padding, np.array([disc])).time


def test_a_disc_comes_to_a_robot_that_stands():
    """The nose is 0.25 m ahead: 2 - 0.25 - 0.3 m at 1 m/s, with 5 cm of padding 50 ms sooner."""
    walker = (2.0, 0.0, -1.0, 0.0, 0.3)
    assert time_of(Twist(), walker) == pytest.approx(1.45, abs=0.005)
    assert time_of(Twist(), walker, padding=0.05) == pytest.approx(1.40, abs=0.005)
    assert time_of(Twist(), walker, horizon=1.3) == inf


def test_what_counts_is_the_velocity_relative_to_the_robot():
    assert time_of(Twist(0.5), (2.0, 0.0, 0.5, 0.0, 0.3)) == inf
    assert time_of(Twist(0.5), (2.0, 0.0, -0.5, 0.0, 0.3)) == pytest.approx(1.45, abs=0.005)
    assert time_of(Twist(0.5), (2.0, 0.0, 0.0, 0.0, 0.3)) == pytest.approx(2.9, abs=0.01)


def test_a_disc_that_touches_may_move_away():
    assert time_of(Twist(-0.2), (0.5, 0.0, 0.0, 0.0, 0.3)) == inf
    assert time_of(Twist(0.2), (0.5, 0.0, 0.0, 0.0, 0.3)) < 0.1


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-0.5, 0.5), st.floats(-1.5, 1.5),
    st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5),
)  # fmt: skip
def test_the_time_is_that_of_small_steps(linear, angular, x, y, across, along):
    radius, padding = 0.25, 0.03
    corners = np.ascontiguousarray(RECTANGLE.points)
    if signed_distance(corners, x, y) < radius + padding + 0.02:
        return
    found = time_of(Twist(linear, angular), (x, y, across, along, radius), 2.0, padding)
    pose, step, time = Pose2D(0.0, 0.0), 0.002, 0.0
    while time < 2.0:
        there = Pose2D(x + across * time, y + along * time).relative_to(pose)
        if signed_distance(corners, there.x, there.y) <= radius + padding:
            break
        turn = 0.5 * angular * step
        pose = pose.compose(Pose2D(linear * step * cos(turn), linear * step * sin(turn), 2 * turn))
        time += step
    touches = time < 2.0
    if touches and found == inf:  # they graze each other within the tolerances
        late = Pose2D(x + across * time, y + along * time).relative_to(pose)
        assert signed_distance(corners, late.x, late.y) > radius + padding - 0.01
    elif touches:
        assert found == pytest.approx(time, abs=0.05)
    else:
        assert found == inf or found > 1.9


def test_tracks_are_seen_from_the_base():
    track = TrackedObject(1, 0.0, (1.0, 2.0), (0.5, 0.0), 0.3, np.eye(4))
    disc = moving_discs([track], Pose2D(1.0, 0.0, pi / 2))
    assert disc == pytest.approx(np.array([[2.0, 0.0, 0.0, -0.5, 0.3]]), abs=1e-12)
    assert moving_discs([], Pose2D(0.0, 0.0)) is NOTHING_MOVES


def test_a_robot_may_leave_the_way_of_somebody_also_slowly():
    """Somebody comes from ahead at 1 m/s: backing up at 0.3 m/s, they meet later than standing."""
    walker = (1.5, 0.0, -1.0, 0.0, 0.3)
    assert time_of(Twist(), walker) == pytest.approx(0.95, abs=0.005)
    assert time_of(Twist(-0.3), walker) == inf
    assert time_of(Twist(0.3), walker) < 0.95
    # somebody who stands is an obstacle as before
    assert time_of(Twist(-0.3), (-1.0, 0.0, 0.0, 0.0, 0.3)) == pytest.approx(1.5, abs=0.02)


def test_more_distance_is_kept_to_who_walks():
    """Sideways 0.2 m from the robot's side: clear of a padding of 3 cm, not of one of 25 cm."""
    monitor, beside = CollisionMonitor(robot()), [1.0, 0.7, -0.5, 0.0, 0.3]
    passing = np.array([beside])
    standing = np.array([[*beside[:2], 0.0, 0.0, 0.3]])

    def time(discs, wide):
        return monitor.contact(Twist(0.5), NO_POINTS, 3.0, 0.03, discs, wide).time

    assert time(passing, 0.0) == time(standing, 0.0) == time(standing, 0.25) == inf
    # standing, the robot would be passed at that distance too, so the walker comes no nearer by it
    assert time(passing, 0.25) in (inf, pytest.approx(1.0, abs=0.7))


def test_who_walks_away_is_followed_no_closer_than_the_wide_padding():
    """Somebody crosses ahead: standing, the robot meets nobody; driving on, it comes within 1 m."""
    monitor, crossing = CollisionMonitor(robot()), np.array([[1.2, -0.6, 0.0, 0.8, 0.3]])
    close = monitor.contact(Twist(0.6), NO_POINTS, 3.0, 0.03, crossing, 0.0).time
    wide = monitor.contact(Twist(0.6), NO_POINTS, 3.0, 0.03, crossing, 0.3).time
    assert wide < close
    assert monitor.contact(Twist(), NO_POINTS, 3.0, 0.03, crossing, 0.3).time == inf
