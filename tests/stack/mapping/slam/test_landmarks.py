"""Markers as landmarks: a bare loop that only a marker closes, false markers, ambiguous views."""

from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.mapping.slam import landmarks
from stack.mapping.slam.graph import Edge, Keyframe, Landmark, PoseGraph, Sighting
from stack.mapping.slam.landmarks import (
    FIRST_NODE,
    landmark_edges,
    markers_of,
    problem_of,
    solve,
)
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import MapperParameters
from stack.types import Marker, Pose2D, RelativePose, wrap_angle
from tests.stack.mapping.slam.drives import line
from tests.stack.mapping.slam.marker_drives import MarkerDrive
from tests.stack.mapping.slam.rooms import ROOM, box, scan_at

BARE_RING = np.array([*box(0.0, 0.0, 14.0, 10.0), *box(2.0, 2.0, 10.0, 6.0)])
"""A corridor around a block, with nothing on its walls. Scans of 3 m see no corner from (5, 1)."""

SHORT = MapperParameters(match_range=3.0)
ROUND = line((5, 1), (13, 1), (13, 9), (1, 9), (1, 1), (7, 1), step=0.125)
ON_WALL = Marker(7, 0.2, (8.0, 0.02, 0.4), pi / 2)
ELSEWHERE = Marker(7, 0.2, (9.0, 9.98, 0.4), -pi / 2)


def driven(markers: list[Marker]) -> MarkerDrive:
    drive = MarkerDrive(Mapper(SHORT), BARE_RING, markers)
    drive.run(ROUND)
    return drive


@pytest.fixture(scope="module")
def with_marker() -> MarkerDrive:
    return driven([ON_WALL])


def test_a_marker_closes_a_loop_that_scans_cannot(with_marker):
    """5 % of the 10 m east that nothing corrects: 0.5 m."""
    without = driven([])
    assert without.mapper.loop_closures == 0 and without.errors[-1] > 0.3
    assert with_marker.mapper.loop_closures >= 1
    assert with_marker.errors[-1] < 0.1


def test_the_saved_marker_is_right_within_its_deviations(with_marker):
    mapper = with_marker.mapper
    (found,) = markers_of(mapper.graph, solve(mapper.problem()))
    assert (found.number, found.size) == (7, 0.2)
    away = hypot(found.position[0] - 8.0, found.position[1] - 0.02)
    turned = abs(wrap_angle(found.heading - pi / 2))
    assert found.position[2] == pytest.approx(0.4, abs=0.01)
    assert away < 3.0 * found.position_deviation and turned < 3.0 * found.heading_deviation
    assert found.position_deviation < 0.1 and found.heading_deviation < 0.06


def test_a_second_marker_with_the_same_number_moves_nothing():
    """It is 8 m from the first one, on the way: a loop between the two would be false."""
    drive = driven([ON_WALL, ELSEWHERE])
    assert max(drive.errors[:340]) < 0.4  # as without markers: 5 % of 8 m
    assert drive.errors[-1] < 0.12
    (found,) = markers_of(drive.mapper.graph, solve(drive.mapper.problem()))
    assert hypot(found.position[0] - 8.0, found.position[1] - 0.02) < 0.15


def sighting(*poses: tuple[Pose2D, float], heading: float = 0.05) -> Sighting:
    """Possible poses of a marker with their shares."""
    covariance = np.diag(np.square([0.02, 0.02, heading]))
    return Sighting(tuple(RelativePose(pose, covariance, share) for pose, share in poses), 0.4)


def row_of_keyframes(count: int, spacing: float = 0.3) -> PoseGraph:
    """Keyframes along the x axis, with exact edges."""
    graph, scan = PoseGraph(), scan_at(ROOM, Pose2D(1.0, 1.0))
    for n in range(count):
        pose = Pose2D(spacing * n, 0.0)
        graph.add_keyframe(Keyframe(n, float(n), pose, pose, scan))
        if n:
            edge = Edge(n - 1, n, Pose2D(spacing, 0.0), np.diag([1e4, 1e4, 1e5]), "match")
            graph.add_edge(edge)
    return graph


RIGHT = Pose2D(2.0, 1.0, -2.5)
"""A marker in the map frame."""


def with_sightings(graph: PoseGraph, mirrored: list[float], share: float) -> Landmark:
    """Sightings from each keyframe of the right pose, and of one turned by the angles given."""
    for number, (keyframe, angle) in enumerate(
        zip(graph.keyframes.values(), mirrored, strict=True)
    ):
        seen = RIGHT.relative_to(keyframe.pose)
        other = Pose2D(seen.x, seen.y, seen.heading + angle)
        both = sighting((other, 1.0 - share), (seen, share))
        graph.add_sighting(("DICT_4X4_50", 1), 0.2, number, both)
    return graph.landmarks["DICT_4X4_50", 1]


def test_views_from_several_places_decide_between_two_solutions():
    """The mirrored solution is the more probable one in each view, and elsewhere in each."""
    graph = row_of_keyframes(4)
    landmark = with_sightings(graph, [0.5, 0.8, 1.1, 1.4], 0.3)
    poses = {number: keyframe.pose for number, keyframe in graph.keyframes.items()}
    for edge in landmark_edges(landmark, FIRST_NODE, poses):
        placed = graph.keyframes[edge.source].pose.compose(edge.relative)
        assert placed.distance_to(RIGHT) < 1e-9
        assert abs(wrap_angle(placed.heading - RIGHT.heading)) < 1e-9
    (found,) = markers_of(graph, solve(problem_of(graph)))
    assert abs(wrap_angle(found.heading - RIGHT.heading)) < 0.01


def test_an_ambiguous_visit_places_the_marker_and_leaves_its_heading_open():
    """Two solutions 0.6 rad apart fit all views alike: their mean, with half of that as deviation.

    Four views from one direction count as two: 0.3 / √2 = 0.21 rad.
    """
    graph = row_of_keyframes(4, spacing=0.02)
    with_sightings(graph, [0.6] * 4, 0.5)
    (found,) = markers_of(graph, solve(problem_of(graph)))
    assert abs(wrap_angle(found.heading - RIGHT.heading - 0.3)) < 0.02
    assert found.heading_deviation == pytest.approx(0.3 / 2**0.5, abs=0.03)
    assert hypot(found.position[0] - RIGHT.x, found.position[1] - RIGHT.y) < 0.01


def test_a_landmark_needs_views_from_several_keyframes(monkeypatch):
    graph = row_of_keyframes(3)
    with_sightings(graph, [0.5, 0.8, 1.1], 0.5)
    assert len(markers_of(graph, solve(problem_of(graph)))) == 1
    monkeypatch.setattr(landmarks, "MARKER_VIEWS", 4)
    assert markers_of(graph, solve(problem_of(graph))) == ()


def test_the_better_sighting_of_a_keyframe_is_kept():
    graph = row_of_keyframes(1)
    near, far = sighting((RIGHT, 1.0)), sighting((Pose2D(9.0, 9.0), 1.0))
    far = Sighting((replace(far.candidates[0], covariance=np.eye(3)),), 0.4)
    assert graph.add_sighting(("DICT_4X4_50", 1), 0.2, 0, far)
    assert graph.add_sighting(("DICT_4X4_50", 1), 0.2, 0, near)
    assert not graph.add_sighting(("DICT_4X4_50", 1), 0.2, 0, far)
    assert graph.landmarks["DICT_4X4_50", 1].sightings == {0: near}
    with pytest.raises(ParameterError, match="there is no keyframe 5"):
        graph.add_sighting(("DICT_4X4_50", 1), 0.2, 5, near)


def test_the_sightings_of_a_removed_keyframe_move_to_its_neighbour():
    """0.3 m back, with the errors of the edge: 1 cm, and 1 / √1e5 rad over the lever."""
    graph = row_of_keyframes(3)
    seen = RIGHT.relative_to(graph.keyframes[1].pose)
    graph.add_sighting(("DICT_4X4_50", 1), 0.2, 1, sighting((seen, 1.0)))
    graph.remove_keyframe(1)
    ((number, moved),) = graph.landmarks["DICT_4X4_50", 1].sightings.items()
    placed = graph.keyframes[number].pose.compose(moved.candidates[0].pose)
    assert placed.distance_to(RIGHT) < 1e-9
    lever = hypot(seen.x, seen.y) / 1e5**0.5
    expected = 2 * 0.02**2 + 2 * 0.01**2 + lever**2
    assert moved.variance == pytest.approx(expected, rel=1e-6)
