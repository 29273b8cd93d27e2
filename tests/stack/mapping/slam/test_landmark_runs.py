"""Landmarks of saved maps: continued by the estimator, merged, and left alone by a localiser."""

from math import hypot, pi

import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from stack.mapping.graph_files import read_graph
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import SlamParameters
from stack.mapping.slam.pose_graph_localiser import PoseGraphLocaliser
from stack.types import Marker
from tests.stack.mapping.slam.drives import EstimatorDrive, line, saved
from tests.stack.mapping.slam.marker_drives import MarkerDrive, seen_marker
from tests.stack.mapping.slam.rooms import ROOM
from tests.stack.mapping.slam.test_merging import LEFT, RIGHT, flat

FIRST, SECOND = Marker(1, 0.2, (7.98, 1.0, 0.4), pi), Marker(2, 0.2, (5.0, 5.98, 0.4), -pi / 2)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """The first marker is on the map of the room."""
    drive = MarkerDrive(Mapper(SlamParameters()), ROOM, [FIRST], slip=0.0)
    drive.run(line((4.5, 1), (6.5, 1), (6.5, 3)))
    folder = saved(drive.mapper, tmp_path_factory.mktemp("maps") / "room")
    assert list(read_graph(folder).landmarks) == [("DICT_4X4_50", 1)]
    return drive.mapper, folder


def seen_again(room, kind) -> EstimatorDrive:
    """Drive where both markers are seen."""
    poses = line((5, 1), (6.5, 1), (6.5, 2.8), (5, 2.8), (5, 4.6))
    drive = EstimatorDrive(*room, poses[0], kind)
    for step, pose in enumerate(poses):
        drive.step(ROOM, pose, pose)
        seen = [seen_marker(marker, pose, step, drive.time) for marker in (FIRST, SECOND)]
        observed = [one for one in seen if one is not None]
        drive.estimator.observe_markers(observed, drive.frames)
    return drive


def test_a_saved_graph_is_continued_with_its_landmarks(room):
    drive = seen_again(room, SlamEstimator)
    try:
        drive.estimator.mapper.needs_optimising = True
        found = drive.estimator.mapped_markers()
        assert drive.estimator.mapper.needs_optimising, "saving drops no loop closure"
        assert [marker.number for marker in found] == [1, 2]
        for marker, right in zip(found, (FIRST, SECOND), strict=True):
            away = hypot(*(a - b for a, b in zip(marker.position, right.position, strict=True)))
            assert away < 0.05 and 0.0 < marker.position_deviation < 0.1
    finally:
        drive.estimator.close()


def test_localising_adds_no_landmark(room):
    drive = seen_again(room, PoseGraphLocaliser)
    try:
        assert [marker.number for marker in drive.estimator.mapped_markers()] == [1]
    finally:
        drive.estimator.close()


def test_merged_maps_have_the_markers_of_both(tmp_path):
    """The first one is in the room that both have seen, the second one only on the second map."""
    walls, shared = flat(101), Marker(1, 0.2, (7.98, 0.6, 0.4), pi)
    other = Marker(2, 0.2, (11.98, 2.0, 0.4), pi)
    for name, poses in (("left", LEFT), ("right", RIGHT)):
        drive = MarkerDrive(Mapper(SlamParameters()), walls, [shared, other], slip=0.01)
        drive.run(poses)
        saved(drive.mapper, tmp_path / name)
    left, right = (set(read_graph(tmp_path / name).landmarks) for name in ("left", "right"))
    assert (len(left), len(right)) == (1, 2)
    command = ["map", "merge", *(str(tmp_path / name) for name in ("left", "right", "both"))]
    command.insert(-1, "--out")
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    found = {one.number: one for one in read_marker_map(tmp_path / "both" / MARKERS_YAML)}
    assert set(read_graph(tmp_path / "both").landmarks) == right
    for number, true in ((1, shared), (2, other)):
        position = found[number].position
        assert hypot(*(a - b for a, b in zip(position, true.position, strict=True))) < 0.1
