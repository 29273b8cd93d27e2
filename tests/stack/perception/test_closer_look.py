"""A block seen from near: computed pictures of boxes below a camera that looks down."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviours._arm.blocks import standing
from stack.perception.closer_look import look_closer
from stack.types import Block, CameraModel, DepthImage

CAMERA = CameraModel(160, 120, 114.0, position=(0.5, 0.1, 0.17), pitch=pi / 2)
"""17 cm above the bench at height 0."""

RAYS = CAMERA.rays(CAMERA.pixel_centres()).reshape(120, 160, 2)


def picture(*blocks, stamp=1.0):
    """Depths of blocks, as (x, y, yaw, size), on the bench: only their tops are drawn."""
    optical = CAMERA.base_from_optical()
    depth = np.full((120, 160), 0.17)
    for x, y, yaw, size in blocks:
        away = 0.17 - size[2]
        points = np.concatenate([RAYS * away, np.full((120, 160, 1), away)], axis=2)
        points = points @ optical[:3, :3].T + optical[:3, 3]
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        local = (points[..., :2] - (x, y)) @ turn
        depth[(np.abs(local) <= np.array(size[:2]) / 2.0).all(axis=2)] = away
    return DepthImage(stamp, depth.astype(np.float32), CAMERA, 0.05, 1.5)


def block(x, y, yaw, size, z=None):
    pose = standing(x, y, size[2] / 2.0 if z is None else z, yaw)
    return Block("red", pose, np.array(size), np.zeros((4, 4)), 0.0)


@given(
    st.floats(-0.025, 0.025), st.floats(-0.025, 0.025), st.floats(-0.015, 0.015),
    st.floats(-pi, pi), st.sampled_from([(0.05, 0.05, 0.05), (0.06, 0.03, 0.04)]),
)  # fmt: skip
def test_a_block_is_found_beside_its_place(x, y, z, yaw, size):
    """A pixel is 1 mm wide there, and each edge is known to one of them."""
    known = block(0.5 + x, 0.1 + y, yaw, size, z=size[2] / 2.0 + z)
    seen = look_closer(known, picture((0.5, 0.1, yaw, size)), np.eye(4))
    assert seen.pose[:3, 3] == pytest.approx((0.5, 0.1, size[2] / 2.0), abs=1.5e-3)
    assert seen.stamp == 1.0 and seen.colour == "red"


CUBE = (0.05, 0.05, 0.05)


@pytest.mark.parametrize(
    "there",
    [
        (),
        ((0.5, 0.1, 0.0, (0.09, 0.05, 0.05)),),
        ((0.475, 0.1, 0.0, CUBE), (0.525, 0.1, 0.0, CUBE)),
        ((0.5, 0.16, 0.0, (0.02, 0.02, 0.05)),),
    ],
    ids=["nothing", "a longer one", "two that touch", "a smaller one"],
)
def test_what_is_not_this_block_is_not_taken_for_it(there):
    assert look_closer(block(0.5, 0.1, 0.0, CUBE), picture(*there), np.eye(4)) is None
