"""One pose from all markers of a picture, and its covariance, against known poses."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.planar_pose import align_on_floor
from stack.perception.markers.square_pose import corners_in_map
from stack.types import Marker, wrap_angle
from tests.stack.perception.markers.marker_pictures import (
    CAMERA,
    WALL_MARKER,
    facing,
    rendered,
    seen_corners,
)

BESIDE = Marker(8, 0.2, (3.0, 1.5, 0.4), pi)
NOISE = 0.3
CHI_SQUARE = 7.815
"""95 % quantile of the chi-square distribution with three degrees of freedom."""


def offset(found, truth):
    turn = wrap_angle(found.heading - truth.heading)
    return np.array([found.x - truth.x, found.y - truth.y, turn])


def test_the_covariance_of_noisy_corners_contains_95_percent_of_the_errors():
    """Against 300 draws of the noise that it assumes: within three standard deviations of a
    binomial share, 0.038."""
    generator, contained = np.random.default_rng(0), 0
    corners = np.concatenate([corners_in_map(WALL_MARKER), corners_in_map(BESIDE)])
    for _ in range(300):
        pose = facing(1.6, generator.uniform(-0.8, 0.8), generator.uniform(-0.2, 0.2))
        exact = np.concatenate([seen_corners(pose, m, CAMERA) for m in (WALL_MARKER, BESIDE)])
        pixels = exact + generator.normal(0.0, NOISE, exact.shape)
        fit = align_on_floor(pose, CAMERA, corners, pixels, NOISE**2 * np.eye(16))
        off = offset(fit.pose, pose)
        contained += off @ np.linalg.solve(fit.covariance, off) <= CHI_SQUARE
    assert contained / 300 == pytest.approx(0.95, abs=0.038)


@pytest.mark.parametrize("markers", [[WALL_MARKER], [WALL_MARKER, BESIDE]])
def test_the_errors_of_the_mount_are_part_of_every_pose(markers):
    """Variances add: 4 cm and 0.03 rad in place of the default 1 cm and 0.005 rad."""
    image = rendered(facing(1.8, 0.4, 0.0), markers, CAMERA, np.random.default_rng(1))
    loose = MarkerParameters(mount_deviation=0.04, mount_angle_deviation=0.03)
    usual, wide = (
        MarkerDetector(markers, parameters).fix(image).candidates[0].covariance
        for parameters in (MarkerParameters(), loose)
    )
    added = [0.04**2 - 0.01**2] * 2 + [0.03**2 - 0.005**2]
    assert wide - usual == pytest.approx(np.diag(added), abs=1e-9)


def test_two_markers_are_one_large_target():
    """0.5 m apart instead of 0.2 m wide: the deviation of the position is less than half."""
    generator = np.random.default_rng(1)
    pose = facing(1.8, 0.4, 0.0)
    image = rendered(pose, [WALL_MARKER, BESIDE], CAMERA, generator)
    single = MarkerDetector([WALL_MARKER]).fix(image)
    both = MarkerDetector([WALL_MARKER, BESIDE]).fix(image)
    assert [m.number for m in both.markers] == [7, 8]
    assert len(both.candidates) == 1
    assert both.candidates[0].pose.distance_to(pose) < 0.02
    largest = [np.sqrt(np.linalg.eigvalsh(f.candidates[0].covariance[:2, :2])[-1])
               for f in (single, both)]  # fmt: skip
    assert largest[1] < 0.5 * largest[0]


def test_a_marker_that_is_elsewhere_is_left_out():
    generator = np.random.default_rng(2)
    third = Marker(9, 0.2, (3.0, 0.5, 0.4), pi, "DICT_APRILTAG_36h11")
    pose = facing(1.8, 0.2, 0.0)
    image = rendered(pose, [WALL_MARKER, BESIDE, third], CAMERA, generator)
    believed = [WALL_MARKER, replace(BESIDE, position=(3.0, 1.7, 0.4)), third]
    fix = MarkerDetector(believed).fix(image)
    assert {m.number for m in fix.markers} == {7, 9}
    assert fix.candidates[0].pose.distance_to(pose) < 0.02


def test_the_error_of_the_map_widens_the_covariance():
    """A marker's position is off by 10 cm, so the pose is at least as uncertain."""
    generator = np.random.default_rng(3)
    pose = facing(1.2, 0.5, 0.0)
    image = rendered(pose, [WALL_MARKER], CAMERA, generator)
    surveyed = replace(WALL_MARKER, position_deviation=0.1)
    sharp = MarkerDetector([WALL_MARKER]).fix(image).candidates[0]
    wide = MarkerDetector([surveyed]).fix(image).candidates[0]
    added = wide.covariance[:2, :2] - sharp.covariance[:2, :2]
    assert np.linalg.eigvalsh(added) == pytest.approx([0.01, 0.01], rel=0.05)


def test_turning_the_marker_is_driving_round_it():
    """0.1 rad at 1.2 m are 12 cm across the line of sight, and nothing along it."""
    generator = np.random.default_rng(4)
    pose = facing(1.2, 0.0, 0.0)
    image = rendered(pose, [WALL_MARKER], CAMERA, generator)
    sharp = MarkerDetector([WALL_MARKER]).fix(image).candidates[0]
    wide = MarkerDetector([replace(WALL_MARKER, heading_deviation=0.1)]).fix(image).candidates[0]
    added = wide.covariance - sharp.covariance
    assert np.sqrt(added[1, 1]) == pytest.approx(0.12, rel=0.1)
    assert np.sqrt(added[2, 2]) == pytest.approx(0.1, rel=0.1)
    assert added[0, 0] < 1e-3


def test_an_ambiguous_marker_far_away_has_two_candidates_with_shares():
    generator = np.random.default_rng(5)
    counts = []
    for bearing in (-0.6, -0.45, 0.45, 0.6):
        image = rendered(facing(2.4, bearing, 0.0), [WALL_MARKER], CAMERA, generator)
        fix = MarkerDetector([WALL_MARKER]).fix(image)
        counts.append(len(fix.candidates))
        assert sum(one.share for one in fix.candidates) == pytest.approx(1.0)
        assert fix.candidates[0].share >= fix.candidates[-1].share
    assert 2 in counts


def test_a_frontal_marker_far_away_has_one_wide_candidate():
    """Stairs of a pixel at 2.5 m: turned by some degrees, so up to 40 cm aside; all contained."""
    generator = np.random.default_rng(7)
    for bearing in (-0.1, 0.0, 0.05, 0.1):
        pose = facing(2.5, bearing, 0.0)
        image = rendered(pose, [WALL_MARKER], CAMERA, generator, aliased=True)
        (one,) = MarkerDetector([WALL_MARKER]).fix(image).candidates
        off = offset(one.pose, pose)
        assert off @ np.linalg.solve(one.covariance, off) <= CHI_SQUARE
        across, along = np.sqrt(one.covariance[1, 1]), np.sqrt(one.covariance[0, 0])
        assert 0.2 < across < 0.8 and along < 0.15


def test_markers_beyond_the_farthest_distance_give_no_pose():
    image = rendered(facing(1.5, 0.3, 0.0), [WALL_MARKER], CAMERA, np.random.default_rng(6))
    assert MarkerDetector([WALL_MARKER], MarkerParameters(farthest=1.0)).fix(image) is None
    assert MarkerDetector([WALL_MARKER], MarkerParameters(farthest=2.0)).fix(image) is not None
