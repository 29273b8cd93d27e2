"""A kidnapped robot in a room with two markers, one of which looks the wrong way round."""

from math import pi, radians

import numpy as np
import pytest
from kinematic_robot import segments_of
from lost_robot import LostRobot, marker_on_wall
from py_trees.common import Status

from behaviours._sensing.marker_pose import Hypothesis, best_fit, hypotheses, merged, rotated
from behaviours.localisation.relocalise import Relocalise
from behaviours.testing import ScriptedRobot, halt, tick
from stack.types import (
    STANDSTILL,
    Marker,
    MarkerSighting,
    Pose2D,
    PoseCandidate,
    RivalPose,
    TaskStatus,
    wrap_angle,
)

# No symmetry: a room of 7 m by 5 m with a niche and a pillar.
ROOM = segments_of(
    [(0, 0), (7, 0), (7, 5), (4, 5), (4, 4), (3, 4), (3, 5), (0, 5), (0, 0)],
    [(1.5, 3.2), (2.0, 3.2), (2.0, 3.6), (1.5, 3.6), (1.5, 3.2)],
)
MARKERS = (marker_on_wall(3, 7.0, 2.0, pi), marker_on_wall(4, 1.0, 0.0, pi / 2))
TRUTH = Pose2D(4.5, 2.5, 2.0)
WRONG = Pose2D(1.0, 1.0, 0.0)


def lost(**settings):
    settings = {"markers": MARKERS, "pose": TRUTH, "belief": WRONG, **settings}
    return LostRobot(segments=ROOM, **settings)


def near(one, other, position=0.15, heading=0.1):
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= position and turn <= heading


@pytest.mark.parametrize("wrong_first", [False, True])
@pytest.mark.parametrize("heading", [-2.5, -1.0, 0.3, 2.0])
def test_finds_itself_by_a_marker(heading, wrong_first):
    robot = lost(pose=Pose2D(4.5, 2.5, heading), wrong_first=wrong_first)
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert behaviour.method == "marker"
    assert near(robot.belief, robot.pose)
    assert robot.calls_of("set_pose")[-1]["source"] == "marker"
    assert robot.time < 20.0
    assert robot.blurred == 0
    assert robot.calls_of("relocalise") == []


@pytest.mark.parametrize(
    "settings", [{"markers": ()}, {"camera_works": False}, {"markers": MARKERS[:0]}]
)
def test_asks_the_lidar_when_there_is_nothing_to_see(settings):
    robot = lost(global_answer=["truth"], **settings)
    behaviour = Relocalise()
    assert tick(behaviour, robot, 5.0) is Status.SUCCESS
    assert behaviour.method == "lidar"
    assert robot.calls_of("spin") == []


def test_asks_the_lidar_when_no_marker_is_seen_all_round():
    hidden = (marker_on_wall(3, 7.0, 2.0, 0.0),)  # faces away
    robot = lost(markers=hidden, global_answer=["truth"])
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert behaviour.method == "lidar"
    turned = sum(call["angle"] for call in robot.calls_of("spin"))
    assert 2 * pi - 1e-6 <= turned <= 2 * pi + radians(60.0)


def test_the_camera_can_be_disabled():
    robot = lost(global_answer=["truth"])
    assert tick(Relocalise(use_camera=False), robot, 5.0) is Status.SUCCESS
    assert robot.calls_of("spin") == []
    assert robot.asked_at < 0.0  # never asked for a picture


def test_moves_on_before_it_asks_the_lidar_again():
    robot = lost(markers=(), global_answer=[None, None], refusal=("LOST", "nothing fits"))
    start = robot.pose
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.FAILURE
    assert len(robot.calls_of("relocalise")) == 2
    assert robot.calls_of("disambiguate") == []
    assert 0.8 <= robot.pose.distance_to(start) <= 1.2
    assert behaviour.failure.code == "LOST"
    assert behaviour.failure.sentence == "nothing fits"
    assert robot.time < 30.0


def test_drives_to_where_the_places_differ():
    robot = lost(markers=(), global_answer=[None])
    behaviour = Relocalise()
    while not robot.calls_of("disambiguate"):
        assert tick(behaviour, robot, 0.1) is Status.RUNNING
    robot.belief = robot.pose
    robot.task.succeed()
    assert tick(behaviour, robot, 5.0) is Status.SUCCESS
    assert behaviour.method == "lidar"


def test_fails_when_no_place_differs():
    robot = lost(markers=(), global_answer=[None])
    behaviour = Relocalise()
    while not robot.calls_of("disambiguate"):
        assert tick(behaviour, robot, 0.1) is Status.RUNNING
    robot.task.fail("AMBIGUOUS", "two places fit alike")
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert behaviour.failure.code == "AMBIGUOUS"
    assert behaviour.failure.sentence == "two places fit alike"
    assert len(robot.calls_of("relocalise")) == 1


def test_an_unconfirmed_pose_is_not_a_success():
    robot = lost(markers=(), global_answer=[WRONG, WRONG])
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.FAILURE
    assert behaviour.failure.code == "LOST"
    assert "expected at least 0.4" in behaviour.failure.sentence


def test_a_moved_marker_is_rejected():
    moved = (marker_on_wall(3, 7.0, 4.0, pi),)  # the map says so; it hangs 2 m further right
    robot = lost(markers=moved, pose=Pose2D(5.0, 2.5, 0.3), global_answer=[None, None])
    hangs = Marker(3, 0.2, (7.0, 2.0, 0.3), pi)
    sighting = LostRobot._sighting

    def mistaken(marker, pose, stamp):
        seen = sighting(robot, hangs, pose, stamp)
        if seen is None:
            return None
        shifted = tuple(
            PoseCandidate(Pose2D(one.pose.x, one.pose.y + 2.0, one.pose.heading), one.error)
            for one in seen.candidates
        )
        return MarkerSighting(stamp, marker, seen.distance, shifted)

    robot._sighting = mistaken
    assert tick(Relocalise(min_fit=0.5, min_health=0.5), robot, 60.0) is Status.FAILURE


def test_a_robot_that_is_not_lost_may_be_left_alone():
    robot = lost(belief=TRUTH)
    behaviour = Relocalise(only_if_lost=True)
    assert tick(behaviour, robot, 0.9) is Status.RUNNING
    assert tick(behaviour, robot, 0.2) is Status.SUCCESS
    assert behaviour.method == "kept"
    assert (
        robot.calls_of("spin") == robot.calls_of("relocalise") == robot.calls_of("set_pose") == []
    )


def test_a_pose_that_is_good_again_within_a_moment_is_kept():
    robot = lost(belief=WRONG)
    behaviour = Relocalise(only_if_lost=True)
    assert tick(behaviour, robot, 1.2) is Status.RUNNING
    robot.belief = TRUTH  # 1.2 s of the 2.5 s, and 1 s for which it must be good
    assert tick(behaviour, robot, 1.2) is Status.SUCCESS
    assert behaviour.method == "kept"
    assert robot.calls_of("relocalise") == []


def test_a_robot_with_rivals_is_not_left_alone():
    robot = lost(belief=TRUTH, markers=(), rivals=(RivalPose(WRONG, 0.4),), global_answer=[None])
    behaviour = Relocalise(only_if_lost=True)
    assert tick(behaviour, robot, 2.0) is Status.RUNNING
    assert robot.calls_of("disambiguate") == [{}]


def test_stands_when_pre_empted_in_a_turn():
    robot = lost()
    behaviour = Relocalise()
    while not robot.calls_of("spin"):
        assert tick(behaviour, robot, 0.1) is Status.RUNNING
    halt(behaviour)
    assert robot.motion.status is TaskStatus.CANCELLED
    assert robot.twist == STANDSTILL


def test_pre_emption_cancels_the_search_by_lidar():
    robot = ScriptedRobot()
    behaviour = Relocalise()
    tick(behaviour, robot, 1.0)
    assert robot.calls_of("relocalise") == [{}]
    halt(behaviour)
    assert robot.task.status is TaskStatus.CANCELLED


def test_rotation_about_a_marker_keeps_distance_and_bearing():
    marker, pose = (7.0, 2.0), Pose2D(4.0, 1.0, 0.4)
    turned = rotated(pose, marker, 0.3, 1.0)
    there = Pose2D(*marker)
    assert turned.distance_to(there) == pytest.approx(pose.distance_to(there))
    assert wrap_angle(turned.bearing_to(there) - turned.heading) == pytest.approx(
        pose.bearing_to(there) - pose.heading
    )


def test_the_best_fit_undoes_an_error_of_the_marker_pose():
    robot = lost(pose=Pose2D(4.5, 2.5, 0.0))
    marker = MARKERS[0].position[:2]
    found, fit = best_fit(rotated(robot.pose, marker, radians(12.0), 1.06), marker, robot.fit_at)
    assert fit > 0.9
    assert near(found, robot.pose, 0.08, radians(2.5))


def test_a_hypothesis_is_carried_on_by_the_odometry():
    seen = MarkerSighting(1.0, MARKERS[0], 2.0, (PoseCandidate(Pose2D(2.0, 1.0, 0.0), 0.5),))
    then, now = Pose2D(10.0, 0.0, 0.0), Pose2D(11.0, 0.0, pi / 2)
    [one] = hypotheses(seen, then, now, lambda pose: 0.5)
    # A metre ahead of (2, 1) and a quarter turn to the left.
    assert near(one.pose(now), Pose2D(3.0, 1.0, pi / 2), 1e-9, 1e-9)
    later = Pose2D(11.0, 2.0, pi / 2)
    assert near(one.pose(later), Pose2D(3.0, 3.0, pi / 2), 1e-9, 1e-9)


def test_two_pictures_of_one_place_make_one_hypothesis():
    here = Pose2D(0.0, 0.0)
    first = Hypothesis(Pose2D(1.0, 1.0, 0.0), 0.5, 0.4, (1.0,))
    again = Hypothesis(Pose2D(1.2, 1.1, 0.1), 0.6, 0.5, (1.2,))
    other = Hypothesis(Pose2D(1.0, 1.0, 0.5), 0.7, 0.1, (1.2,))
    best, second = merged([first], [again, other], here)
    assert best == other
    assert (second.fit, second.stamps) == (0.6, (1.0, 1.2))


def test_the_fit_of_the_test_robot_is_high_at_the_true_pose_only():
    robot = lost()
    assert robot.fit_at(TRUTH) > 0.9
    assert robot.fit_at(WRONG) < 0.3
    assert np.isfinite(robot.scan.ranges).mean() > 0.9
