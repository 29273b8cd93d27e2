"""Relocalisation by appearance: one picture, two pictures, ambiguous pictures, markers first."""

from dataclasses import dataclass, field
from math import pi

import pytest
from kinematic_robot import segments_of
from lost_robot import LATENCY_STEPS, PERIOD, LostRobot, marker_on_wall
from py_trees.common import Status

from behaviours._sensing.marker_pose import Hypothesis
from behaviours._sensing.place_pose import place_hypothesis, refined
from behaviours.localisation.relocalise import Relocalise
from behaviours.testing import tick
from stack.types import PlaceSighting, Pose2D, wrap_angle

# No symmetry: a room of 7 m by 5 m with a niche and a pillar.
ROOM = segments_of(
    [(0, 0), (7, 0), (7, 5), (4, 5), (4, 4), (3, 4), (3, 5), (0, 5), (0, 0)],
    [(1.5, 3.2), (2.0, 3.2), (2.0, 3.6), (1.5, 3.6), (1.5, 3.2)],
)
TRUTH, WRONG = Pose2D(4.5, 2.5, 2.0), Pose2D(1.0, 1.0, 0.0)
OFF = Pose2D(0.08, -0.05, 0.03)
"""Error of the poses that the robot recognises."""


@dataclass
class SightedRobot(LostRobot):
    """A robot that recognises where it is while it looks in some directions.

    Attributes:
        views: (least heading, largest heading, inliers) of these directions, map frame.
        elsewhere: inliers of a second pose that the same pictures give; 0 for none.
        alike: whether the scan fits every pose.
    """

    keyframes: int = 20
    views: tuple[tuple[float, float, int], ...] = ((-pi, pi, 40),)
    elsewhere: int = 0
    alike: bool = False
    asked: list[float] = field(default_factory=list)

    def fit_at(self, pose: Pose2D) -> float:
        return 0.9 if self.alike else super().fit_at(pose)

    def place_sightings(self) -> tuple[PlaceSighting, ...]:
        ready = [one for one in self.exposed if one[0] <= self.steps - LATENCY_STEPS]
        if not ready:
            return ()
        step, pose, _ = ready[-1]
        stamp = step * PERIOD
        self.asked.append(stamp)
        found = [
            PlaceSighting(stamp, pose.compose(OFF), inliers, 1.5, 0.02, 0.4)
            for low, high, inliers in self.views
            if low <= pose.heading <= high
        ]
        if found and self.elsewhere:
            found.append(PlaceSighting(stamp, WRONG, self.elsewhere, 1.5, 0.02, 0.4))
        return tuple(found)


def lost(**settings):
    return SightedRobot(segments=ROOM, **{"pose": TRUTH, "belief": WRONG, **settings})


def near(one, other, position=0.06, heading=0.03):
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= position and turn <= heading


def test_one_picture_of_a_known_place_is_enough():
    robot = lost()
    behaviour = Relocalise()
    assert tick(behaviour, robot, 10.0) is Status.SUCCESS
    assert behaviour.method == "appearance" and near(robot.belief, robot.pose)
    assert [call["source"] for call in robot.calls_of("set_pose")] == ["appearance"]
    assert robot.calls_of("spin") == [] and robot.calls_of("relocalise") == []


def test_turns_until_it_looks_at_a_known_place():
    robot = lost(views=((-2.0, -0.8, 40),))  # it begins with heading 2
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert behaviour.method == "appearance" and near(robot.belief, robot.pose)
    assert robot.calls_of("spin")


def test_weak_pictures_count_only_from_two_stops():
    robot = lost(views=((-pi, pi, 12),))  # SURE_INLIERS is 16
    behaviour = Relocalise()
    assert tick(behaviour, robot, 30.0) is Status.SUCCESS
    assert behaviour.method == "appearance" and len(robot.calls_of("spin")) >= 1
    assert near(robot.belief, robot.pose)


def test_a_single_weak_picture_is_not_accepted():
    robot = lost(views=((-1.6, -1.0, 12),), global_answer=["truth"])
    behaviour = Relocalise()
    assert tick(behaviour, robot, 40.0) is Status.SUCCESS
    assert behaviour.method == "lidar" and robot.calls_of("set_pose") == []


@pytest.mark.parametrize(
    "inliers, alike, method",
    [(35, True, "lidar"), (20, True, "appearance"), (35, False, "appearance")],
)
def test_a_picture_is_ambiguous_if_another_place_explains_picture_and_scan(inliers, alike, method):
    robot = lost(elsewhere=inliers, alike=alike, global_answer=["truth"])
    behaviour = Relocalise()
    assert tick(behaviour, robot, 40.0) is Status.SUCCESS
    assert behaviour.method == method


def test_a_marker_in_the_picture_comes_first():
    marker = marker_on_wall(3, 4.0, 4.4, -pi / 2)
    robot = lost(markers=(marker,), pose=Pose2D(4.3, 2.6, pi / 2 + 0.2))
    behaviour = Relocalise()
    assert tick(behaviour, robot, 20.0) is Status.SUCCESS
    assert behaviour.method == "marker" and robot.asked == []


@pytest.mark.parametrize("settings", [{"keyframes": 0}, {"use_camera": False}])
def test_without_keyframes_or_camera_the_lidar_is_asked(settings):
    use_camera = settings.pop("use_camera", True)
    robot = lost(global_answer=["truth"], **settings)
    behaviour = Relocalise(use_camera=use_camera)
    assert tick(behaviour, robot, 5.0) is Status.SUCCESS
    assert behaviour.method == "lidar" and robot.asked == []


def test_the_scan_moves_a_pose_to_where_it_fits_best():
    def fit(pose):
        turn = abs(wrap_angle(pose.heading - TRUTH.heading))
        return max(0.0, 1.0 - pose.distance_to(TRUTH) - turn)

    found, health = refined(TRUTH.compose(Pose2D(0.12, -0.1, 0.06)), fit)
    assert near(found, TRUTH, 0.02, 0.01) and health > 0.97
    far, _ = refined(TRUTH.compose(Pose2D(3.0, 0.0, 0.0)), fit)
    assert far.distance_to(TRUTH) >= 3.0 - 0.25 - 1e-9  # moves a quarter of a metre at most


def test_a_hypothesis_follows_the_odometry_since_the_picture():
    sighting = PlaceSighting(1.0, Pose2D(2.0, 1.0, 0.5), 30, 1.0, 0.02, 0.4)
    then, now = Pose2D(0.0, 0.0, 0.0), Pose2D(1.0, 0.0, 0.0)
    found = place_hypothesis([sighting], then, now, lambda pose: 0.8, 0.35)
    assert isinstance(found, Hypothesis) and found.source == "appearance"
    assert near(found.pose(now), Pose2D(2.0, 1.0, 0.5).compose(Pose2D(1.0, 0.0)), 1e-9, 1e-9)
    assert place_hypothesis([], then, now, lambda pose: 0.8, 0.35) is None
    assert place_hypothesis([sighting], then, now, lambda pose: 0.3, 0.35) is None
