"""Motion blur and automatic gain of the simulated camera."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.sim.sensors.exposure import MIDDLE_GREY, MOST_RENDERINGS, moments
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box
from stack.types import Pose2D
from tests.stack.sim.sim_rover import CAMERA, EMPTY, ROVER

NOBODY = np.zeros((0, 3))
STILL = RenderRequest(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), NOBODY, {})
POST = replace(EMPTY, boxes=(Box(Pose2D(2.15, 0.0), (0.02, 0.5, 3.0), (0.0, 0.0, 0.0)),))
"""A black board, 0.5 m wide, 2 m before the lens at 0.15."""


def picture(request=STILL, camera=CAMERA, world=POST):
    renderer = CameraRenderer(RenderSetup(world, ROVER.model, camera))
    try:
        return renderer.render(request).astype(float)
    finally:
        renderer.close()


def edge(pixels, row=40):
    """Columns of the left edge of the board: where 10, 50 and 90 % of the rise is reached."""
    profile = pixels[row, :160, 0]
    share = (profile - profile[-1]) / (profile[100] - profile[-1])
    return [
        float(np.interp(-level, -share[100:], np.arange(100, 160))) for level in (0.9, 0.5, 0.1)
    ]


def test_a_turning_camera_blurs_by_its_rate_and_the_time():
    camera = replace(CAMERA, exposure=0.04)
    blurred = edge(picture(replace(STILL, spin=(0.0, 0.0, 1.0)), camera))
    sharp = edge(picture())
    # 1 rad/s * 0.04 s * 280 px = 11.2 px in the middle, a little more at the side; 80 % of a ramp.
    assert blurred[2] - blurred[0] == pytest.approx(0.8 * 11.4, abs=1.2)
    assert sharp[2] - sharp[0] < 1.0


def test_the_picture_is_that_of_the_middle_of_the_exposure():
    """The middle of the blurred edge is where the edge is at the stamp, for both directions."""
    camera = replace(CAMERA, exposure=0.04)
    at_the_stamp = edge(picture())[1]
    for spin in (-1.0, 1.0):
        blurred = edge(picture(replace(STILL, spin=(0.0, 0.0, spin)), camera))
        assert blurred[1] == pytest.approx(at_the_stamp, abs=0.7)


def test_a_camera_that_moves_sideways_blurs_near_things_more():
    request = replace(STILL, velocity=(0.0, 0.5, 0.0))
    blurred = edge(picture(request, replace(CAMERA, exposure=0.1)))
    # 0.5 m/s * 0.1 s * 280 px / 2 m = 7 px
    assert blurred[2] - blurred[0] == pytest.approx(0.8 * 7.0, abs=1.2)


def test_without_motion_or_exposure_nothing_changes():
    sharp = picture()
    assert (picture(camera=replace(CAMERA, exposure=0.1)) == sharp).all()
    assert (picture(replace(STILL, spin=(0.0, 0.0, 2.0))) == sharp).all()


def test_the_moments_are_spread_evenly_about_the_stamp():
    camera = replace(CAMERA, exposure=0.02)
    request = replace(STILL, velocity=(0.4, 0.0, 0.0), spin=(0.0, 0.0, pi / 4))
    shots = moments(request, camera)
    # 280 px * (0.785 * 0.02 + 0.4 * 0.02 / 1 m) = 6.6 px
    assert len(shots) == 7
    along = [shot.position[0] for shot in shots]
    assert along == pytest.approx(0.008 * (np.arange(7) - 3) / 7, abs=1e-12)
    headings = [2 * np.arctan2(shot.orientation[2], shot.orientation[3]) for shot in shots]
    assert headings == pytest.approx(pi / 4 * 0.02 * (np.arange(7) - 3) / 7, abs=1e-12)
    assert len(moments(replace(request, spin=(0.0, 0.0, 50.0)), camera)) == MOST_RENDERINGS


@pytest.mark.parametrize("light", [0.1, 0.3, 3.0])
def test_the_automatic_exposure_keeps_the_brightness(light):
    camera, world = replace(CAMERA, max_gain=16.0), replace(POST, light=light)
    assert picture(camera=camera, world=world).mean() == pytest.approx(MIDDLE_GREY, rel=0.05)
    fixed = picture(world=world).mean()
    assert abs(fixed - MIDDLE_GREY) > 0.2 * MIDDLE_GREY


def test_the_gain_has_a_limit_and_amplifies_the_noise():
    dark = replace(POST, light=0.05)
    camera = replace(CAMERA, max_gain=2.0, noise=2.0)
    clean = picture(camera=replace(camera, noise=0.0), world=dark)
    assert clean.mean() == pytest.approx(2.0 * picture(world=dark).mean(), rel=0.05)
    noise = (picture(camera=camera, world=dark) - clean)[clean > 15]
    assert np.std(noise) == pytest.approx(2.0 * 2.0, rel=0.05)
