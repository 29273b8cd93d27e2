"""Poses of markers relative to the base: exact corners, both solutions, errors in pictures."""

from math import degrees, pi

import numpy as np
import pytest

from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.relative_pose import relative_poses
from stack.perception.markers.stage import observed_marker
from stack.types import CameraModel, Pose2D, RelativePose, wrap_angle
from tests.stack.perception.markers.marker_pictures import (
    CAMERA,
    WALL_MARKER,
    facing,
    rendered,
    seen_corners,
)

CHI_SQUARE = 7.815
"""95 % quantile with three degrees of freedom."""

LEVEL = CameraModel(CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.position)


def truth(base: Pose2D) -> Pose2D:
    """The marker's pose relative to the base."""
    x, y, _ = WALL_MARKER.position
    return Pose2D(x, y, WALL_MARKER.heading).relative_to(base)


def squared_error(found: RelativePose, right: Pose2D) -> float:
    """In deviations."""
    turned = wrap_angle(found.pose.heading - right.heading)
    off = np.array([found.pose.x - right.x, found.pose.y - right.y, turned])
    return float(off @ np.linalg.solve(found.covariance, off))


@pytest.mark.parametrize("distance", [0.4, 0.8, 1.6])
@pytest.mark.parametrize("bearing", [0.5, -0.9])
def test_exact_corners_give_the_exact_pose(distance, bearing):
    """Within a tenth of the deviations, which the curve of the likelihood leaves."""
    base = facing(distance, bearing, 0.1)
    seen = relative_poses(0.2, CAMERA, seen_corners(base, WALL_MARKER, CAMERA), MarkerParameters())
    assert seen is not None
    height, candidates = seen
    assert height == pytest.approx(WALL_MARKER.position[2], abs=0.005)
    assert min(squared_error(one, truth(base)) for one in candidates) < 0.5
    assert sum(one.share for one in candidates) == pytest.approx(1.0)


def test_a_frontal_view_knows_the_direction_but_hardly_the_heading():
    """At 2 m from the front both solutions are one; seen obliquely they are apart."""
    front = relative_poses(
        0.2, CAMERA, seen_corners(facing(2.0, 0.0, 0.0), WALL_MARKER, CAMERA), MarkerParameters()
    )
    side = relative_poses(
        0.2, CAMERA, seen_corners(facing(1.0, 0.8, 0.0), WALL_MARKER, CAMERA), MarkerParameters()
    )
    assert front is not None and side is not None
    (one,) = front[1]
    across, heading = np.sqrt(one.covariance[1, 1]), degrees(np.sqrt(one.covariance[2, 2]))
    assert across < 0.02 and 5.0 < heading < 15.0
    assert degrees(np.sqrt(side[1][0].covariance[2, 2])) < 1.5


def test_both_solutions_of_an_ambiguous_view_are_candidates():
    """2.8 m away and 40 degrees off its normal, the mirrored pose lies 80 degrees off."""
    generator, doubles = np.random.default_rng(3), 0
    for _ in range(20):
        base = facing(2.8, 0.7, 0.0)
        corners = seen_corners(base, WALL_MARKER, CAMERA) + generator.normal(0.0, 0.4, (4, 2))
        seen = relative_poses(0.2, CAMERA, corners, MarkerParameters())
        assert seen is not None
        if len(seen[1]) == 2:
            doubles += 1
            one, other = (candidate.pose.heading for candidate in seen[1])
            assert 50.0 < degrees(abs(wrap_angle(one - other))) < 110.0
        assert min(squared_error(one, truth(base)) for one in seen[1]) < 30.0
    assert doubles >= 5


@pytest.mark.parametrize("distance", [1.5, 2.5])
def test_the_ellipsoids_of_frontal_views_contain_the_truth(distance):
    """Pictures with stairs of a pixel, as the simulation draws them: 95 %, of 40 at least 36."""
    generator, contained = np.random.default_rng(int(10 * distance)), 0
    for _ in range(40):
        base = facing(
            distance + generator.uniform(-0.1, 0.1), generator.uniform(-0.09, 0.09),
            generator.uniform(-0.26, 0.26),
        )  # fmt: skip
        image = rendered(base, [WALL_MARKER], LEVEL, generator, aliased=True)
        (found,) = MarkerDetector([], None, [WALL_MARKER.dictionary]).detections(image)
        seen = observed_marker(found, image, MarkerParameters())
        assert seen is not None and (seen.number, seen.stamp) == (7, 1.5)
        errors = [squared_error(one, truth(base)) for one in seen.candidates]
        contained += min(errors) <= CHI_SQUARE
    assert contained >= 36


def test_corners_of_no_upright_square_give_nothing():
    corners = seen_corners(facing(1.5, 0.0, 0.0), WALL_MARKER, CAMERA)
    askew = (corners - corners.mean(axis=0)) @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    assert relative_poses(0.2, CAMERA, askew + corners.mean(axis=0), MarkerParameters()) is None
    assert abs(truth(facing(1.5, 0.0, 0.0)).heading) == pytest.approx(pi)
