"""Timed motions: limits, rest, the path, and the stop on it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.arm_description import JointLimits
from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.blending import blended
from stack.manipulation.braking import braking, is_within, peaks
from stack.manipulation.collisions import Collisions
from stack.manipulation.hermite import sample
from stack.manipulation.scene import Box, Scene, SceneObject
from stack.manipulation.timing import PERIOD, first_contact, time_path, timed
from stack.types import FailureCode
from tests.benchmarks.arm_planning import ruckig_duration
from tests.stack.manipulation.panda import HOME, LIMITS, panda, posed

SEEDS = st.integers(0, 10_000)
TOLERANCES = st.sampled_from((0.1, 0.03, 0.0))


def one_joint(velocity, acceleration, jerk):
    ones = np.ones(1)
    return JointLimits(
        -10 * ones, 10 * ones, velocity * ones, acceleration * ones, jerk * ones, ones
    )


def waypoints_of(seed, count=0):
    generator = np.random.default_rng(seed)
    count = count or int(generator.integers(2, 7)) + (seed % 3 == 0)
    points = generator.uniform(LIMITS.lower, LIMITS.upper, (count, 7))
    if seed % 3 == 0:  # a path that turns back, and waypoints close together
        points[-1] = points[0]
        points[1] = points[0] + 1e-3 * (points[1] - points[0])
    return points


def distance_to(path, positions):
    """Largest distance of positions (m, n) to the lines between waypoints, radians."""
    best = np.full(len(positions), np.inf)
    for first, second in pairwise(path):
        way = second - first
        share = np.clip((positions - first) @ way / max(way @ way, 1e-30), 0.0, 1.0)
        offset = positions - first - share[:, None] * way
        best = np.minimum(best, np.linalg.norm(offset, axis=1))
    return best.max()


@settings(deadline=None, max_examples=40)
@given(SEEDS, TOLERANCES)
def test_limits_hold_between_samples_and_the_ends_are_at_rest(seed, tolerance):
    points = waypoints_of(seed)
    motion = time_path(points, LIMITS, tolerance)
    assert is_within(motion, LIMITS, 1.0 + 1e-6)
    assert motion.positions[[0, -1]] == pytest.approx(points[[0, -1]])
    assert not motion.velocities[[0, -1]].any()
    step = np.diff(motion.times)[[0, -1], None]
    change = np.abs(np.diff(motion.velocities, axis=0)[[0, -1]]) / step
    assert np.all(change <= LIMITS.jerk * step)  # the acceleration begins and ends at zero, too


def test_limits_hold_by_differences_of_a_fine_sampling():
    """Independent of `peaks`: differences over 0.1 ms."""
    motion = time_path(waypoints_of(1, 5), LIMITS)
    period = 1e-4
    times = np.arange(0.0, motion.duration, period)
    positions, velocities = sample(motion, times)
    assert np.all(np.abs(np.diff(positions, axis=0)) / period <= LIMITS.velocity * (1 + 1e-6))
    acceleration = np.diff(velocities, axis=0) / period
    assert np.all(np.abs(acceleration) <= LIMITS.acceleration * (1 + 1e-6))
    jerk = np.diff(acceleration[::100], axis=0) / (100 * period)
    assert np.all(np.abs(jerk) <= LIMITS.jerk * (1 + 1e-6))


@settings(deadline=None, max_examples=40)
@given(SEEDS, TOLERANCES)
def test_the_motion_stays_near_the_path(seed, tolerance):
    """Corners leave it by the tolerance and by the average: a (m Δt)² / 24 with m Δt < 2 a / j."""
    points = waypoints_of(seed)
    motion = time_path(points, LIMITS, tolerance)
    positions, _ = sample(motion, np.linspace(0.0, motion.duration, 500))
    window = 2.0 * np.max(LIMITS.acceleration / LIMITS.jerk) + 3.0 * PERIOD
    average = np.linalg.norm(LIMITS.acceleration) * window**2 / 24.0
    assert distance_to(points, positions) <= (tolerance + average if tolerance else 1e-9)


def test_the_time_of_one_line_in_closed_form():
    """Distance 2, v 1, a 2, j 20: d/v + v/a + a/j = 2.6 s, and a few samples."""
    motion = time_path(np.array([[0.0], [2.0]]), one_joint(1.0, 2.0, 20.0))
    assert 2.6 <= motion.duration <= 2.6 + 5 * PERIOD


def test_a_line_takes_hardly_longer_than_by_ruckig():
    for seed in range(10):
        points = waypoints_of(3 * seed + 1, 2)
        own, best = time_path(points, LIMITS).duration, ruckig_duration(*points)
        assert best <= own + 1e-6 <= best + 0.15


def test_rounded_corners_save_time():
    points = waypoints_of(1, 4)
    assert time_path(points, LIMITS, 0.1).duration < time_path(points, LIMITS, 0.0).duration


@settings(deadline=None, max_examples=30)
@given(SEEDS)
def test_rounded_paths_have_tangents_of_length_one_and_no_jumps(seed):
    for section in blended(waypoints_of(seed), 0.05):
        assert np.linalg.norm(section.tangents, axis=1) == pytest.approx(1.0)
        way = np.linalg.norm(np.diff(section.positions, axis=0), axis=1)
        assert np.all(way <= np.diff(section.lengths) * (1 + 1e-9))
        assert way.sum() == pytest.approx(section.lengths[-1], rel=2e-3)
        turn = np.diff(section.tangents, axis=0) / np.diff(section.lengths)[:, None]
        assert turn == pytest.approx(section.curvatures, abs=0.02 * np.abs(turn).max() + 1e-9)


def test_no_motion():
    motion = time_path(np.array([HOME, HOME]), LIMITS)
    assert motion.duration == 0.0 and motion.positions[-1] == pytest.approx(HOME)
    assert braking(motion, 0.0, LIMITS).duration == 0.0
    assert not np.any(peaks(motion))


@settings(deadline=None, max_examples=20)
@given(SEEDS, st.floats(0.0, 1.0))
def test_braking_stays_on_the_trajectory_and_within_the_limits(seed, share):
    motion = time_path(waypoints_of(seed), LIMITS)
    time = share * motion.duration
    stop = braking(motion, time, LIMITS)
    assert is_within(stop, LIMITS, 1.02)
    begin = [row[0] for row in sample(motion, np.array([time]))]
    assert stop.positions[0] == pytest.approx(begin[0])
    if share < 1.0:
        assert stop.velocities[0] == pytest.approx(begin[1], abs=1e-9)
    assert not stop.velocities[-1].any()
    assert stop.duration <= motion.duration - time + 0.15
    fine, _ = sample(motion, np.linspace(time, motion.duration + 1e-6, 2000))
    assert distance_to(fine, stop.positions) < 1e-4


def test_the_stop_of_one_joint_in_closed_form():
    """At v 1 with a 2, j 20: v/a + a/j = 0.6 s, found within steps of 15 %."""
    limits = one_joint(1.0, 2.0, 20.0)
    motion = time_path(np.array([[0.0], [4.0]]), limits)
    stop = braking(motion, 2.0, limits)
    assert 0.6 / 1.02 <= stop.duration <= 0.5 * 1.15 + 0.1 + 2 * PERIOD
    assert is_within(stop, limits, 1.02)


def test_a_corner_beside_an_object_is_rounded_less():
    path = np.array([posed(-0.5, 0, 0, 0, 0, 0, 0), HOME, posed(0, 0.5, 0, 0, 0, 0, 0)])
    wide = time_path(path, LIMITS, 0.1)
    middle = sample(wide, np.array([wide.duration / 2.0]))[0][0]
    assert np.linalg.norm(middle - HOME) > 0.02
    tip = Collisions(panda(), Scene())
    assert not first_contact(wide, tip)
    free, tolerance = timed(path, LIMITS, Collisions(panda(), Scene(), 0.01))
    assert tolerance == 0.1 and free.duration == pytest.approx(wide.duration)


def test_an_object_that_moves_into_the_way():
    path = np.array([posed(-1, 0, 0, 0, 0, 0, 0), posed(1, 0, 0, 0, 0, 0, 0)])
    pose = from_angles((1.3, 0.0, 0.5), (0, 0, 0))
    cart = SceneObject("cart", Box((0.1, 0.1, 0.3)), pose, np.array([-1.5, 0.0, 0.0]))
    standing = replace(cart, velocity=np.zeros(3))
    assert timed(path, LIMITS, Collisions(panda(), Scene((standing,)), 0.01))
    with pytest.raises(NavigationError, match=r"after \d\.\d s panda_\w+ .* cart") as caught:
        timed(path, LIMITS, Collisions(panda(), Scene((cart,)), 0.01))
    assert caught.value.failure.code == FailureCode.COLLISION_AHEAD
