"""Points that depth cameras measure around an arm: what is unknown, how long it stays."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest

from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions
from stack.manipulation.measured import (
    CELL,
    DEPTH,
    KEPT,
    KNOWN,
    LEAST,
    OWN,
    SAME,
    TALL,
    ArmPicture,
    MeasuredPoints,
)
from stack.manipulation.own_shape import OwnShape
from stack.manipulation.scene import Box, Scene, SceneObject
from stack.types import CameraModel, DepthImage
from tests.stack.manipulation.panda import HOME, panda

MODEL = panda()
HEIGHT = 1.5
CAMERA = CameraModel(160, 120, 150.0, (0.9, 0.0, HEIGHT), pitch=pi / 2)
"""Looks down from 1.5 m on a place that the arm does not reach at `home`."""

TABLE = SceneObject("table", Box((3.0, 3.0, 0.05)), from_angles((0.8, 0.0, -0.025), (0, 0, 0)))
SCENE = Scene((TABLE,))


def picture(stamp=0.0, thing=0.0, where=(slice(50, 70), slice(70, 90)), **changes):
    """The table, with a thing of a height, metres, where it is said to be in the picture."""
    depth = np.full((120, 160), HEIGHT, np.float32)
    depth[where] -= thing
    image = DepthImage(stamp, depth, CAMERA, 0.1, 3.0)
    eye = np.eye(4)
    return replace(ArmPicture(image, eye, eye, HOME, None), **changes)


@pytest.fixture
def measured():
    return MeasuredPoints(MODEL)


def test_a_known_table_is_nothing_new(measured):
    measured.see(picture(), SCENE)
    assert not len(measured.points)


def test_a_thing_on_the_table_is_where_it_is(measured):
    """20 x 20 pixels at 1.2 m: 16 cm wide, 30 cm over the table, below the camera."""
    measured.see(picture(thing=0.3), SCENE)
    low, high = measured.points.min(axis=0), measured.points.max(axis=0)
    # Its top hides a block 15 cm deep.
    side = 20 / 150.0 * 1.2
    assert high - low == pytest.approx((side, side, DEPTH), abs=2 * CELL)
    assert (high[:2] + low[:2]) / 2.0 == pytest.approx((0.9, 0.0), abs=CELL)
    assert high[2] == pytest.approx(0.3, abs=CELL)


def test_single_pixels_are_noise(measured):
    one = slice(60, 61), slice(80, 81)
    measured.see(picture(thing=0.3, where=one), SCENE)
    assert LEAST > 1 and not len(measured.points)


@pytest.mark.parametrize(("off", "is_known"), [(KNOWN - 0.005, True), (KNOWN + 0.025, False)])
def test_points_near_a_known_block_belong_to_it(measured, off, is_known):
    block = SceneObject("block", Box((0.5, 0.5, 0.1)), from_angles((0.9, 0.0, 0.05), (0, 0, 0)))
    measured.see(picture(thing=0.1 + off), Scene((TABLE, block)))
    assert (not len(measured.points)) is is_known


def test_a_thing_that_goes_is_forgotten_and_one_that_is_hidden_stays_for_a_while(measured):
    measured.see(picture(0.0, thing=0.3), SCENE)
    count = len(measured.points)
    measured.see(picture(1.0, thing=0.6), SCENE)  # something higher is before it
    assert len(measured.points) > count
    measured.see(picture(2.0), SCENE)
    assert not len(measured.points)
    measured.see(picture(3.0, thing=0.3), SCENE)
    aside = replace(CAMERA, position=(0.9, 3.0, HEIGHT))
    blind = picture(3.0 + KEPT - 0.1)
    measured.see(replace(blind, image=replace(blind.image, camera=aside)), SCENE)
    assert len(measured.points) == count, "out of view"
    late = replace(blind.image, camera=aside, stamp=3.0 + KEPT + 0.1)
    measured.see(replace(blind, image=late), SCENE)
    assert not len(measured.points)


def test_what_is_new_since_a_plan(measured):
    measured.see(picture(0.0, thing=0.3), SCENE)
    assert len(measured.since(-inf)) == len(measured.points)
    measured.see(picture(0.2, thing=0.3), SCENE)
    assert not len(measured.since(0.0)), "the same thing"
    there = slice(50, 70), slice(110, 130)
    both = picture(0.4, thing=0.3)
    both.image.depth[there] -= np.float32(0.3)
    measured.see(both, SCENE)
    new = measured.since(0.2)
    # 40 pixels of 8 mm to the side of the first one, along -y.
    top = new[new[:, 2] > 0.3 - CELL]
    assert top.mean(axis=0) == pytest.approx((0.9, -40 / 150.0 * 1.2, 0.3), abs=2 * CELL)
    assert SAME > CELL * 3**0.5, "a neighbouring cell is no new thing"


def test_points_of_before_a_drive_are_elsewhere(measured):
    measured.see(picture(0.0, thing=0.3), SCENE)
    moved = from_angles((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    measured.see(picture(0.2, odom_from_link=moved), SCENE)
    assert not len(measured.points)


def test_points_on_the_arm_and_on_what_it_holds_are_its_own():
    """Points on the surface of each link, and beyond the margin from all of them."""
    own, draw = OwnShape(MODEL), np.random.default_rng(3)
    bare = Collisions(MODEL, Scene())
    for _ in range(5):
        limits = MODEL.description.limits
        q = draw.uniform(limits.lower, limits.upper)
        bare.collides(q)
        cloud = draw.uniform(-1.0, 1.0, (400, 3))
        covered = own.covers(cloud, q, None, OWN)
        # A sphere of the margin's radius touches the arm exactly where a point counts to it.
        for point, is_own in zip(cloud[:60], covered[:60], strict=True):
            scene = Scene((SceneObject("p", Box((1e-4,) * 3), from_angles(point, (0, 0, 0))),))
            away = Collisions(MODEL, scene).distance(q)
            if is_own:  # planes reach further at sharp edges than the distance
                assert away < 2.0 * OWN or np.linalg.norm(point) < 0.3
            else:
                assert away > OWN - 1e-3 or np.linalg.norm(point) < 0.3
    tool = MeasuredPoints(MODEL)._kinematics.forward(HOME)
    below = tool[:3, 3] + (0.0, 0.0, -0.05)
    held = SceneObject("held", Box((0.05, 0.05, 0.06)), np.eye(4))
    pose = tool.copy()
    pose[:3, 3] = below
    assert MeasuredPoints(MODEL)._is_own(below[None], picture(), replace(SCENE, held=held)).all()


def test_a_thing_at_the_border_of_a_picture_is_taller_than_it_is_seen(measured):
    measured.see(picture(thing=0.3, where=(slice(50, 70), slice(0, 20))), SCENE)
    assert measured.points[:, 2].max() == pytest.approx(0.3 + TALL, abs=CELL)
