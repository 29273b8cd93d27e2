"""detect_markers with sightings made from poses."""

from math import pi

import numpy as np
import pytest
from py_trees.common import Status

from behaviours.perception.detect_markers import DetectMarkers
from behaviours.testing import ScriptedRobot, tick
from stack.types import (
    CameraModel,
    FailureCode,
    Image,
    Marker,
    MarkerSighting,
    Pose2D,
    PoseCandidate,
)

MODEL = CameraModel(320, 240, 228.0, (0.12, 0.0, 0.35))
PIXELS = np.zeros((240, 320, 3), np.uint8)
MARKERS = tuple(Marker(n, 0.2, (2.0, float(n), 0.4), pi) for n in range(3))


def sighting(number, pose, distance=2.0, mirrored=0.6):
    """Marker `number` as seen from a pose; its second solution is turned."""
    marker = MARKERS[number]
    wrong = Pose2D(pose.x + 0.3, pose.y - 0.4, pose.heading + mirrored)
    candidates = (PoseCandidate(wrong, 0.1), PoseCandidate(pose, 0.2))
    return MarkerSighting(0.0, marker, distance, candidates)


class Watcher(ScriptedRobot):
    """Takes a picture every 0.2 s."""

    def advance(self, seconds):
        super().advance(seconds)
        if round(self.time / 0.1) % 2 == 0:
            self.picture = Image(self.time, PIXELS, MODEL)


def watcher(*sightings, pose=Pose2D(0.0, 0.0)):
    return Watcher(markers=MARKERS, sightings=sightings, pose=pose)


def test_it_reports_ids_and_poses_in_order():
    here = Pose2D(0.1, 0.2, 0.05)
    robot = watcher(sighting(2, here), sighting(0, here), pose=here)
    behaviour = DetectMarkers()
    assert tick(behaviour, robot, 5.0) is Status.SUCCESS
    assert robot.time == pytest.approx(2.0)  # the default of `time`
    assert behaviour.ids == [0, 2]
    assert behaviour.distances == [2.0, 2.0]
    for number, pose in zip(behaviour.ids, behaviour.poses, strict=True):
        assert (pose.x, pose.y) == pytest.approx((2.0, number), abs=1e-9)
        assert abs(pose.heading) == pytest.approx(pi)
    assert behaviour.largest_offset == pytest.approx(0.0, abs=1e-9)


def test_a_wrong_estimate_shows_as_an_offset():
    robot = watcher(sighting(0, Pose2D(0.0, 0.0)), pose=Pose2D(0.3, 0.0))
    behaviour = DetectMarkers()
    assert tick(behaviour, robot, 5.0) is Status.SUCCESS
    assert behaviour.largest_offset == pytest.approx(0.3)


def test_it_ends_as_soon_as_the_wanted_ones_are_seen():
    here = Pose2D(0.0, 0.0)
    robot, behaviour = watcher(sighting(0, here)), DetectMarkers(wanted=[0, 1], time=10.0)
    assert tick(behaviour, robot, 1.0) is Status.RUNNING
    robot.sightings = (sighting(1, here),)
    assert tick(behaviour, robot, 1.0) is Status.SUCCESS
    assert behaviour.ids == [0, 1] and robot.time < 2.0


def test_the_nearest_sighting_counts():
    far, near = Pose2D(0.5, 0.0), Pose2D(0.0, 0.0)
    robot, behaviour = watcher(sighting(0, far, distance=3.0)), DetectMarkers()
    tick(behaviour, robot, 1.0)
    robot.sightings = (sighting(0, near, distance=1.5),)
    tick(behaviour, robot, 0.4)
    robot.sightings = (sighting(0, far, distance=3.0),)
    assert tick(behaviour, robot, 3.0) is Status.SUCCESS
    assert behaviour.distances == [1.5] and behaviour.largest_offset < 1e-9


def test_missing_markers_are_named():
    robot, behaviour = watcher(sighting(0, Pose2D(0.0, 0.0))), DetectMarkers(wanted=[0, 2])
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.MARKER_NOT_FOUND
    assert behaviour.failure.sentence == "marker 2 is not in sight; seen: 0"


def test_a_marker_that_is_not_on_the_map_fails_at_once():
    robot, behaviour = watcher(), DetectMarkers(wanted=[7])
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert robot.time == 0.0 and "the map has no marker 7" in behaviour.failure.sentence


def test_none_in_sight_and_no_camera():
    behaviour = DetectMarkers()
    assert tick(behaviour, watcher(), 5.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.MARKER_NOT_FOUND
    blind = DetectMarkers()
    assert tick(blind, ScriptedRobot(markers=MARKERS), 5.0) is Status.FAILURE
    assert blind.failure.code == FailureCode.NO_IMAGE


def test_it_turns_if_asked_and_ends_with_the_turn():
    robot, behaviour = watcher(), DetectMarkers(turn=2.0 * pi, wanted=[1])
    assert tick(behaviour, robot, 10.0) is Status.RUNNING
    assert robot.calls_of("spin") == [{"angle": 2.0 * pi, "speed": 0.5}]
    robot.task.succeed()
    assert tick(behaviour, robot) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.MARKER_NOT_FOUND


def test_a_turn_that_is_blocked_is_its_failure():
    robot, behaviour = watcher(), DetectMarkers(turn=pi)
    tick(behaviour, robot)
    robot.task.fail(FailureCode.COLLISION_AHEAD, "a box")
    assert tick(behaviour, robot) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.COLLISION_AHEAD
