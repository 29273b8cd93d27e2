"""Progress on a path and the pieces it is cut into, by hand."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from stack.geometry import kernels
from stack.geometry.path_progress import PathProgress, split_at_cusps
from stack.geometry.path_segment import PathSegment
from stack.types import Path, Pose2D
from tests.stack.control.test_pure_pursuit import polyline

CORNER = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
LENGTHS = np.array([0.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("place", "first", "until", "expected"),
    [
        ((0.5, 0.3), 0, 9.0, (0, 0.5, 0.3)),
        ((1.9, 1.5), 0, 9.0, (1, 3.5, 0.1)),
        ((1.9, 1.5), 0, 1.9, (0, 1.9, 1.5)),  # the second side begins beyond the end of the search
        ((1.4, 0.3), 0, 1.0, (0, 1.0, 0.5)),  # 3-4-5
        ((1.0, -1.0), 1, 9.0, (1, 2.0, 2.0**0.5)),  # what lies behind does not count
        ((-3.0, 4.0), 0, 1.0, (0, 0.0, 5.0)),
    ],
)
def test_the_nearest_place_of_a_polyline(place, first, until, expected):
    assert kernels.project(CORNER, LENGTHS, *place, first, until) == pytest.approx(expected)


def test_a_point_that_a_path_holds_twice_does_not_hide_the_rest():
    twice = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    lengths = np.array([0.0, 1.0, 1.0, 2.0])
    assert kernels.project(twice, lengths, 1.6, 0.2, 0, 9.0) == pytest.approx((2, 1.6, 0.2))


@pytest.mark.parametrize(
    ("place", "length", "distance", "expected"),
    [
        ((0.5, 0.0), 0.5, 1.0, 1.5),
        ((0.5, 0.3), 0.5, 0.5, 0.9),  # 3-4-5
        ((1.5, 0.0), 1.5, 1.0, 2.0 + 0.75**0.5),  # round the corner
        ((2.0, 1.0), 3.0, 0.5, 3.5),
        ((0.0, 2.0), 0.5, 1.0, 1.5),  # farther than that already
        ((2.0, 2.0), 3.5, 3.0, 4.0),  # nothing is that far away
    ],
)
def test_the_first_place_ahead_at_a_distance(place, length, distance, expected):
    found = kernels.length_at_distance(CORNER, LENGTHS, *place, length, distance)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize(
    ("travelled", "distance", "expected"),
    [
        (0.0, 0.7, [0.0, 0.3, 0.6]),
        (0.0, 9.0, [0.0, 0.3, 0.6, 0.9, 1.0]),
        (0.5, 9.0, [0.5, 0.8, 1.0]),
        (0.1, 9.0, [0.1, 0.4, 0.7, 1.0]),
        (0.08, 9.0, [0.08, 0.38, 0.68, 0.98]),  # the goal is nearer to the last than 0.2 · 0.3
        (2.0, 9.0, [1.0]),
    ],
)
def test_samples_of_a_path_end_with_its_goal(travelled, distance, expected):
    track = PathSegment(polyline((0, 0), (1, 0)))
    track.travelled = travelled
    assert track.sampled(distance, 0.3)[:, 0] == pytest.approx(expected)


def test_samples_may_go_on_beyond_the_goal():
    track = PathSegment(polyline((0, 0), (1, 0)))
    track.travelled = 0.5
    assert track.sampled(1.0, 0.25, beyond=True)[:, 0] == pytest.approx([0.5, 0.75, 1.0, 1.25, 1.5])


def arc(turn, radius=1.0, last=None):
    """A path from the origin along x, then round to the left."""
    angles = np.linspace(0.0, turn, 41)
    points = np.column_stack([radius * np.sin(angles), radius * (1.0 - np.cos(angles)), angles])
    points[-1, 2] = turn if last is None else last
    return Path(points)


def test_beyond_its_end_a_cars_path_goes_on_in_its_arc():
    track = PathSegment(arc(pi / 2), steered=True)
    assert track.arrival.heading == pytest.approx(pi / 2, abs=1e-9)
    # An eighth of a circle of 1 m farther, at 135 degrees of it.
    beyond = track.sampled(track.length + pi / 4, track.length + pi / 4, beyond=True)[-1]
    assert beyond == pytest.approx([sqrt(0.5), 1.0 + sqrt(0.5)], abs=2e-3)


def test_the_arc_ends_after_a_quarter_of_a_circle():
    track = PathSegment(arc(pi / 2, radius=0.4), steered=True)
    # The half circle ends at (0, 0.8), 0.2 pi m beyond the path, in direction -x.
    length = track.length + 0.2 * pi + 0.5
    assert track.sampled(length, length, beyond=True)[-1] == pytest.approx([-0.5, 0.8], abs=0.02)


def test_a_last_heading_beside_the_arc_makes_the_extension_straight():
    track = PathSegment(arc(pi / 2, last=pi / 2 - 0.5), steered=True)
    beyond = track.sampled(track.length + 1.0, track.length + 1.0, beyond=True)[-1]
    assert beyond == pytest.approx([1.0 + sin(0.5), 1.0 + cos(0.5)], abs=2e-3)


def test_a_robot_that_is_no_car_goes_on_straight():
    track = PathSegment(arc(pi / 2))
    x, y = track.sampled(track.length + 1.0, track.length + 1.0, beyond=True)[-1]
    # The chord of the last 0.15 m to 0.2 m of the arc lies 0.075 to 0.1 rad behind its tangent.
    assert (x, y) == pytest.approx([1.0 + sin(0.0875), 1.0 + cos(0.0875)], abs=0.02)


def test_a_heading_that_does_not_belong_to_the_path_is_left_to_the_robot():
    """The chord of the last 0.15 m of a circle of 1 m lies about 0.075 rad behind its tangent."""
    track = PathSegment(arc(pi / 2, last=-pi / 2), steered=True)
    assert track.arrival.heading == pytest.approx(pi / 2 - 0.075, abs=0.025)
    assert PathSegment(arc(pi / 2, last=-pi / 2)).arrival.heading == -pi / 2


def test_a_path_of_one_place_goes_on_as_its_goal_looks():
    track = PathSegment(Path(np.array([[1.0, 2.0, 0.5], [1.0, 2.0, 0.5]])))
    assert track.sampled(1.0, 1.0, beyond=True)[-1] == pytest.approx(
        [1.0 + cos(0.5), 2.0 + sin(0.5)]
    )


def test_a_path_is_cut_where_its_direction_changes():
    """0.4 m ahead, 0.2 m back, 0.3 m ahead, in steps of 0.1 m and all the time along x."""
    xs = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.3, 0.2, 0.3, 0.4, 0.5])
    path = Path(np.column_stack([xs, 0.0 * xs, 0.0 * xs]))
    legs = split_at_cusps(path)
    assert [leg.backward for leg in legs] == [False, True, False]
    ends = [(leg.path.points[0, 0], leg.path.points[-1, 0]) for leg in legs]
    assert ends == [(0.0, 0.4), (0.4, 0.2), (0.2, 0.5)]
    assert [leg.path.length for leg in legs] == pytest.approx([0.4, 0.2, 0.3])


def test_a_path_without_a_step_is_one_leg_ahead():
    (leg,) = split_at_cusps(Path(np.array([[1.0, 2.0, 0.5], [1.0, 2.0, 0.9]])))
    assert not leg.backward


def test_progress_never_shrinks_and_waits_at_a_cusp():
    xs = np.concatenate([np.arange(0.0, 1.01, 0.1), np.arange(0.9, -0.01, -0.1)])
    track = PathProgress(Path(np.column_stack([xs, 0.0 * xs, 0.0 * xs])))
    for x, travelled in ((0.5, 0.5), (0.4, 0.5), (0.8, 0.8), (0.95, 0.95), (0.7, 0.95), (1.1, 1.0)):
        track.advance(Pose2D(x, 0.0))
        assert track.travelled == pytest.approx(travelled)
    assert track.remaining == pytest.approx(1.0)
    track.begin_next(Pose2D(0.97, 0.0))
    assert track.travelled == pytest.approx(1.03)
    track.advance(Pose2D(0.7, 0.0))
    assert track.travelled == pytest.approx(1.3)
    assert track.remaining == pytest.approx(0.7)
    assert track.ahead(0.25)[:, 0] == pytest.approx([0.7, 0.6, 0.5, 0.4], abs=0.11)


def test_a_backward_segment_is_driven_by_a_robot_that_faces_backward():
    xs = np.arange(1.0, -0.01, -0.1)
    (backward, forward) = (
        PathProgress(Path(np.column_stack([xs, 0.0 * xs, 0.0 * xs])), directional=directional)
        for directional in (True, False)
    )
    assert backward.segment.backward and not forward.segment.backward
    assert backward.segment.path.goal.heading == pytest.approx(pi)
    assert forward.segment.path.goal.heading == 0.0
    assert backward.path is not backward.segment.path and backward.path.goal.heading == 0.0


def test_the_rest_of_a_path_begins_at_the_robot():
    points = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
    progress = PathProgress(Path(points, speed_limits=np.arange(5.0)))
    assert np.array_equal(progress.rest.points, points)
    progress.advance(Pose2D(1.5, 0.2))
    assert np.array_equal(progress.rest.points, points[2:])
    assert np.array_equal(progress.rest.speed_limits, [2.0, 3.0, 4.0])
    for x in (2.5, 3.5, 4.5):
        progress.advance(Pose2D(x, 0.0))
    assert len(progress.rest.points) == 2  # a path has two points or more
