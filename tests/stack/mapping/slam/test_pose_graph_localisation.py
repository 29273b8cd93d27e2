"""Localisation in a saved pose graph: given and unknown start, rivals, kidnapping, files."""

import numpy as np
import pytest

from stack.errors import InputError
from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.pose_graph_localiser import PoseGraphLocaliser
from stack.types import Pose2D, has_jumped
from tests.stack.mapping.slam.drives import EstimatorDrive, line, mapped, saved
from tests.stack.mapping.slam.rooms import ROOM, box

LOOP = line((1, 1), (7, 1), (7, 3), (4, 3), (4, 5), (1, 5), (1, 1))


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    mapper = mapped(ROOM, LOOP)
    return mapper, saved(mapper, tmp_path_factory.mktemp("maps") / "room")


@pytest.fixture
def drive(room):
    drives = []

    def start(pose, kind=PoseGraphLocaliser):
        drives.append(EstimatorDrive(*room, pose, kind))
        return drives[-1]

    yield start
    for one in drives:
        one.estimator.close()


def test_it_follows_a_given_start_and_the_graph_stays_as_it_is(room, drive):
    one = drive(Pose2D(1.15, 1.1, 0.05))
    estimate = one.run(ROOM, line((1, 1), (4, 1), (6.8, 1.2), (6.5, 3)))
    # the noise of a range is 1 cm, a cell 5 cm: the keyframes themselves are within 1 cm
    assert max(one.errors[3:]) < 0.03
    assert estimate.health > estimate.thresholds.good and not estimate.ambiguous
    assert len(one.estimator.mapper.graph.keyframes) == len(room[0].graph.keyframes)
    assert one.estimator.take_map() is None


def test_it_finds_an_unknown_start_with_the_first_scan(drive):
    one = drive(None)
    assert one.estimator.estimate.health == 0.0 and one.estimator.estimate.is_lost
    estimate = one.run(ROOM, line((4, 4.5), (4, 3), (6, 3)))
    assert max(one.errors) < 0.1 and one.errors[-1] < 0.03
    assert estimate.is_good


def test_after_a_kidnap_it_is_lost_and_then_finds_the_place(drive):
    one = drive(Pose2D(1, 1))
    one.run(ROOM, line((1, 1), (2, 1)))
    before, carried = one.estimator.estimate, Pose2D(30.0, -7.0, 1.0).compose(Pose2D(2, 1))
    there = line((7, 5.2), (7, 2.0), (7, 5.2), step=0.05)
    lost = []
    for pose in there:  # odometry continues from (2, 1)
        estimate = one.step(ROOM, pose, carried.compose(pose.relative_to(there[0])))
        lost.append(estimate.is_lost)
    assert any(lost[:15]) and not lost[-1]
    assert estimate.pose.distance_to(there[-1]) < 0.05 and has_jumped(before, estimate)


def test_equal_rooms_are_rivals_until_a_scan_tells_them_apart(tmp_path):
    # two rooms of 4 x 4 m, one above the other; a niche in the second one's far corner
    walls = np.array([
        *box(0, 0, 4, 4), *box(1, 1.4, 0.4, 0.3), *box(0, 6, 4, 4), *box(1, 7.4, 0.4, 0.3),
        *box(3.7, 9.0, 0.3, 0.4),
    ])  # fmt: skip
    both = mapped(walls, line((0.6, 0.6), (3.3, 0.6), (3.3, 3.3), (0.6, 3.3)))
    lower = len(both.graph.keyframes)
    above = line((0.6, 6.6), (3.3, 6.6), (3.3, 9.3), (0.6, 9.3))
    both.set_pose(above[0], above[0])
    mapped(walls, above, both)
    assert len(both.graph.keyframes) > lower
    drive = EstimatorDrive(both, saved(both, tmp_path / "twins"), None)
    try:
        # behind the block the niche is out of sight
        hidden = Pose2D(0.5, 7.0, 1.0)
        estimate = drive.run(walls, [hidden])
        assert estimate.ambiguous and len(estimate.rivals) == 1
        estimate = drive.run(walls, line((0.5, 7.0), (0.5, 9.0), (2.5, 9.0), (0.5, 9.0)))
        assert not estimate.ambiguous and drive.errors[-1] < 0.05
    finally:
        drive.estimator.close()


def test_slam_continues_the_saved_graph_as_a_new_session(room, drive):
    one = drive(Pose2D(1, 1, 1.5), SlamEstimator)
    before = len(room[0].graph.keyframes)
    way = line((1, 1), (1, 3), (3.4, 3), (5, 2.2))
    estimate = one.run(ROOM, way)
    graph = one.estimator.mapper.graph
    new = [k for k in graph.keyframes.values() if k.session == 1]
    assert len(new) > 5 and len(graph.keyframes) > before
    joining = {
        edge.kind for edge in graph.edges
        if graph.keyframes[edge.source].session != graph.keyframes[edge.target].session
    }  # fmt: skip
    assert "loop" in joining and "odometry" not in joining
    assert estimate.pose.distance_to(way[-1]) < 0.03
    assert one.estimator.take_map() is not None


def test_the_mode_changes_in_a_run(drive):
    one = drive(Pose2D(1, 1))
    one.run(ROOM, line((1, 1), (2, 1)))
    count = len(one.estimator.mapper.graph.keyframes)
    one.estimator.set_mapping(True)
    one.run(ROOM, line((2, 1), (4, 1), (5, 2.2), (4, 1)))
    grown = len(one.estimator.mapper.graph.keyframes)
    assert grown > count
    one.estimator.set_mapping(False)
    one.run(ROOM, line((4, 1), (6, 1)))
    assert len(one.estimator.mapper.graph.keyframes) == grown
    assert max(one.errors) < 0.03 and one.estimator.estimate.is_good


def test_a_map_without_a_pose_graph_is_refused(tmp_path):
    with pytest.raises(InputError, match="use `localisation: mcl`"):
        PoseGraphLocaliser.check_map(tmp_path)
    with pytest.raises(InputError, match="needs a map that was saved"):
        PoseGraphLocaliser.check_map(None)
    SlamEstimator.check_map(None)
