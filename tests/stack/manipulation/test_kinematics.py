"""Forward and inverse kinematics of the Panda, against closed forms and themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.manipulation.kinematics import ArmKinematics
from tests.benchmarks.arm_kinematics import run
from tests.stack.manipulation.panda import HOME, LIMITS, panda

KINEMATICS = ArmKinematics(panda())


def positions_of(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(LIMITS.lower, LIMITS.upper)


def test_the_tool_of_the_outstretched_arm():
    """Data sheet: 0.333 + 0.316 + 0.384 m up, 0.088 m to the flange axis, 0.107 + 0.105 m down."""
    pose = KINEMATICS.forward(np.zeros(7))
    assert pose[:3, 3] == pytest.approx(
        [0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107 - 0.105], abs=1e-9
    )
    assert pose[:3, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


def test_poses_of_other_links():
    assert KINEMATICS.forward(HOME, "panda_link1")[:3, 3] == pytest.approx([0.0, 0.0, 0.333])
    with pytest.raises(ValueError, match="no link 'elbow'"):
        KINEMATICS.forward(HOME, "elbow")


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_the_jacobian_is_the_derivative(seed):
    """Central differences over 2e-6 rad."""
    positions, step = positions_of(seed), 1e-6
    jacobian = KINEMATICS.jacobian(positions)
    for joint in range(7):
        offset = step * np.eye(7)[joint]
        after, before = (KINEMATICS.forward(positions + sign * offset) for sign in (1, -1))
        rate = (after - before) / (2.0 * step)
        spin = rate[:3, :3] @ KINEMATICS.forward(positions)[:3, :3].T
        turn = [spin[2, 1], spin[0, 2], spin[1, 0]]
        assert jacobian[:, joint] == pytest.approx([*rate[:3, 3], *turn], abs=1e-6)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_solutions_reach_the_pose_within_the_limits(seed):
    generator = np.random.default_rng(seed)
    target = KINEMATICS.forward(positions_of(seed))
    found = KINEMATICS.solutions(target, HOME, generator, count=2)
    for positions in found:
        reached = KINEMATICS.forward(positions)
        assert np.linalg.norm(reached[:3, 3] - target[:3, 3]) < 1e-4
        assert np.linalg.norm(reached[:3, :3] - target[:3, :3]) < np.deg2rad(0.05)
        assert np.all(positions >= LIMITS.lower) and np.all(positions <= LIMITS.upper)
    distances = [np.abs(positions - HOME).max() for positions in found]
    assert distances == sorted(distances)


def test_a_small_motion_of_the_tool_is_a_small_motion_of_the_joints():
    target = KINEMATICS.forward(HOME)
    target[0, 3] += 0.02
    found = KINEMATICS.ik(target, HOME, np.random.default_rng(0))
    assert np.abs(found - HOME).max() < 0.1  # 2 cm at 0.5 m


def test_a_pose_beyond_the_arm_has_no_solution():
    target = np.eye(4)
    target[:3, 3] = [1.5, 0.0, 0.5]
    assert KINEMATICS.ik(target, HOME, np.random.default_rng(0), restarts=3) is None


def test_poses_between_two_turn_evenly():
    first, second = KINEMATICS.forward(HOME), KINEMATICS.forward(HOME + 0.3)
    middle = KINEMATICS.between(first, second, 0.5)
    assert middle[:3, 3] == pytest.approx((first[:3, 3] + second[:3, 3]) / 2.0)
    assert KINEMATICS.between(first, second, 1.0) == pytest.approx(second)
    halves = first[:3, :3].T @ middle[:3, :3]
    assert halves @ halves == pytest.approx(first[:3, :3].T @ second[:3, :3])


def test_more_poses_are_solved_than_by_pybullet():
    own, pybullet = run(30)
    assert own["solved_%"] == 100.0
    assert own["solved_%"] >= pybullet["solved_%"]
    assert own["worst_mm"] < 0.1 and own["worst_deg"] < 0.05
