"""Follows walls in a kinematic world: unicycle at 20 Hz, ray-cast lidar with 1 cm of noise.

The true distance to the wall is judged on straights, a metre after each corner and before the
next: at most 5 cm RMS, and never nearer than 25 cm to anything.
"""

from math import pi

import numpy as np
import pytest
from kinematic_robot import KinematicRobot, clearance, segments_of
from py_trees.common import Status

from behaviours.following.wall_follow import WallFollow
from behaviours.testing import ScriptedRobot, halt, tick
from stack.types import STANDSTILL, Pose2D, Scan

ROOM = segments_of([(0, 0), (5, 0), (5, 3.5), (0, 3.5), (0, 0)])
L_ROOM = segments_of([(0, 0), (4.4, 0), (4.4, 2.2), (2.2, 2.2), (2.2, 4), (0, 4), (0, 0)])
# A doorway of 0.9 m in a wall 10 cm thick along y = 0, between two rooms.
DOORWAY = segments_of(
    [(2.5, -0.1), (2.5, 0), (0, 0), (0, 3), (6, 3), (6, 0), (3.4, 0), (3.4, -0.1), (6, -0.1)],
    [(2.5, -0.1), (0, -0.1), (0, -2), (6, -2), (6, -0.1)],
)
# A slit between wall and box that gets too narrow half way.
DEAD_END = segments_of(
    [(0, 0), (6, 0), (6, 4), (0, 4), (0, 0)],
    [(2.0, 0.8), (4.0, 0.2), (4.0, 2.0), (2.0, 2.0), (2.0, 0.8)],
)


def followed(segments, start, seconds=120.0, seed=1, **ports):
    robot = KinematicRobot(segments=segments, pose=start, seed=seed)
    behaviour = WallFollow(**ports)
    tick(behaviour, robot, seconds)
    assert min(clearance(segments, pose) for pose in robot.way) >= 0.25
    return behaviour, robot


def true_error_rms(robot, segments, distance, on_straight):
    errors = [clearance(segments, pose) - distance for pose in robot.way if on_straight(pose)]
    assert len(errors) > 40  # 2 s at least, or nothing was judged
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize(("side", "heading"), [("left", pi), ("right", 0.0)])
def test_goes_round_a_room_and_notices_when_it_is_back(side, heading):
    behaviour, robot = followed(ROOM, Pose2D(2.5, 3.0, heading), side=side, until_loop=True)
    assert behaviour.status is Status.SUCCESS
    # The rectangle half a metre inside is 4 m by 2.5 m: 13 m, less for four rounded corners.
    assert behaviour.travelled == pytest.approx(13.0, abs=0.9)
    straight = [1.5, 3.5]

    def on_straight(pose):
        return straight[0] < pose.x < straight[1]

    assert true_error_rms(robot, ROOM, 0.5, on_straight) <= 0.05
    assert 0.0 < behaviour.distance_error_rms <= 0.05
    assert robot.twist == STANDSTILL


def test_rounds_inner_and_outer_corners():
    behaviour, robot = followed(
        L_ROOM, Pose2D(1.0, 0.4, 0.0), side="right", distance=0.4, until_loop=True
    )
    assert behaviour.status is Status.SUCCESS
    corner = Pose2D(2.2, 2.2)
    nearest = min(pose.distance_to(corner) for pose in robot.way)
    assert nearest == pytest.approx(0.4, abs=0.06)

    def on_straight(pose):
        return pose.y < 0.9 and 1.2 < pose.x < 3.2

    assert true_error_rms(robot, L_ROOM, 0.4, on_straight) <= 0.05


def test_passes_a_doorway_straight():
    behaviour, robot = followed(
        DOORWAY, Pose2D(1.0, 0.5, 0.0), side="right", until_travelled=3.5, gap=1.2
    )
    assert behaviour.status is Status.SUCCESS
    in_front = [pose.y for pose in robot.way if 2.5 < pose.x < 3.4]
    assert np.abs(np.array(in_front) - 0.5).max() <= 0.05


def test_turns_into_an_opening_wider_than_the_gap():
    wide = segments_of(
        [(2.0, -0.1), (2.0, 0), (0, 0), (0, 3), (6, 3), (6, 0), (4, 0), (4, -0.1), (6, -0.1)],
        [(2.0, -0.1), (0, -0.1), (0, -3), (6, -3), (6, -0.1)],
    )
    _, robot = followed(wide, Pose2D(1.0, 0.5, 0.0), side="right", until_travelled=4.0)
    assert robot.pose.y < -0.4


def test_turns_back_in_a_dead_end():
    behaviour, robot = followed(
        DEAD_END, Pose2D(1.0, 0.5, 0.0), side="right", until_place=Pose2D(1.5, 1.5)
    )
    assert behaviour.status is Status.SUCCESS
    assert max(pose.x for pose in robot.way) < 4.0


def test_goes_along_the_middle_of_a_narrow_corridor():
    corridor = segments_of([(0, 0), (6, 0), (6, 0.8), (0, 0.8), (0, 0)])
    behaviour, robot = followed(
        corridor, Pose2D(0.5, 0.3, 0.0), side="right", distance=0.6, until_travelled=3.0
    )
    assert behaviour.status is Status.SUCCESS
    lateral = np.array([pose.y for pose in robot.way if pose.x > 1.5])
    assert np.abs(lateral - 0.4).max() <= 0.05


def test_approaches_a_wall_from_afar_facing_away():
    behaviour, robot = followed(
        ROOM, Pose2D(2.5, 1.7, 0.5), side="left", until_time=5.0, distance=0.4
    )
    assert behaviour.status is Status.SUCCESS
    assert clearance(ROOM, robot.pose) == pytest.approx(0.4, abs=0.08)


def test_a_round_too_short_to_be_a_loop_is_driven_twice():
    # Round a pillar of 5 cm at 30 cm: 2 pi 0.35 m = 2.2 m, under the 3 m of a loop. Twice that,
    # less the 40 cm that count as back, is 4.0 m; the chord of the lookahead cuts a little off.
    angles = np.linspace(0.0, 2.0 * pi, 13)
    pillar = segments_of([(0.05 * np.cos(a), 0.05 * np.sin(a)) for a in angles])
    behaviour, _ = followed(
        pillar, Pose2D(0.0, -0.35), side="left", distance=0.3, speed=0.3, until_loop=True
    )
    assert behaviour.status is Status.SUCCESS
    assert behaviour.travelled == pytest.approx(4.0, abs=0.4)


def test_ends_near_a_place():
    behaviour, robot = followed(
        ROOM, Pose2D(1.0, 0.5), side="right", until_place=Pose2D(4.5, 3.0), place_radius=0.4
    )
    assert behaviour.status is Status.SUCCESS
    assert robot.pose.distance_to(Pose2D(4.5, 3.0)) <= 0.4


def test_the_same_seed_drives_the_same_way():
    (_, one), (_, two) = (
        followed(ROOM, Pose2D(1.0, 0.5), side="right", until_travelled=1.0) for _ in range(2)
    )
    assert one.way == two.way


def test_no_wall_within_the_search_is_a_failure():
    behaviour, robot = followed_nothing(search=1.0)
    assert behaviour.status is Status.FAILURE
    assert behaviour.failure.code == "NO_WALL"
    assert behaviour.failure.sentence == "no wall found within 1 m"
    assert robot.twist == STANDSTILL


def followed_nothing(**ports):
    robot = KinematicRobot(segments=segments_of([(90, 90), (91, 90)]))
    behaviour = WallFollow(**ports)
    tick(behaviour, robot, 30.0)
    return behaviour, robot


def test_a_robot_that_is_held_gives_up():
    robot = KinematicRobot(segments=ROOM, pose=Pose2D(2.5, 0.5))
    robot._step = lambda: setattr(robot, "time", round(robot.time + 0.05, 9)) or robot._scan()
    behaviour = WallFollow(side="right")
    assert tick(behaviour, robot, 9.9) is Status.RUNNING
    assert tick(behaviour, robot, 0.1) is Status.FAILURE
    assert behaviour.failure.code == "NO_PROGRESS"


def test_without_a_lidar_it_stands_and_gives_up():
    robot = ScriptedRobot()
    behaviour = WallFollow()
    assert tick(behaviour, robot, 1.9) is Status.RUNNING
    assert robot.twist == STANDSTILL
    assert tick(behaviour, robot, 0.1) is Status.FAILURE
    assert behaviour.failure.sentence == "no lidar scan for 2 s"


def test_a_distance_that_leaves_no_room_is_refused():
    behaviour = WallFollow(distance=0.2)
    assert tick(behaviour, ScriptedRobot()) is Status.FAILURE
    assert "0.2 m leaves no room for the robot" in behaviour.failure.sentence


def test_stands_when_pre_empted():
    robot = KinematicRobot(segments=ROOM, pose=Pose2D(2.5, 0.5))
    behaviour = WallFollow(side="right")
    assert tick(behaviour, robot, 2.0) is Status.RUNNING
    assert robot.twist.linear > 0.2
    halt(behaviour)
    assert robot.twist == STANDSTILL


def test_all_beams_lost_is_no_wall_but_no_crash():
    robot = ScriptedRobot(
        scan=Scan(0.0, np.full(90, np.inf, dtype=np.float32), -pi, 2 * pi / 90, 0.1, 12.0)
    )
    assert tick(WallFollow(), robot) is Status.RUNNING
    assert robot.twist.linear > 0.0
