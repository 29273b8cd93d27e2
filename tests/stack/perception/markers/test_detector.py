"""Marker sightings against pictures rendered from known poses."""

from math import pi, radians

import cv2
import numpy as np
import pytest

from stack.errors import InputError
from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.edges import refine_corners
from stack.perception.markers.square_pose import map_from_marker
from stack.types import CameraModel, Marker, wrap_angle
from tests.stack.perception.markers.marker_pictures import (
    CAMERA,
    FOCAL,
    WALL_MARKER,
    facing,
    optical_from,
    rendered,
)


def test_the_marker_frame_is_right_handed_and_faces_outward():
    transform = map_from_marker(Marker(0, 0.2, (1.0, 2.0, 0.5), 0.7))
    assert np.linalg.det(transform[:3, :3]) == pytest.approx(1.0)
    assert transform[:3, 2] == pytest.approx([np.cos(0.7), np.sin(0.7), 0.0])


@pytest.mark.parametrize(
    "aliased, metres, angle", [(False, 0.005, radians(0.2)), (True, 0.03, radians(2.0))]
)
def test_median_error_at_one_and_a_half_metres(aliased, metres, angle):
    """320 x 240, 70 degrees, the better of the two solutions; the target is 2 cm and 2 degrees."""
    generator = np.random.default_rng(0)
    detector = MarkerDetector([WALL_MARKER])
    errors, turns, seen = [], [], 0
    for _ in range(60):
        pose = facing(1.5, generator.uniform(-0.9, 0.9), generator.uniform(-0.3, 0.3))
        sightings = detector.sightings(
            rendered(pose, [WALL_MARKER], CAMERA, generator, aliased=aliased)
        )
        if not sightings:
            continue
        seen += 1
        nearest = min(sightings[0].candidates, key=lambda c: c.pose.distance_to(pose))
        errors.append(nearest.pose.distance_to(pose))
        turns.append(abs(wrap_angle(nearest.pose.heading - pose.heading)))
    assert seen >= 55
    assert np.median(errors) <= metres
    assert np.median(turns) <= angle


def test_a_sighting_has_marker_stamp_and_distance():
    pose = facing(1.0, 0.4, 0.0)
    image = rendered(pose, [WALL_MARKER], CAMERA, np.random.default_rng(1))
    detector = MarkerDetector([WALL_MARKER])
    (sighting,) = detector.sightings(image)
    assert detector.sightings(image)[0] is sighting  # an image is searched only once
    assert sighting.marker is WALL_MARKER
    assert sighting.stamp == 1.5
    # from the lens, 0.15 m ahead of the base and 0.1 m below the marker
    assert sighting.distance == pytest.approx(np.hypot(0.85, 0.1), abs=0.02)
    errors = [candidate.error for candidate in sighting.candidates]
    assert errors == sorted(errors)
    assert errors[0] < 1.0


def test_both_solutions_are_kept_where_only_a_prior_could_choose():
    """Far away and nearly frontal, the mirrored pose is on the floor as well."""
    generator = np.random.default_rng(2)
    detector = MarkerDetector([WALL_MARKER])
    counts = []
    for bearing in (-0.5, -0.3, 0.3, 0.5):
        image = rendered(facing(2.0, bearing, 0.0), [WALL_MARKER], CAMERA, generator)
        counts += [len(sighting.candidates) for sighting in detector.sightings(image)]
    assert 2 in counts


def test_unknown_markers_are_ignored_and_dictionaries_kept_apart():
    generator = np.random.default_rng(3)
    tag = Marker(7, 0.2, (3.0, 1.4, 0.4), pi, "DICT_APRILTAG_36h11")
    stranger = Marker(9, 0.2, (3.0, 0.6, 0.4), pi)
    image = rendered(facing(1.2, 0.0, 0.0), [WALL_MARKER, tag, stranger], CAMERA, generator)
    found = MarkerDetector([WALL_MARKER, tag]).sightings(image)
    assert {sighting.marker.dictionary for sighting in found} == {
        "DICT_4X4_50", "DICT_APRILTAG_36h11",
    }  # fmt: skip
    for sighting in found:
        best = min(c.pose.distance_to(facing(1.2, 0.0, 0.0)) for c in sighting.candidates)
        assert best < 0.05
    assert MarkerDetector([stranger]).sightings(image)[0].marker.number == 9


def test_a_turned_camera_gives_the_same_base():
    camera = CameraModel(640, 480, 2 * FOCAL, (0.1, 0.05, 0.35), pitch=0.1, yaw=pi / 2)
    pose = facing(1.2, 0.2, -pi / 2)
    image = rendered(pose, [WALL_MARKER], camera, np.random.default_rng(4))
    detector = MarkerDetector([WALL_MARKER])
    (sighting,) = detector.sightings(image)
    assert detector.sightings(image)[0] is sighting  # an image is searched only once
    assert min(c.pose.distance_to(pose) for c in sighting.candidates) < 0.02


def test_refined_corners_are_good_to_a_tenth_of_a_pixel():
    """Against the corners projected from the known pose; subpixel refinement alone is 0.2 off."""
    generator = np.random.default_rng(6)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    detector = cv2.aruco.ArucoDetector(dictionary)
    frame, half = map_from_marker(WALL_MARKER), WALL_MARKER.size / 2
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    in_map = np.column_stack([square @ frame[:3, :3].T + frame[:3, 3], np.ones(4)])
    errors = []
    for _ in range(15):
        pose = facing(1.5, generator.uniform(-0.7, 0.7), generator.uniform(-0.2, 0.2))
        image = rendered(pose, [WALL_MARKER], CAMERA, generator)
        quads, _, _ = detector.detectMarkers(image.pixels[:, :, 0])
        refined = refine_corners(image.pixels[:, :, 0], quads[0].reshape(4, 2).astype(float), 6)
        optical = (optical_from(pose, CAMERA) @ in_map.T)[:3]
        expected = (CAMERA.matrix @ optical)[:2] / optical[2]
        errors.append(refined + 0.5 - expected.T)
    assert np.sqrt(np.square(errors).sum(axis=-1).mean()) < 0.1


def test_an_empty_wall_has_no_markers():
    image = rendered(facing(1.5, 0.0, 0.0), [], CAMERA, np.random.default_rng(5))
    assert MarkerDetector([WALL_MARKER]).sightings(image) == ()
    assert MarkerDetector([]).sightings(image) == ()


def test_an_unknown_dictionary_is_an_error():
    with pytest.raises(InputError, match=r"no marker dictionary 'DICT_4X4_5O'.*DICT_4X4_50"):
        MarkerDetector([Marker(1, 0.2, (0.0, 0.0, 0.5), 0.0, "DICT_4X4_5O")])
