"""Coloured objects: rendered pictures of boxes, in dim and bright light."""

from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.perception.colour_parameters import ColourParameters
from stack.perception.coloured_objects import ColouredObjectDetector, colour_mask
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box
from stack.types import Image, Pose2D
from tests.stack.sim.sim_rover import EMPTY

SCOUT = read_robot(find_robot("scout", Path()))
CAMERA = SCOUT.camera
COLOURS = {
    "red": (0.8, 0.1, 0.1), "yellow": (0.85, 0.75, 0.1), "green": (0.1, 0.6, 0.2),
    "blue": (0.1, 0.2, 0.75),
}  # fmt: skip
NOTHING = np.empty((0, 2))
DEFAULTS = ColourParameters()


def box(x, y=0.0, colour="red", size=(0.3, 0.3, 0.3), **more):
    return Box(Pose2D(x, y), size, COLOURS[colour], **more)


def picture(*boxes, light=1.0, base=Pose2D(0.0, 0.0)):
    world = replace(EMPTY, boxes=boxes, light=light)
    renderer = CameraRenderer(RenderSetup(world, SCOUT.model, CAMERA, "camera"))
    try:
        turn = (0.0, 0.0, sin(base.heading / 2), cos(base.heading / 2))
        request = RenderRequest(0, (base.x, base.y, 0.0), turn, np.empty((0, 3)), {})
        return Image(0.2, renderer.render(request), CAMERA.model)
    finally:
        renderer.close()


def seen(*boxes, colour="red", base=Pose2D(0.0, 0.0), ranges=NOTHING, light=1.0, p=DEFAULTS):
    image = picture(*boxes, light=light, base=base)
    return ColouredObjectDetector(p).detect(image, colour, base, ranges)


@pytest.mark.parametrize("light", [0.4, 1.0, 1.5])
@pytest.mark.parametrize("colour", COLOURS)
def test_a_box_is_where_it_stands_in_any_light(colour, light):
    (found,) = seen(box(2.0, colour=colour), colour=colour, light=light)
    # Its face is at 1.85 m. One pixel is 1.73**2 / (228 * 0.35) = 3.7 cm of floor there.
    assert found.position == pytest.approx((1.85, 0.0), abs=0.08)
    assert found.deviation == pytest.approx(0.037, abs=0.005)
    assert (found.width, found.height) == pytest.approx((0.3, 0.35), abs=0.06)
    assert (found.label, found.stamp) == (colour, 0.2)


def test_only_the_asked_colour_is_found():
    boxes = box(2.0, 0.5, "blue"), box(2.0, -0.5, "green")
    assert seen(*boxes, colour="red") == ()
    assert seen(*boxes, colour="yellow") == ()
    (blue,) = seen(*boxes, colour="blue")
    assert blue.position[1] > 0.3


def test_pale_and_grey_things_have_no_colour():
    pink = replace(box(2.0, 0.5), colour=(0.85, 0.6, 0.65))
    grey = replace(box(2.0, -0.5), colour=(0.5, 0.5, 0.5))
    assert seen(pink, grey) == ()


def test_several_are_sorted_by_distance():
    found = seen(box(3.0, 0.8), box(1.5, -0.4))
    assert [item.position[0] for item in found] == pytest.approx([1.35, 2.85], abs=0.15)


def test_points_of_the_lidar_give_a_better_distance_far_away():
    (rough,) = seen(box(5.0))
    assert rough.deviation > 0.25
    face = np.column_stack([np.full(5, 4.85), np.linspace(-0.12, 0.12, 5)])
    wall = np.column_stack([np.full(9, 7.0), np.linspace(-0.8, 0.8, 9)])
    (exact,) = seen(box(5.0), ranges=np.concatenate([wall, face]))
    assert exact.position == pytest.approx((4.85, 0.0), abs=0.02)
    assert exact.deviation == pytest.approx(0.03)


def test_a_wall_behind_a_low_box_is_not_its_place():
    low = box(2.0, size=(0.3, 0.3, 0.1))
    wall = np.column_stack([np.full(9, 3.0), np.linspace(-0.5, 0.5, 9)])
    (found,) = seen(low, ranges=wall)
    assert found.position[0] == pytest.approx(1.85, abs=0.08)


def test_a_box_that_the_picture_cuts_is_near():
    wall = np.column_stack([np.full(9, 3.0), np.linspace(-0.5, 0.5, 9)])
    (found,) = seen(box(0.75), ranges=wall)
    # The lowest row shows the floor from 0.12 + 0.35 / tan(27.7 deg) = 0.79 m on; the face is at
    # 0.6 m.
    assert 0.4 < found.position[0] < 0.79
    assert found.deviation >= 0.1


def test_the_position_is_in_the_map_frame():
    base = Pose2D(1.0, 2.0, pi / 2)
    (found,) = seen(box(1.0, 4.0), base=base)
    assert found.position == pytest.approx((1.0, 3.85), abs=0.08)


def test_small_and_far_things_are_ignored():
    assert seen(box(2.0), p=replace(DEFAULTS, least_size=0.5)) == ()
    assert seen(box(3.0), p=replace(DEFAULTS, farthest=2.0)) == ()
    assert seen(box(2.0), p=replace(DEFAULTS, least_pixels=5000)) == ()


def test_new_parameters_count_from_then_on():
    image, detector = picture(box(2.0)), ColouredObjectDetector(DEFAULTS)
    assert detector.detect(image, "red", Pose2D(0, 0), NOTHING)
    detector.configure(replace(DEFAULTS, farthest=1.0))
    assert detector.detect(image, "red", Pose2D(0, 0), NOTHING) == ()


def test_a_box_above_the_horizon_has_no_place():
    assert seen(box(3.0, elevation=0.6)) == ()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_mask_of_noise_is_zero_or_one_and_nothing_breaks(seed):
    pixels = np.random.default_rng(seed).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    for colour in COLOURS:
        mask = colour_mask(pixels, colour)
        assert mask.shape == (60, 80) and set(np.unique(mask)) <= {0, 1}
    image = Image(0.0, pixels, replace(CAMERA.model, width=80, height=60))
    ColouredObjectDetector(DEFAULTS).detect(image, "red", Pose2D(0, 0), np.zeros((3, 2)))
