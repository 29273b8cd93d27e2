"""Targets of a trajectory and the watch."""

import numpy as np
import pytest

from stack.manipulation.hermite import hermite, sample
from stack.manipulation.timing import time_path
from stack.manipulation.trajectory_loop import TrajectoryFollower
from stack.types.arms import JointState, JointTrajectory
from tests.stack.manipulation.panda import HOME, LIMITS, PANDA, posed

TIMES = np.array([0.0, 0.5, 2.0])


def cubic(times):
    """Positions and velocities (k, 7) of joint j: (j + 1) (t³ - 3 t² + t)."""
    factor = np.arange(1, 8)
    t = np.asarray(times)[:, None]
    return factor * (t**3 - 3 * t**2 + t), factor * (3 * t**2 - 6 * t + 1)


TRAJECTORY = JointTrajectory(TIMES, *cubic(TIMES))


def state(stamp, positions, efforts=None):
    return JointState(
        stamp, positions, np.zeros(7), np.zeros(7) if efforts is None else np.array(efforts)
    )


def test_pieces_are_exact_for_cubic_polynomials():
    at = np.linspace(0.0, 2.0, 41)
    positions, velocities = sample(TRAJECTORY, at)
    assert positions == pytest.approx(cubic(at)[0])
    assert velocities[:-1] == pytest.approx(cubic(at)[1][:-1])
    values, _ = hermite(TIMES, TRAJECTORY.positions, TRAJECTORY.velocities, at)
    assert values == pytest.approx(positions)


def test_targets_count_from_the_start_and_hold_the_end():
    follower = TrajectoryFollower(PANDA, HOME)
    assert follower.targets(3.0)[0] == pytest.approx(HOME)
    follower.start(TRAJECTORY, 10.0)
    for time in (10.0, 10.3, 10.5, 11.9):
        positions, velocities = follower.targets(time)
        assert positions == pytest.approx(cubic([time - 10.0])[0][0])
        assert velocities == pytest.approx(cubic([time - 10.0])[1][0])
    assert not follower.is_over(11.9) and follower.is_over(12.0)
    positions, velocities = follower.targets(15.0)
    assert positions == pytest.approx(TRAJECTORY.positions[-1]) and not velocities.any()
    assert follower.targets(9.0)[0] == pytest.approx(TRAJECTORY.positions[0])


def test_a_stop_goes_on_from_where_the_arm_is():
    """Joint 1 at 2.175 rad/s, 7.5 rad/s², 150 rad/s³: 0.29 + 0.05 s, found in steps of 15 %."""
    motion = time_path(np.array([posed(-2, 0, 0, 0, 0, 0, 0), posed(2, 0, 0, 0, 0, 0, 0)]), LIMITS)
    follower = TrajectoryFollower(PANDA, HOME)
    follower.start(motion, 10.0)
    positions, velocities = follower.targets(11.0)
    follower.stop(11.0)
    assert follower.targets(11.0)[0] == pytest.approx(positions)
    assert follower.targets(11.0)[1] == pytest.approx(velocities)
    assert follower.is_over(11.42) and not follower.is_over(11.32)
    stopped = follower.targets(20.0)[0]
    assert positions[0] < stopped[0] < motion.positions[-1, 0]
    follower.stop(21.0)
    assert follower.targets(21.0)[0] == pytest.approx(stopped)


def test_the_tracking_error_names_the_joint():
    follower = TrajectoryFollower(PANDA, HOME, tracking_error=0.1)
    late = HOME.copy()
    late[3] += 0.2
    assert follower.watch(state(0.0, HOME)) == ""
    assert follower.watch(state(0.0, late)) == "panda_joint4: tracking error 0.200 above 0.100"


def test_full_effort_is_a_problem_when_it_lasts():
    follower = TrajectoryFollower(PANDA, HOME)
    full = LIMITS.effort * [0, -1, 0, 0, 0, 0, 0]
    assert follower.watch(state(0.0, HOME, full)) == ""
    assert follower.watch(state(0.2, HOME, full)) == ""
    assert follower.watch(state(0.25, HOME)) == ""  # begins anew
    assert follower.watch(state(0.3, HOME, full)) == ""
    assert follower.watch(state(0.59, HOME, full)) == ""
    expected = "panda_joint2: effort at its limit of 87 for 0.4 s"
    assert follower.watch(state(0.7, HOME, full)) == expected
