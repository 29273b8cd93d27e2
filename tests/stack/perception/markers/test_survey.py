"""Markers surveyed from views with known poses: exact, noisy and mirrored views."""

from math import pi, radians

import numpy as np
import pytest

from stack.perception.markers.detector import MarkerDetection
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.survey import MarkerSurvey
from stack.types import Image, Marker, Pose2D
from tests.stack.perception.markers.marker_pictures import (
    CAMERA,
    WALL_MARKER,
    facing,
    seen_corners,
)

NOISE = 0.3
POSE_DEVIATION = np.diag(np.square([0.01, 0.01, 0.004]))
BEARINGS = np.linspace(-0.9, 0.9, 14)
OTHER_DICTIONARY = "DICT_APRILTAG_36h11"


def unchanged(stamp: float, odometry: Pose2D) -> None:
    return None


def surveyed(generator, *, noise=NOISE, bearings=BEARINGS, shift=None):
    """A survey after one view from each bearing, 1.5 m away."""
    survey = MarkerSurvey(MarkerParameters())
    for stamp, bearing in enumerate(bearings):
        pose = facing(1.5, float(bearing), 0.0)
        corners = seen_corners(pose, WALL_MARKER, CAMERA)
        corners = corners + generator.normal(0.0, noise, corners.shape)
        believed = Pose2D(pose.x, pose.y + (shift or 0.0), pose.heading)
        image = Image(float(stamp), np.zeros((2, 2, 3), np.uint8), CAMERA)
        survey.add(
            MarkerDetection("DICT_4X4_50", 7, corners), image, believed, POSE_DEVIATION, pose
        )
    return survey


def test_exact_views_give_the_exact_marker():
    survey = surveyed(np.random.default_rng(0), noise=0.0)
    (found,) = survey.markers(unchanged)
    assert (found.number, found.dictionary, found.size) == (7, "DICT_4X4_50", 0.2)
    assert found.position == pytest.approx(WALL_MARKER.position, abs=1e-4)
    assert abs(found.heading) == pytest.approx(pi, abs=1e-3)


def test_errors_agree_with_the_deviations():
    """12 surveys: mean squared error in deviations at most 1; the poses' part has no error here."""
    squares = []
    for seed in range(12):
        (found,) = surveyed(np.random.default_rng(seed)).markers(unchanged)
        off = np.subtract(found.position[:2], WALL_MARKER.position[:2])
        squares.append(float(off @ off) / found.position_deviation**2)
        assert 0.01 < found.position_deviation < 0.03
        assert 0.004 < found.heading_deviation < radians(2.0)
    assert np.mean(squares) < 1.0


def test_views_from_several_directions_resolve_the_mirrored_solution():
    """In each view alone the mirrored marker fits about as well; in all of them it does not."""
    for seed in range(5):
        bearings = (-0.5, -0.3, 0.3, 0.5, 0.7)
        (found,) = surveyed(np.random.default_rng(seed), bearings=bearings).markers(unchanged)
        assert abs(abs(found.heading) - pi) < radians(4.0)


def test_a_wrong_detection_does_not_move_the_marker():
    """One of 15 views shows the number on another board, half a metre away: Huber's weights."""
    survey = surveyed(np.random.default_rng(1))
    elsewhere = Marker(7, 0.2, (3.0, 1.5, 0.4), pi)
    pose = facing(1.2, 0.1, 0.0)
    image = Image(99.0, np.zeros((2, 2, 3), np.uint8), CAMERA)
    seen = MarkerDetection("DICT_4X4_50", 7, seen_corners(pose, elsewhere, CAMERA))
    survey.add(seen, image, pose, POSE_DEVIATION, pose)
    (found,) = survey.markers(unchanged)
    assert np.hypot(*np.subtract(found.position[:2], WALL_MARKER.position[:2])) < 0.02


def test_poses_corrected_later_are_used():
    """The map was shifted by half a metre when the views were taken; a loop closure undid it."""
    survey = surveyed(np.random.default_rng(2), shift=0.5)
    (wrong,) = survey.markers(unchanged)
    (right,) = survey.markers(lambda stamp, odometry: odometry)
    assert wrong.position[1] - WALL_MARKER.position[1] == pytest.approx(0.5, abs=0.02)
    assert right.position[1] == pytest.approx(WALL_MARKER.position[1], abs=0.02)


def test_few_views_and_other_dictionaries_give_no_marker():
    survey = surveyed(np.random.default_rng(3), bearings=BEARINGS[:4])
    assert survey.markers(unchanged) == ()
    image = Image(0.0, np.zeros((2, 2, 3), np.uint8), CAMERA)
    corners = seen_corners(facing(1.5, 0.0, 0.0), WALL_MARKER, CAMERA)
    other = MarkerDetection(OTHER_DICTIONARY, 1, corners)
    survey.add(other, image, Pose2D(0.0, 0.0), POSE_DEVIATION, Pose2D(0.0, 0.0))
    assert (OTHER_DICTIONARY, 1) not in survey.views


def test_the_same_place_gives_one_view():
    survey = surveyed(np.random.default_rng(4), bearings=[0.3] * 8)
    assert len(survey.views["DICT_4X4_50", 7]) == 1
