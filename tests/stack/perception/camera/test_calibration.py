"""Calibration of a camera whose intrinsics are known, from rendered pictures of the board."""

import zlib
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from stack.errors import InputError, ParameterError
from stack.perception.camera.board import Board, BoardParameters, BoardView, png
from stack.perception.camera.calibration import GRID, calibrate
from stack.perception.camera.pictures import overview
from stack.types import CameraModel
from tests.stack.perception.camera.board_views import (
    BOARD,
    DISTORTION,
    MATRIX,
    SIZE,
    Bench,
    pictures,
)

CENTRE = 0.5
"""OpenCV counts from the centre of the first pixel, the camera model from the picture's corner."""
TRUTH = CameraModel(
    *SIZE, MATRIX[0, 0], (0.0, 0.0, 0.0), focal_length_y=MATRIX[1, 1],
    principal_point=(MATRIX[0, 2] + CENTRE, MATRIX[1, 2] + CENTRE), distortion=tuple(DISTORTION),
)  # fmt: skip


@cache
def taken():
    """Fourteen pictures of the board through the lens."""
    return pictures(Bench(MATRIX, DISTORTION))


@cache
def views():
    return tuple(Board(BOARD).find(picture) for picture in taken())


def flat_views(poses, noise=0.05, seed=0, distortion=DISTORTION):
    """Views without pictures: the corners as OpenCV projects them, with noise in pixels."""
    random = np.random.default_rng(seed)
    points = np.array([[x, y, 0.0] for y in np.arange(1, 5) for x in np.arange(1, 7)]) * 0.03
    found = []
    for turn, move in poses:
        seen, _ = cv2.projectPoints(points, np.array(turn), np.array(move), MATRIX, distortion)
        corners = seen[:, 0] + CENTRE + random.normal(0.0, noise, (len(points), 2))
        found.append(BoardView(corners, points))
    return found


def test_all_views_are_found():
    assert [view.rejected for view in views()] == [""] * 14
    assert min(len(view.corners) for view in views()) >= 16


def test_the_intrinsics_are_those_of_the_rendering_camera():
    """Stated tolerance: 0.3 % of the focal length, 1 px of the principal point, and for every ray
    within 80 % of the way to the corner of the picture 0.6 px with all errors together."""
    result = calibrate(views(), SIZE)
    found = result.camera
    assert (found.fx, found.fy) == pytest.approx((452.0, 449.0), rel=0.003)
    assert (found.cx, found.cy) == pytest.approx((334.0, 235.5), abs=1.0)
    angles, radii = np.meshgrid(np.linspace(0, 2 * np.pi, 24), np.linspace(0.0, 0.8, 9))
    rays = (radii * 1.13 * np.array([np.cos(angles), np.sin(angles)])).reshape(2, -1).T
    points = np.column_stack([rays, np.ones(len(rays))])
    # The same rays, seen with both models; 1.13 is the ray of the corner.
    assert np.abs(found.project(points) - TRUTH.project(points)).max() < 0.6
    assert result.rms < 0.15
    assert len(result.view_errors) == 14


def test_the_stated_deviations_cover_the_errors():
    """Chi-square of nine parameters is below 27.9 in 99.9 % of the cases if they were independent;
    with noise of 0.3 px the deviations are far above the errors of the corner detection."""
    random = np.random.default_rng(5)
    poses = [
        (random.uniform(-0.6, 0.6, 3), [*random.uniform(-0.12, 0.06, 2), random.uniform(0.2, 0.4)])
        for _ in range(20)
    ]
    result = calibrate(flat_views(poses, noise=0.3, seed=5), SIZE)
    camera, spread = result.camera, result.deviations
    errors = [camera.fx - 452.0, camera.fy - 449.0, camera.cx - 334.0, camera.cy - 235.5]
    errors += list(np.array(camera.distortion) - DISTORTION)
    deviations = np.array(list(spread.values()))
    assert (deviations > 0.0).all()
    assert np.abs(np.array(errors) / deviations).max() < 4.0
    assert result.rms == pytest.approx(0.3 * np.sqrt(2), rel=0.1)  # of both coordinates together


def test_fewer_coefficients_can_be_estimated():
    turns = [(0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (-0.5, 0.1, 0.0), (0.0, -0.5, 0.0)]
    lens = 0.3 * DISTORTION
    bench = flat_views([(turn, (-0.1, -0.05, 0.3)) for turn in turns], distortion=lens)
    for terms, zero in ((0, slice(0, 5)), (1, slice(1, 5)), (2, slice(2, 5)), (4, slice(4, 5))):
        result = calibrate(bench, SIZE, terms)
        assert not any(result.camera.distortion[zero])
        assert all(result.deviations[name] == 0.0 for name in ("k1", "k2", "p1", "p2", "k3")[zero])
    assert calibrate(bench, SIZE, 0).rms > 3 * calibrate(bench, SIZE, 2).rms


def test_coverage_counts_the_parts_with_corners():
    result = calibrate(views(), SIZE)
    assert result.counts.shape == GRID
    assert result.counts.sum() == sum(len(view.corners) for view in views())
    assert result.coverage == (result.counts > 0).mean() > 0.6
    assert 0.6 < result.reach < 1.0


def test_a_distortion_that_folds_the_picture_is_refused():
    """With k1 alone these corners of a strong lens give 1 + 3 k1 r² = 0 inside the picture."""
    turns = [(0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (-0.5, 0.1, 0.0), (0.0, -0.5, 0.0)]
    bench = flat_views([(turn, (-0.1, -0.05, 0.3)) for turn in turns])
    with pytest.raises(InputError, match="folds the border of the picture"):
        calibrate(bench, SIZE, 1)


def test_too_few_views_are_refused():
    with pytest.raises(InputError, match="3 of the pictures can be used, at least 4 are needed"):
        calibrate(views()[:3], SIZE)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.5, 0.2, 0.0)], ids=["facing", "tilted"])
def test_views_from_one_angle_are_refused(turn):
    """Parallel boards: the focal length follows from none of them, or from one view's worth."""
    random = np.random.default_rng(2)
    poses = [
        (np.array(turn) + random.normal(0.0, 0.01, 3),
         [*random.uniform(-0.15, 0.05, 2), random.uniform(0.2, 0.5)])
        for _ in range(10)
    ]  # fmt: skip
    with pytest.raises(InputError, match=r"focal length.*take pictures with the board tilted"):
        calibrate(flat_views(poses, noise=0.1), SIZE)


def test_a_picture_without_the_board_says_what_was_found():
    board = Board(BOARD)
    assert board.find(np.full((240, 320), 90, np.uint8)).rejected == (
        "no board: no markers of DICT_4X4_50"
    )
    other = Board(replace(BOARD, dictionary="DICT_6X6_50"))
    assert "DICT_6X6_50" in other.find(taken()[3]).rejected


@pytest.mark.parametrize(
    ("columns", "rejected"),
    [(7, "only 6 corners; at least 8 are needed"), (12, "all 11 corners are nearly on one line")],
)
def test_one_row_of_corners_is_not_enough(columns, rejected):
    board = Board(replace(BOARD, columns=columns))
    strip = board.drawn(2000)
    strip[30 + 2 * 60 :] = 255  # a margin of 30 pixels and two rows of squares of 60
    assert board.find(strip).rejected == rejected


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"marker": 0.04}, "0.04 m must be below the square's side of 0.03 m"),
        ({"columns": 20, "rows": 20}, "20 x 20 squares need 200 markers, DICT_4X4_50 has 50"),
        ({"dictionary": "DICT_4X4"}, "there is no dictionary 'DICT_4X4'; did you mean 'DICT_4X4_"),
    ],
)
def test_an_impossible_board_is_refused(wrong, sentence):
    with pytest.raises(ParameterError) as caught:
        Board(replace(BOARD, **wrong))
    assert sentence in str(caught.value)


def test_the_printed_board_is_found_and_says_its_size():
    for parameters in (BOARD, BoardParameters(8, 6, 0.02, 0.015, "DICT_5X5_100", legacy=True)):
        board = Board(parameters)
        picture = board.drawn(11811.0)
        assert len(board.find(picture).corners) == board.corner_count
    file = png(picture, 11811.0)
    start = file.index(b"pHYs")
    assert int.from_bytes(file[start + 4 : start + 8]) == 11811  # dots per metre: 300 per inch
    assert file[start + 12] == 1
    assert int.from_bytes(file[start + 13 : start + 17]) == zlib.crc32(file[start : start + 13])
    decoded = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert (decoded == picture).all()


def test_the_overview_has_the_corners_and_a_rectified_picture():
    result = calibrate(views(), SIZE)
    shown = overview(taken()[0], views(), result)
    assert shown.shape == (480, 1280, 3)
    column, row = views()[0].corners[0].astype(int)
    assert shown[row, column, 1] > 150 or shown[row, column, 2] > 150  # a green or red dot
