"""Earlier poses follow the keyframes that the optimiser moves, for surveys of markers."""

from dataclasses import replace

import pytest

from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.pose_graph_localiser import PoseGraphLocaliser
from stack.types import Pose2D
from tests.stack.mapping.slam.drives import EstimatorDrive, line, mapped, saved
from tests.stack.mapping.slam.rooms import ROOM


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    mapper = mapped(ROOM, line((1, 1), (4, 1)))
    return mapper, saved(mapper, tmp_path_factory.mktemp("maps") / "room")


def test_a_pose_moves_with_the_nearest_keyframe_of_this_run(room):
    drive = EstimatorDrive(*room, Pose2D(1, 1, 1.5), SlamEstimator)
    try:
        drive.run(ROOM, line((1, 1), (1, 3), (3.4, 3), (5, 2.2)))
        graph, session = drive.estimator.mapper.graph, drive.estimator.mapper.session
        last = max(
            (one for one in graph.keyframes.values() if one.session == session),
            key=lambda one: one.stamp,
        )
        ahead = last.odometry.compose(Pose2D(0.1, 0.0))
        before = drive.estimator.corrected_pose(last.stamp + 0.2, ahead)
        assert before.distance_to(last.pose.compose(Pose2D(0.1, 0.0))) < 1e-9
        moved = replace(last, pose=Pose2D(last.pose.x, last.pose.y + 0.5, last.pose.heading))
        graph.keyframes[last.id] = moved
        after = drive.estimator.corrected_pose(last.stamp + 0.2, ahead)
        assert after.y - before.y == pytest.approx(0.5)
        assert drive.estimator.corrected_pose(last.stamp + 60.0, ahead) is None
    finally:
        drive.estimator.close()


def test_keyframes_of_other_runs_say_nothing_of_this_one(room):
    """The stamps and the odom frame of a saved graph are those of the run that drew it."""
    drive = EstimatorDrive(*room, Pose2D(1, 1), PoseGraphLocaliser)
    try:
        drive.run(ROOM, line((1, 1), (2, 1)))
        assert drive.estimator.corrected_pose(0.1, Pose2D(1.0, 1.0)) is None
    finally:
        drive.estimator.close()
