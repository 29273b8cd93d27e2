"""Frames of a robot's links: against Pinocchio, between stamps, and what they refuse."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.errors import FrameError
from stack.frames.joint_history import JointHistory
from stack.frames.links import RobotLinks
from stack.frames.tree import FrameTree, lifted
from stack.types import JointState, LinkJoint, Pose2D
from tests.benchmarks.frame_lookup import run as lookup_times

PANDA = read_robot(find_robot("panda_table", Path()))
ARM, JOINTS = PANDA.arm, PANDA.arm.all_joints
LOOKUPS = 10_000


def tree_of(positions):
    tree = FrameTree(positions)
    for joint in PANDA.links:
        tree.join(joint)
    return tree


def state(stamp, positions):
    positions = np.asarray(positions, dtype=np.float64)
    return JointState(stamp, positions, np.zeros_like(positions), np.zeros_like(positions))


def pinocchio_model():
    """The same URDF; Pinocchio ignores <mimic>, and its root frame is that of the URDF's root."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromUrdf(str(PANDA.urdf))
    return pin, model, model.createData()


def test_lookups_agree_with_pinocchio():
    pin, model, data = pinocchio_model()
    random = np.random.default_rng(7)
    now = {}
    tree = tree_of(lambda stamp: now)
    frames = [frame.name for frame in model.frames if frame.name in tree.names]
    assert set(frames) >= {*(joint.child for joint in PANDA.links)}
    numbers = {name: model.getFrameId(name, pin.FrameType.BODY) for name in frames}
    names = [str(name) for name in model.names[1:]]
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    worst = 0.0
    for number in range(LOOKUPS):
        if number % 20 == 0:
            q = random.uniform(lower, upper)
            now = dict(zip(names, q.tolist(), strict=True))
            pin.framesForwardKinematics(model, data, q)
        target, source = random.choice(frames, 2)
        wanted = data.oMf[numbers[target]].inverse() * data.oMf[numbers[source]]
        off = np.abs(tree.lookup(target, source, float(number)) - wanted.homogeneous).max()
        worst = max(worst, float(off))
    assert worst < 1e-9


def test_a_chain_of_one_turning_and_one_sliding_joint_is_that_of_a_hand_calculation():
    """Turn by 90° about z, 2 m up; then slide 0.5 m along the turned x: (0, 0.5, 2)."""
    up = np.eye(4)
    up[2, 3] = 2.0
    joints = (
        LinkJoint("turn", "revolute", "base", "a", up, np.array([0.0, 0.0, 1.0])),
        LinkJoint("slide", "prismatic", "a", "b", np.eye(4), np.array([1.0, 0.0, 0.0])),
    )
    pose = RobotLinks(joints, "base").pose("b", {"turn": np.pi / 2, "slide": 0.5})
    assert pose[:3, 3] == pytest.approx((0.0, 0.5, 2.0), abs=1e-12)
    assert pose[:3, 0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


@given(st.lists(st.floats(-3.0, 3.0), min_size=7, max_size=7))
def test_a_lookup_there_and_back_is_no_motion(q):
    tree = tree_of(lambda stamp: dict(zip(ARM.joints, q, strict=True)))
    there = tree.lookup("base", "panda_hand", 1.0)
    back = tree.lookup("panda_hand", "base", 1.0)
    assert there @ back == pytest.approx(np.eye(4), abs=1e-12)


def test_joints_are_interpolated_between_two_states():
    history = JointHistory(("a", "b"))
    history.add(state(1.0, [0.0, 1.0]))
    history.add(state(1.1, [0.2, 0.0]))
    assert history.at(1.0) == {"a": 0.0, "b": 1.0}
    assert history.at(1.1) == {"a": 0.2, "b": 0.0}
    assert history.at(1.025) == pytest.approx({"a": 0.05, "b": 0.75})
    history.add(state(1.1, [9.0, 9.0]))  # not newer
    assert history.at(1.1) == {"a": 0.2, "b": 0.0}


def test_states_are_kept_for_a_while_and_stamps_outside_are_refused_with_numbers():
    history = JointHistory(("a",), length=0.5)
    with pytest.raises(FrameError, match=r"no state of the joints is known yet; asked for 0\.100"):
        history.at(0.1)
    for number in range(11):
        history.add(state(0.1 * number, [number]))
    with pytest.raises(FrameError, match=r"0\.200 s is 0\.300 s before the oldest .* of 0\.500 s"):
        history.at(0.2)
    with pytest.raises(FrameError, match=r"1\.250 s is 0\.250 s after the newest .* of 1\.000 s"):
        history.at(1.25)


def test_a_lookup_that_fails_names_its_frames():
    history = JointHistory(ARM.joints)
    history.add(state(2.0, ARM.postures["home"]))
    tree = tree_of(history.at)
    tree.lookup("base", "panda_link0", 99.0)  # fixed: at any time
    with pytest.raises(FrameError, match=r"base <- panda_hand: 3\.000 s is 1\.000 s after"):
        tree.lookup("base", "panda_hand", 3.0)
    with pytest.raises(FrameError, match="there is no frame 'panda_hnd'; known: base, panda_"):
        tree.lookup("base", "panda_hnd", 2.0)
    tree.fix("elsewhere", "shelf", np.eye(4))
    with pytest.raises(FrameError, match="no transform connects 'shelf' with 'base': one is below"):
        tree.lookup("base", "shelf", 2.0)


def test_a_frame_that_is_added_later_is_found():
    tree = tree_of(lambda stamp: {})
    before = tree.lookup("base", "panda_hand")
    tree.follow("odom", "base", lambda stamp: lifted(Pose2D(stamp, 0.0)))
    moved = tree.lookup("odom", "panda_hand", 2.0)
    assert moved[:3, 3] == pytest.approx(before[:3, 3] + [2.0, 0.0, 0.0])


def test_an_unknown_link_is_refused_with_the_known_ones():
    with pytest.raises(FrameError, match="the robot has no link 'arm'; known: base, panda_link0"):
        RobotLinks(PANDA.links, "base").pose("arm", {})


def test_the_bench_of_lookups_measures_both_pairs():
    assert [row["lookup"] for row in lookup_times(series=1)] == ["base to hand", "link to link"]
