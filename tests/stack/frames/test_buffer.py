"""The transform buffer against motions with known poses."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.errors import FrameError
from stack.frames.buffer import TransformBuffer
from stack.types import STANDSTILL, Odometry, Pose2D, PoseEstimate, wrap_angle

PERIOD = 0.05


def circle(stamp: float, rate: float = 1.0, radius: float = 0.5) -> Pose2D:
    """Pose on a circle that is driven at a constant turn rate."""
    angle = rate * stamp
    return Pose2D(radius * sin(angle), radius * (1.0 - cos(angle)), wrap_angle(angle))


def driven(seconds: float, rate: float = 1.0, span: float = 10.0) -> TransformBuffer:
    frames = TransformBuffer(span)
    for step in range(round(seconds / PERIOD) + 1):
        frames.add(Odometry(step * PERIOD, circle(step * PERIOD, rate), STANDSTILL))
    return frames


def estimate(map_from_odom: Pose2D, corrected_at: float) -> PoseEstimate:
    """At the origin of odometry."""
    return PoseEstimate(map_from_odom, np.eye(3), 1.0, map_from_odom, corrected_at)


@given(st.floats(0.0, 9.0), st.floats(-3.0, 3.0))
def test_a_pose_between_two_steps_is_that_of_the_motion(stamp, rate):
    """The sagitta of an arc of 0.15 rad with radius 0.5 m is 1.4 mm; the heading is exact."""
    pose = driven(9.0, rate).pose_at("odom", stamp)
    expected = circle(stamp, rate)
    assert pose.distance_to(expected) < 0.0015
    assert wrap_angle(pose.heading - expected.heading) == pytest.approx(0.0, abs=1e-9)


def test_the_pose_at_a_step_is_exactly_the_one_added():
    frames = driven(2.0)
    assert frames.pose_at("odom", 20 * PERIOD) == circle(20 * PERIOD)
    assert frames.newest == 40 * PERIOD


def test_headings_are_interpolated_across_half_a_turn():
    frames = TransformBuffer()
    frames.add(Odometry(0.0, Pose2D(0.0, 0.0, pi - 0.1), STANDSTILL))
    frames.add(Odometry(1.0, Pose2D(0.0, 0.0, -pi + 0.1), STANDSTILL))
    assert abs(frames.pose_at("odom", 0.5).heading) == pytest.approx(pi)


def test_a_correction_is_interpolated_and_a_jump_is_not():
    frames = driven(4.0, rate=0.0)
    frames.correct(estimate(Pose2D(1.0, 0.0), 1.0))
    frames.correct(estimate(Pose2D(1.2, 0.0), 2.0))
    frames.correct(estimate(Pose2D(9.0, 0.0), 3.0))
    at = {stamp: frames.map_from_odom(stamp).x for stamp in (0.5, 1.0, 1.5, 2.0, 2.9, 3.0, 4.0)}
    assert at == {0.5: 1.0, 1.0: 1.0, 1.5: 1.1, 2.0: 1.2, 2.9: 1.2, 3.0: 9.0, 4.0: 9.0}
    assert frames.pose_at("map", 3.5).x == 9.0


def test_a_correction_by_an_older_measurement_counts_from_the_last_one():
    frames = driven(4.0, rate=0.0)
    frames.correct(estimate(Pose2D(1.0, 0.0), 2.0))
    frames.correct(estimate(Pose2D(1.1, 0.0), 1.9))
    assert frames.map_from_odom(2.0).x == 1.1


def test_a_jump_that_is_corrected_at_its_own_stamp_stays_one():
    frames = driven(4.0)
    for x, stamp in ((1.0, 1.0), (5.0, 2.0), (5.1, 2.0)):
        frames.correct(estimate(Pose2D(x, 0.0), stamp))
    assert frames.map_from_odom(1.9).x == 1.0 and frames.map_from_odom(2.0).x == 5.1


def test_motion_is_expressed_in_the_base_frame_of_the_first_stamp():
    quarter = 0.5 * pi
    frames = driven(4.0)
    moved = frames.motion(0.0, quarter)
    assert (moved.x, moved.y, moved.heading) == pytest.approx((0.5, 0.5, quarter), abs=2e-3)
    assert frames.motion(1.0, 1.0).distance_to(Pose2D(0.0, 0.0)) < 1e-12


def test_a_stamp_outside_the_buffer_is_an_error_with_both_numbers():
    frames = driven(4.0, span=1.0)
    for stamp in (1.5, 4.01):
        with pytest.raises(FrameError, match=rf"{stamp:.3f} s.*covers 2\.9[50]0 s to 4\.000 s"):
            frames.pose_at("odom", stamp)


def test_an_empty_buffer_and_steps_back_in_time_are_errors():
    frames = TransformBuffer()
    with pytest.raises(FrameError, match="no odometry yet"):
        frames.pose_at("odom", 0.0)
    frames.add(Odometry(1.0, Pose2D(0.0, 0.0), STANDSTILL))
    with pytest.raises(FrameError, match="no map -> odom yet"):
        frames.pose_at("map", 1.0)
    with pytest.raises(FrameError, match=r"0\.900 s came after the one at 1\.000 s"):
        frames.add(Odometry(0.9, Pose2D(0.0, 0.0), STANDSTILL))


def test_the_buffer_stays_bounded():
    frames = driven(60.0, span=2.0)
    assert len(frames._odom_from_base.stamps) <= 2.0 / PERIOD + 2


def stated(
    seconds: float, variances: tuple[float, float, float], disturbed: tuple[float, float] = (9, 9)
) -> TransformBuffer:
    """1 m/s straight ahead, with the same covariance of each step of 50 ms."""
    frames = TransformBuffer()
    for step in range(round(seconds / PERIOD) + 1):
        now = step * PERIOD
        hit = disturbed[0] < now <= disturbed[1]
        frames.add(Odometry(now, Pose2D(now, 0.0), STANDSTILL, np.diag(variances), hit))
    return frames


def test_errors_of_steps_add_up_and_heading_errors_move_the_end():
    """n steps of d metres; a heading error at k moves the end by (n - k) d, as a random walk."""
    variances, steps = (1e-4, 4e-4, 1e-6), 40
    covariance = stated(2.0, variances).motion_covariance(0.0, 2.0)
    arms = PERIOD * (steps - np.arange(1, steps + 1))
    assert covariance[0, 0] == pytest.approx(steps * 1e-4)
    assert covariance[1, 1] == pytest.approx(steps * 4e-4 + 1e-6 * np.sum(arms**2))
    assert covariance[2, 2] == pytest.approx(steps * 1e-6)
    assert covariance[1, 2] == covariance[2, 1] == pytest.approx(1e-6 * arms.sum())


def test_a_part_of_a_step_has_a_part_of_its_error():
    frames = stated(2.0, (1e-4, 1e-4, 0.0))
    assert frames.motion_covariance(0.51, 0.54)[0, 0] == pytest.approx(0.6e-4)
    assert frames.motion_covariance(0.49, 0.56)[0, 0] == pytest.approx(1.4e-4)
    assert not frames.motion_covariance(0.5, 0.5).any()
    assert not stated(2.0, (0.0, 0.0, 0.0)).motion_covariance(0.0, 2.0).any()


@given(st.floats(-2.0, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_the_covariance_of_a_motion_is_that_of_noisy_motions(rate, one, other):
    """Step by step on a circle: the first-order propagation of chapter 3.3 of Thrun et al."""
    since, until = sorted((round(one / PERIOD) * PERIOD, round(other / PERIOD) * PERIOD))
    step_covariance = np.array([[2e-4, 1e-5, 0.0], [1e-5, 1e-4, 2e-5], [0.0, 2e-5, 3e-4]])
    frames = TransformBuffer()
    for step in range(41):
        pose = circle(step * PERIOD, rate)
        frames.add(Odometry(step * PERIOD, pose, STANDSTILL, step_covariance))
    expected, before = np.zeros((3, 3)), Pose2D(0.0, 0.0)
    for step in range(round(since / PERIOD), round(until / PERIOD)):
        pose = frames.motion(since, (step + 1) * PERIOD)
        turn = np.eye(3)
        turn[:2, 2] = -(pose.y - before.y), pose.x - before.x
        c, s = cos(pose.heading), sin(pose.heading)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        expected = turn @ expected @ turn.T + rotation @ step_covariance @ rotation.T
        before = pose
    assert frames.motion_covariance(since, until) == pytest.approx(expected, abs=1e-12)


def test_a_disturbed_step_counts_for_every_interval_that_overlaps_it():
    frames = stated(2.0, (0.0, 0.0, 0.0), disturbed=(1.0, 1.05))
    assert [
        frames.disturbed_between(since, until)
        for since, until in [(0.0, 1.0), (0.0, 1.01), (1.02, 1.03), (1.05, 2.0), (0.0, 2.0)]
    ] == [False, True, True, False, True]
    with pytest.raises(FrameError, match="covers"):
        frames.disturbed_between(1.0, 3.0)


@given(st.floats(0.0, 8.5), st.floats(-3.0, 3.0))
def test_the_poses_at_stamps_are_those_at_each_of_them(first, rate):
    """Within 9 s at 3 rad/s the heading passes half a turn several times."""
    frames, stamps = driven(9.0, rate), first + np.linspace(0.0, 0.5, 11)
    for stamp, (x, y, heading) in zip(stamps, frames.poses_at(stamps), strict=True):
        pose = frames.pose_at("odom", stamp)
        assert (x, y) == pytest.approx((pose.x, pose.y))
        assert wrap_angle(heading - pose.heading) == pytest.approx(0.0, abs=1e-9)
