"""Paths that turn back, pass near themselves or cross themselves are driven from end to end."""

from itertools import pairwise
from math import acos, cos, degrees, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.geometry.path_progress import (
    LEAST_PART,
    TIGHT,
    TURNS_BACK,
    PathProgress,
    split_at_cusps,
    split_at_turns,
)
from stack.geometry.path_segment import REACH, PathSegment
from stack.parameters.poses import read_path
from stack.types import Path, Pose2D, TaskStatus
from tests.stack.control.courses import toy_drive
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import room

CONTROLLERS = ("pure_pursuit", "dwb", "graceful", "mppi")
SMALLER = {"mppi": {"batch": 300}}


def bend(angle, first=2.0, second=1.5):
    """Three positions with a bend in the middle, radians to the left."""
    x = 2.0 + first
    return [(2.0, 3.0), (x, 3.0), (x + second * cos(angle), 3.0 + second * sin(angle))]


def lanes(apart, length=2.0, count=3):
    """Parallel lanes in turn, there and back."""
    ends = [(2.0, 2.0 + length), (2.0 + length, 2.0)]
    return [(x, 2.0 + apart * n) for n in range(count) for x in ends[n % 2]]


def eight():
    turns = np.linspace(0.0, 2.0 * pi, 60)
    return [(4.0 + 2.0 * sin(turn), 4.0 + sin(2.0 * turn)) for turn in turns]


STAR = [(4 + 1.5 * cos(a), 4 + 1.5 * sin(a)) for a in np.arange(6) * radians(144) + pi / 2]
SQUARE = [(3.0, 3.0), (4.0, 3.0), (4.0, 4.0), (3.0, 4.0), (3.0, 3.0)]
SHAPES = {
    "there and back": [(2.0, 3.0), (5.0, 3.0), (3.5, 3.0)],
    "points on both legs": [(2, 3), (3, 3), (5, 3), (4, 3), (3, 3)],
    "zigzag": [(2.0, 3.0), (3.0, 3.0), (2.1, 3.3), (3.1, 3.6), (2.2, 3.9)],
    "to and fro": [(3.0, 3.0), (3.4, 3.0), (3.0, 3.0), (3.4, 3.0), (3.0, 3.0)],
    "a position twice": [(2.0, 3.0), (4.0, 3.0), (4.0, 3.0), (2.2, 3.5)],
    "star": STAR,
    "eight": eight(),
    "square": SQUARE,
    "laps": SQUARE + SQUARE[1:],
    "lanes 0.1 m apart": lanes(0.1),
    "lanes 0.3 m apart": lanes(0.3),
    "lanes 0.5 m apart": lanes(0.5),
}


def length_of(places):
    return sum(hypot(bx - ax, by - ay) for (ax, ay), (bx, by) in pairwise(places))


def driven(name, places, kind="differential"):
    """Follow positions; the drive, the metres driven and the nearest distance to each position."""
    path = read_path([list(place) for place in places])
    toy = toy_drive(name, room(9, 8), Pose2D(*path.points[0]), kind=kind, **SMALLER.get(name, {}))
    task, trace = toy.navigator.base.follow_path(path), []
    while task.running and toy.world.time < 20.0 + 5.0 * length_of(places):
        toy.step()
        trace.append((toy.world.pose.x, toy.world.pose.y))
    toy.navigator.close()
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    away = np.hypot(*(np.array(trace)[:, None] - np.array(places)).transpose(2, 0, 1))
    return toy, float(np.hypot(*np.diff(trace, axis=0).T).sum()), away.min(axis=0)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_path_is_driven_to_its_end_and_past_every_position(shape):
    places = SHAPES[shape]
    _, metres, nearest = driven("pure_pursuit", places)
    assert nearest.max() < 0.25  # as much as pure pursuit cuts a right-angled corner
    assert 0.85 * length_of(places) - 0.2 < metres < 1.1 * length_of(places) + 0.2


@pytest.mark.parametrize("name", CONTROLLERS[1:])
def test_every_controller_follows_lanes_there_and_back(name):
    places = lanes(0.3, length=1.5)
    _, metres, nearest = driven(name, places)
    assert nearest.max() < 0.25
    assert 0.85 * length_of(places) - 0.2 < metres < 1.1 * length_of(places) + 0.2


@pytest.mark.parametrize("name", ["pure_pursuit", "mppi"])
def test_an_omnidirectional_robot_follows_them_too(name):
    places = SHAPES["there and back"]
    _, metres, nearest = driven(name, places, kind="omni")
    assert nearest.max() < 0.1
    assert metres == pytest.approx(length_of(places), abs=0.3)


@pytest.mark.parametrize("angle", range(0, 181, 15))
def test_both_legs_of_any_bend_are_driven_forward(angle):
    toy, _, nearest = driven("pure_pursuit", bend(radians(angle)))
    assert nearest[1] < 0.4  # cut more, the sharper it is, up to the bend where it stops
    assert min(twist.linear for twist in toy.commands) > -0.05


def test_a_wide_u_turn_does_not_fail():
    """Samples of the far lane once drew the robot off its own, where it stood."""
    driven("dwb", lanes(0.6))


@pytest.mark.parametrize("name", CONTROLLERS)
def test_via_goals_that_lie_beyond_the_last_one_are_reached(name):
    toy = toy_drive(name, room(6, 4), Pose2D(1.0, 2.0), **SMALLER.get(name, {}))
    goals = [Pose2D(4.0, 2.0), Pose2D(2.5, 2.0)]
    task, furthest = toy.navigator.base.navigate_through(goals), 0.0
    while task.running and toy.world.time < 60.0:
        toy.step()
        furthest = max(furthest, toy.world.pose.x)
    toy.navigator.close()
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert furthest > 4.0 - 0.4  # via_radius
    assert toy.world.pose.distance_to(goals[-1]) < 0.15


def test_a_round_trip_is_driven_although_it_ends_where_it_begins():
    start = Pose2D(2.0, 2.0)
    toy = toy_drive("graceful", room(8, 6), start)
    vias = [Pose2D(5.0, 2.0), Pose2D(5.0, 4.0), Pose2D(5.0, 4.0), Pose2D(2.0, 4.0)]
    task = toy.navigator.base.navigate_through([start, *vias, start])
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    toy.navigator.close()
    assert toy.world.time > 8.0  # 10 m less four times via_radius, at 0.8 m/s
    assert toy.world.pose.distance_to(start) < 0.15


def turn_at(points, index, span):
    """Angle between the chords before and after a point of a polyline, degrees."""
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    a, b, c = (
        np.array([np.interp(lengths[index] + shift, lengths, axis) for axis in points.T])
        for shift in (-span, 0.0, span)
    )
    cosine = (b - a) @ (c - b) / (np.hypot(*(b - a)) * np.hypot(*(c - b)))
    return degrees(acos(min(1.0, max(-1.0, cosine))))


COORDINATES = st.integers(-40, 40).map(lambda n: 0.1 * n)
POSITIONS = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=2, max_size=10)


@given(POSITIONS, st.booleans())
@settings(deadline=None, max_examples=150)
def test_parts_are_the_path_and_none_has_a_corner_that_turns_back(places, directional):
    path = read_path([list(place) for place in places])
    parts = list(split_at_turns(path, directional=directional))
    for before, after in pairwise(parts):
        assert np.array_equal(before.path.points[-1, :2], after.path.points[0, :2])
    joined = np.vstack([parts[0].path.points[:1]] + [part.path.points[1:] for part in parts])
    assert np.array_equal(joined[:, :2], path.points[:, :2])
    assert not any(part.backward for part in parts)
    for part in parts:
        points = part.path.points[:, :2]
        for index in range(1, len(points) - 1):
            legs = np.hypot(*np.diff(points[index - 1 : index + 2], axis=0).T)
            if legs.min() >= TIGHT:
                assert turn_at(points, index, LEAST_PART) <= degrees(acos(TURNS_BACK)) + 1e-6


@given(POSITIONS, st.sampled_from([0.0, -0.03, 0.03]))
@settings(deadline=None, max_examples=25)
def test_progress_is_made_in_order_and_no_faster_than_the_robot(places, beside):
    """A robot that drives along a path, or a little beside it, is never seen on a later lap."""
    places = [place for n, place in enumerate(places) if n == 0 or place != places[n - 1]]
    path = polyline(*places, spacing=0.1) if len(places) > 1 else read_path([places[0]] * 2)
    progress, was, before = PathProgress(path), path.points[0], 0.0
    for x, y, heading in path.points:
        pose = Pose2D(x - beside * sin(heading), y + beside * cos(heading))
        progress.advance(pose)
        assert 0.0 <= progress.travelled - before <= REACH + pose.distance_to(Pose2D(*was)) + 1e-9
        if not progress.segment.is_last and progress.segment.remaining <= 2.0 * abs(beside) + 1e-6:
            progress.begin_next(pose)
        before, was = progress.travelled, (pose.x, pose.y)
    assert progress.remaining <= 2.0 * abs(beside) + 1e-6


@pytest.mark.parametrize("offset", [(0.0, 0.0), (-0.01, 0.01), (0.02, -0.02)])
def test_a_lap_begins_at_its_beginning(offset):
    lap = read_path([[3, 3], [3.45, 3], [3.45, 3.45], [3, 3.45], [3, 3]])
    progress = PathProgress(lap)
    progress.advance(Pose2D(3.0 + offset[0], 3.0 + offset[1]))
    assert progress.travelled < 0.05


def test_progress_passes_the_corner_of_a_path_of_few_points():
    """The second leg begins farther along the path than the search reaches from its first point."""
    segment = PathSegment(read_path([[0, 0], [5, 0], [5, 5]]))
    for x, y in [(x, 0.0) for x in np.arange(0.0, 4.9, 0.1)] + [(4.9, 0.2), (5.0, 0.4)]:
        segment.advance(Pose2D(float(x), y))
    assert segment.travelled == pytest.approx(5.4)
    assert segment.offset == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("apart", [0.6, 1.0])
def test_the_point_to_steer_to_stays_ahead_before_a_u_turn(apart):
    """0.8 m straight ahead of the robot the path is on its way back."""
    segment = PathSegment(polyline((0, 0), (3, 0), (3, apart), (0, apart)))
    for x in np.arange(0.0, 2.45, 0.1):
        pose = Pose2D(float(x), 0.0)
        segment.advance(pose)
        assert segment.lookahead_point(pose, 0.8)[0] > x + 0.4
        away = segment.sampled(3.0, 0.05)
        assert (
            np.hypot(away[:, 0] - x, away[:, 1]) + 0.05 >= 0.7 * 0.05 * np.arange(len(away))
        ).all()


def test_a_right_angled_corner_is_seen_whole():
    segment = PathSegment(polyline((0, 0), (3, 0), (3, 3)))
    for x in np.arange(0.0, 3.0, 0.1):
        segment.advance(Pose2D(float(x), 0.0))
        assert len(segment.sampled(2.0, 0.1)) == 21


def test_the_last_heading_of_a_part_is_that_in_which_it_ends():
    first, last = split_at_turns(read_path([[0, 0], [2, 0], [1, 0, 1.0]]))
    assert first.path.points[-1] == pytest.approx([2.0, 0.0, 0.0])
    assert last.path.points[0] == pytest.approx([2.0, 0.0, pi])
    assert last.path.goal.heading == 1.0
    first, _ = split_at_turns(read_path([[0, 0, 0.5], [2, 0, 2.0], [1, 0]]), directional=False)
    assert first.path.goal.heading == 0.5


def test_positions_that_jitter_do_not_cut_a_path():
    path = read_path([[0.01 * n, 0.01 * (n % 2)] for n in range(200)])
    assert len(list(split_at_turns(path))) == 1


@given(
    st.lists(st.tuples(st.floats(0.2, 2.0), st.booleans()), min_size=1, max_size=6),
    st.floats(-pi, pi),
    st.tuples(st.floats(-pi, pi), st.floats(-pi, pi)) | st.none(),
)
@settings(deadline=None, max_examples=100)
def test_legs_forward_and_backward_are_told_apart_whatever_the_first_and_last_heading(
    legs, heading, ends
):
    """Straight legs to and fro along one line, which all headings in between show."""
    x, xs = 0.0, [0.0]
    for length, backward in legs:
        steps = np.linspace(0.0, -length if backward else length, 5)[1:]
        xs += (x + steps).tolist()
        x = xs[-1]
    points = np.column_stack([np.array(xs) * cos(heading), np.array(xs) * sin(heading)])
    points = np.column_stack([points, np.full(len(xs), heading)])
    if ends is not None:
        points[0, 2], points[-1, 2] = ends
    found = [part.backward for part in split_at_cusps(Path(points))]
    expected = [legs[0][1]]
    expected += [after for (_, before), (_, after) in pairwise(legs) if after != before]
    assert found == expected
