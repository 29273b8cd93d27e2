"""The tree of frames against random trees, and against the planar poses that it lifts."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stack.errors import FrameError
from stack.frames.tree import FrameTree, inverse, lifted
from stack.geometry.rotations import from_quaternion
from stack.types import Pose2D, on_floor
from tests.stack.frames.test_buffer import driven, estimate

COORDINATES = st.floats(-5.0, 5.0)
TRANSFORMS = st.builds(
    lambda position, quaternion: from_quaternion(np.array(position), np.array(quaternion)),
    st.tuples(*3 * [COORDINATES]), st.tuples(*4 * [st.floats(-1.0, 1.0)]),
)  # fmt: skip


def turned(transform: np.ndarray, stamp: float) -> np.ndarray:
    """A joint that turns by 1 rad/s about its z axis."""
    return transform @ lifted(Pose2D(0.0, 0.0, stamp))


@st.composite
def trees(draw: st.DrawFn) -> FrameTree:
    """Frames "0" to "n", each below an earlier one; those with odd numbers turn."""
    tree = FrameTree()
    for child in range(1, draw(st.integers(2, 8))):
        parent, transform = str(draw(st.integers(0, child - 1))), draw(TRANSFORMS)
        if child % 2:
            tree.follow(parent, str(child), lambda stamp, t=transform: turned(t, stamp))
        else:
            tree.fix(parent, str(child), transform)
    return tree


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(trees(), st.data(), st.floats(0.0, 10.0))
def test_transforms_compose_along_any_way_and_invert(tree, data, stamp):
    """T(a, c) = T(a, b) T(b, c), T(a, b) T(b, a) = 1, and rotations stay rotations."""
    a, b, c = (data.draw(st.sampled_from(sorted(tree.names))) for _ in range(3))
    direct = tree.lookup(a, c, stamp)
    assert direct == pytest.approx(tree.lookup(a, b, stamp) @ tree.lookup(b, c, stamp), abs=1e-9)
    assert tree.lookup(a, b, stamp) @ tree.lookup(b, a, stamp) == pytest.approx(np.eye(4), abs=1e-9)
    assert direct[:3, :3] @ direct[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
    assert inverse(direct) == pytest.approx(np.linalg.inv(direct), abs=1e-9)


def test_a_point_on_a_turned_sensor():
    """A camera 1 m above the base looks left: what is 2 m ahead of it is 2 m left of the base."""
    tree = FrameTree()
    tree.fix("base", "mast", from_quaternion(np.array([0.0, 0.0, 1.0]), np.array([0, 0, 0, 1.0])))
    tree.follow("mast", "camera", lambda stamp: lifted(Pose2D(0.0, 0.0, stamp)))
    seen = tree.lookup("base", "camera", pi / 2) @ [2.0, 0.0, 0.0, 1.0]
    assert seen == pytest.approx([0.0, 2.0, 1.0, 1.0])


@settings(deadline=None)
@given(st.floats(0.0, 3.9))
def test_the_buffer_lifts_its_poses_at_and_between_its_stamps(stamp):
    frames = driven(4.0)
    frames.correct(estimate(Pose2D(1.0, 2.0, 0.5), 0.0))
    frames.correct(estimate(Pose2D(2.0, 2.0, 0.7), 3.0))
    mount = Pose2D(0.2, -0.1, 0.3)
    frames.fix("base", "lidar", lifted(mount))
    pose = on_floor(frames.lookup("map", "lidar", stamp))
    expected = frames.pose_at("map", stamp).compose(mount)
    assert (pose.x, pose.y) == pytest.approx((expected.x, expected.y))
    assert pose.heading == pytest.approx(expected.heading)


def test_frames_below_one_need_no_pose_of_it():
    frames = driven(1.0)
    frames.fix("base", "lidar", lifted(Pose2D(0.2, 0.0)))
    frames.fix("base", "camera", lifted(Pose2D(0.0, 0.1)))
    assert frames.lookup("lidar", "camera", 99.0)[:2, 3] == pytest.approx([-0.2, 0.1])


@pytest.mark.parametrize(
    ("target", "source", "stamp", "words"),
    [
        ("odom", "lidra", 0.5, "no frame 'lidra'; known: base, island, map, odom, sea"),
        ("base", "island", 0.5, "'island' with 'base'.*below 'sea'.*below 'map'"),
        ("odom", "base", 1.5, r"no pose at 1.500 s: .* covers 0.000 s to 1.000 s"),
        ("map", "base", 0.5, "no map -> odom yet"),
    ],
)
def test_an_error_names_what_is_missing(target, source, stamp, words):
    frames = driven(1.0)
    frames.fix("sea", "island", np.eye(4))
    with pytest.raises(FrameError, match=words):
        frames.lookup(target, source, stamp)


def test_a_frame_has_one_parent_and_is_not_above_itself():
    tree = FrameTree()
    tree.fix("a", "b", np.eye(4))
    with pytest.raises(FrameError, match="'b' has two parents, 'a' and 'c'"):
        tree.fix("c", "b", np.eye(4))
    with pytest.raises(FrameError, match="'b' and 'a' are above each other"):
        tree.fix("b", "a", np.eye(4))
