"""The camera model against OpenCV, and its round trips."""

from math import atan, hypot, pi, radians

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.types import CameraModel

WIDE = CameraModel(
    640, 480, 420.0, (0.1, 0.0, 0.3), focal_length_y=418.0, principal_point=(331.0, 235.5),
    distortion=(-0.28, 0.09, 0.0012, -0.0007, -0.005),
)  # fmt: skip
"""80 degrees wide; coefficients of the size of a common wide-angle lens."""

coefficients = st.tuples(
    st.floats(-0.25, 0.25), st.floats(-0.05, 0.05), st.floats(-0.004, 0.004),
    st.floats(-0.004, 0.004), st.floats(-0.01, 0.01),
)  # fmt: skip


def random_points(count=500):
    random = np.random.default_rng(3)
    points = random.uniform([-1.0, -0.7, 0.5], [1.0, 0.7, 4.0], (count, 3))
    points[:, :2] *= points[:, 2:]
    return points[np.hypot(points[:, 0], points[:, 1]) < 0.9 * points[:, 2]]


def test_projection_is_that_of_opencv():
    points = random_points()
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), WIDE.matrix, np.array(WIDE.distortion)
    )
    assert np.abs(WIDE.project(points) - expected[:, 0]).max() < 1e-9


def test_undistorted_points_are_those_of_opencv():
    pixels = WIDE.project(random_points())
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    expected = cv2.undistortPoints(
        pixels[:, None], WIDE.matrix, np.array(WIDE.distortion), P=WIDE.matrix,
        criteria=criteria,
    )  # fmt: skip
    assert np.abs(WIDE.undistort_points(pixels) - expected[:, 0]).max() < 1e-5


@given(coefficients, st.floats(0.0, 0.85), st.floats(0.0, 2 * pi), st.floats(0.2, 20.0))
def test_what_is_projected_comes_back(distortion, radius, angle, depth):
    camera = CameraModel(320, 240, 200.0, (0.0, 0.0, 0.3), distortion=distortion)
    ray = np.array([[radius * np.cos(angle), radius * np.sin(angle)]])
    pixels = camera.project(depth * np.column_stack([ray, np.ones(1)]))
    assert np.abs(camera.rays(pixels) - ray).max() < 1e-6
    assert np.abs(camera.distort_points(camera.undistort_points(pixels)) - pixels).max() < 1e-6


def test_without_distortion_nothing_is_computed():
    camera = CameraModel(320, 240, 280.0, (0.0, 0.0, 0.3))
    pixels = np.array([[0.3, 7.1], [319.9, 239.2]])
    assert camera.undistort_points(pixels) is pixels
    assert camera.distort_points(pixels) is pixels
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (280.0, 280.0, 160.0, 120.0)
    assert camera.horizontal_view == 2.0 * atan(0.5 * 320 / 280.0)
    assert not CameraModel(4, 4, 4.0, (0, 0, 1), distortion=(0.0,) * 5).is_distorted


def test_what_lies_behind_the_lens_or_beyond_the_model_is_not_seen():
    camera = CameraModel(320, 240, 200.0, (0, 0, 0.3), distortion=(-0.3, 0.0, 0.0, 0.0, 0.0))
    # x_d = x (1 - 0.3 x²) grows up to x = sqrt(1 / 0.9) = 1.054, where x_d = 0.703.
    pixels = camera.project(np.array([[1.05, 0, 1], [1.06, 0, 1], [0, 0, -1], [3.0, 0, 1]]))
    assert np.isnan(pixels[1:]).all()
    assert pixels[0, 0] == pytest.approx(160 + 200 * 1.05 * (1 - 0.3 * 1.05**2))
    limit = 160 + 200 * 0.7027
    rays = camera.rays(np.array([[limit - 1.0, 120.0], [limit + 1.0, 120.0]]))
    assert 0.95 < rays[0, 0] < 1.054
    assert np.isnan(rays[1]).all()
    assert not camera.is_invertible()  # the picture ends at column 320
    assert WIDE.is_invertible()


def test_the_horizontal_view_follows_the_lens():
    # The rays of the left and right border at the row of the principal point: hand calculation
    # by bisection of x (1 - 0.1 x²) = 0.8 at both ends.
    camera = CameraModel(320, 240, 200.0, (0, 0, 0.3), distortion=(-0.1, 0.0, 0.0, 0.0, 0.0))
    low, high = 0.8, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if middle * (1 - 0.1 * middle**2) < 0.8 else (low, middle)
    assert camera.horizontal_view == pytest.approx(2 * atan(low))
    assert camera.horizontal_view > 2 * atan(0.8)


def test_a_rectified_picture_has_straight_lines():
    """The picture of a straight line through a distorting lens, rectified."""
    camera = CameraModel(320, 240, 200.0, (0, 0, 0.3), distortion=(-0.25, 0.05, 0, 0, 0))
    rays = camera.rays(camera.pixel_centres()).reshape(240, 320, 2)
    edge = rays[:, :, 0] + 0.2 * rays[:, :, 1] > 0.45
    rectified = cv2.remap(255 * edge.astype(np.uint8), *camera.rectifying_maps(), cv2.INTER_LINEAR)
    rows = np.arange(20, 220)
    columns = np.array([np.argmax(rectified[row] > 127) for row in rows])
    # column - 160 = 200 (0.45 - 0.2 y), y = (row + 0.5 - 120) / 200
    expected = 160 + 200 * (0.45 - 0.2 * (rows + 0.5 - 120) / 200)
    assert np.abs(columns - expected).max() < 1.6  # a pixel of the edge, one of the remap


def test_a_wrong_number_of_coefficients_is_refused():
    with pytest.raises(ValueError, match=r"empty or \(k1, k2, p1, p2, k3\), got \(0.1, 0.2\)"):
        CameraModel(4, 4, 4.0, (0, 0, 1), distortion=(0.1, 0.2))


def test_the_mount_is_that_of_rep_103():
    camera = CameraModel(4, 4, 4.0, (0.1, 0.2, 0.3), pitch=radians(90))
    # Looking straight down: the picture's top is ahead, its right is right.
    assert np.allclose(camera.base_from_optical()[:3, :3], [[0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    assert hypot(*camera.base_from_optical()[:2, 3]) == pytest.approx(hypot(0.1, 0.2))
