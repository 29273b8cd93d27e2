"""Intrinsics in robot files: focal length, principal point and distortion of a camera."""

from math import tan

import pytest

from stack.errors import InputError
from tests.robots.test_load import ROBOT, read  # noqa: F401 - a fixture

LENS = """\
camera:
  position: [0.1, 0, 35 cm]
  width: 640
  height: 480
  focal_length: [421.5, 419.75 px]
  principal_point: [331.25, 235.5]
  distortion: [-0.28, 0.09, 0.0012, -0.0007, -0.005]
"""


def test_the_keys_of_a_calibration_are_the_camera_model(read):  # noqa: F811
    model = read(f"{ROBOT}{LENS}").camera.model
    assert (model.fx, model.fy, model.cx, model.cy) == (421.5, 419.75, 331.25, 235.5)
    assert model.distortion == (-0.28, 0.09, 0.0012, -0.0007, -0.005)
    assert model.is_distorted


def test_without_them_the_camera_is_a_centred_pinhole(read):  # noqa: F811
    text = f"{ROBOT}camera: {{position: [0, 0, 1], width: 64, height: 48, field_of_view: 1.2}}"
    model = read(text).camera.model
    assert (model.fx, model.cx, model.cy) == (32 / tan(0.6), 32.0, 24.0)
    assert (model.fy, model.distortion) == (model.fx, ())
    zeros = text.replace("1.2}", "1.2, distortion: [0, 0, 0, 0, 0]}")
    assert read(zeros).camera.model == model


@pytest.mark.parametrize(
    ("keys", "limit"),
    [("latency: 20 ms, exposure: 50 ms", 0.04), ("rate: 30, exposure: 0.1", 1 / 30)],
)
def test_an_exposure_ends_before_its_picture_is_delivered(read, keys, limit):  # noqa: F811
    with pytest.raises(InputError, match=f"s must be at most {limit:g} s, the time between"):
        read(f"{ROBOT}camera: {{position: [0, 0, 1], {keys}}}")


def test_depth_cameras_have_the_same_keys(read):  # noqa: F811
    text = LENS.replace("\n", "\n  ").replace("camera:", "depth_cameras:\n  front:", 1)
    assert read(f"{ROBOT}{text}").depth_cameras["front"].model.fx == 421.5


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[421.5, 419.75 px]", "421.5", "focal_length: expected [fx, fy], got 421.5"),
        ("[421.5, 419.75 px]", "[-421.5, 420]", "fx: -421.5 px must be above 0 px"),
        ("[331.25, 235.5]", "[331.25, 500]", "principal_point: [331.25, 500] is outside the pic"),
        ("-0.0007, -0.005", "-0.0007", "distortion: expected [k1, k2, p1, p2, k3], got a list of"),
        ("-0.28, 0.09", "-0.9, 0.0", "distortion: some pixels at the border have no ray with th"),
        ("  width", "  field_of_view: 70 deg\n  width", "field_of_view: follows from focal_length"),
    ],
)
def test_mistakes_are_named(read, old, new, expected):  # noqa: F811
    with pytest.raises(InputError) as caught:
        read(ROBOT + LENS.replace(old, new))
    assert len(caught.value.findings) == 1
    assert expected in str(caught.value)
