"""Evasion: predicted meetings in closed form, and a robot that leaves people's ways."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import hypot, inf, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.control.evasion import kernels
from stack.control.evasion.evasion import Evaded, Evasion, Situation
from stack.control.evasion.lanes import LANE_LOOKAHEAD, NO_LANES, NO_WAY, Lanes
from stack.control.evasion.motions import motions_of
from stack.control.evasion.parameters import EvasionParameters
from stack.control.evasion.pushing import SETS_OFF, PushingPeople
from stack.safety.kernels import signed_distance
from stack.safety.monitor import moving_discs
from stack.types import STANDSTILL, ObstaclePoints, Pose2D, TrackedObject, Twist
from tests.stack.navigation.toy_world import RECTANGLE, moving

KINDS = ("differential", "omni", "ackermann")
CORNERS = np.ascontiguousarray(RECTANGLE.points)


def evade(evasion, wanted, situation):
    return evasion.step(wanted, situation).twist


def track(x, y, vx=0.0, vy=0.0, radius=0.2, number=1, stamp=0.0) -> TrackedObject:
    return TrackedObject(number, stamp, (x, y), (vx, vy), radius, 0.01 * np.eye(4))


def made(kind="differential", **changes) -> Evasion:
    return Evasion(moving(kind), EvasionParameters(**changes))


def corridor(width: float) -> np.ndarray:
    """Points on two walls along x, every 5 cm."""
    x = np.arange(-3.0, 3.0, 0.05)
    return np.concatenate([np.column_stack([x, np.full_like(x, side * width / 2)])
                           for side in (-1.0, 1.0)])  # fmt: skip


NOTHING = np.empty((0, 2))


def simulate(evasion, wanted, people, points=NOTHING, seconds=4.0, path=NOTHING, poses=None):
    """Drive and walk at constant velocities; return the least gap to anybody, and the last pose.

    Along a path (n, 2), the wanted velocity is that of pure pursuit at the speed of `wanted`.
    """
    pose, twist, period, least = Pose2D(0.0, 0.0), STANDSTILL, 0.05, inf
    speed, lanes = wanted.linear, Lanes(moving("differential"))
    limits = moving("differential").limits
    for step in range(round(seconds / period)):
        time = step * period
        tracks = [track(x + time * vx, y + time * vy, vx, vy, radius, n, time)
                  for n, (x, y, vx, vy, radius) in enumerate(people)]  # fmt: skip
        around = ObstaclePoints(time, pose.inverse().transform(points))
        ahead = path[path[:, 0] >= pose.x - 0.05]
        if len(path):
            wanted = lanes.twist(lanes.way(ahead, pose, Twist(speed), 5.0), speed, 0.0)
        asked = evade(evasion, wanted, Situation(time, pose, twist, tracks, around, ahead))
        twist = Twist(
            limits.limit_linear(twist.linear, asked.linear, period),
            limits.limit_angular(twist.angular, asked.angular, period),
            limits.limit_linear(twist.lateral, asked.lateral, period),
        )
        turn = twist.angular * period
        if poses is not None:
            poses.append(pose)
        pose = pose.compose(Pose2D(twist.linear * period, twist.lateral * period, turn))
        for item in tracks:
            there = Pose2D(*item.position).relative_to(pose)
            least = min(least, signed_distance(CORNERS, there.x, there.y) - item.radius)
    return least, pose


def test_a_velocity_that_meets_nobody_is_not_changed():
    evasion, wanted = made(), Twist(0.5, 0.3)
    beside = [track(2.0, 1.9, -0.8, 0.0), track(-2.0, 0.0, -0.5, 0.0, number=2)]
    for tracks in ([], beside):
        now = Situation(0.0, Pose2D(0, 0), wanted, tracks, ObstaclePoints())
        assert evasion.step(wanted, now) == Evaded(wanted)


@pytest.mark.parametrize("kind", KINDS[:2])
@pytest.mark.parametrize("bearing", [0.0, 0.5 * pi, pi, -2.0])
@pytest.mark.parametrize("speed", [0.6, 1.0])
def test_a_standing_robot_leaves_the_way_of_somebody_who_walks_into_it(kind, bearing, speed):
    """1 m/s from 2.5 m away: standing still it is met after 2.5 - 0.25 - 0.2 m, about 2 s.

    At 0.6 m/s there is time to turn and drive aside. Backing away, at 0.3 m/s, only puts it off.
    """
    toward = -speed * np.cos(bearing), -speed * np.sin(bearing)
    person = (2.5 * np.cos(bearing), 2.5 * np.sin(bearing), *toward, 0.2)
    standing, _ = simulate(made(kind, meeting_weight=0.0), STANDSTILL, [person], seconds=7.0)
    least, _ = simulate(made(kind), STANDSTILL, [person], seconds=7.0)
    assert standing < 0.0 < least


def test_the_faster_it_drives_the_wider_it_passes():
    """Somebody stands 0.1 m beside its way: 0.2 m of robot and 0.2 m of person on 0.5 m."""

    def least(**parameters):
        evasion = made(closeness_weight=0.0, growth=0.0, **parameters)
        return simulate(evasion, Twist(0.8), [(2.0, 0.43, 0.0, 0.0, 0.2)], seconds=3.0)[0]

    assert least(headway=0.1) > least(headway=0.0) + 0.02


def test_in_a_wide_corridor_it_passes_and_goes_on():
    """2.4 m: 0.4 m of robot and 0.4 m of person leave 1.6 m."""
    least, pose = simulate(
        made(), Twist(0.6), [(4.0, 0.0, -1.0, 0.0, 0.2)], corridor(2.4), seconds=5.0
    )
    assert least > 0.0
    assert pose.x > 0.5


STRAIGHT = np.column_stack([np.arange(0.0, 12.0, 0.1), np.zeros(120)])


def test_it_chooses_one_side_and_keeps_to_it():
    """Head-on in a corridor of 2 m: the robot and the person have a cross section of 0.4 m each."""
    poses = []
    simulate(made(), Twist(0.8), [(5.0, 0.0, -1.0, 0.0, 0.2)], corridor(2.0), 3.0, STRAIGHT, poses)
    sides = {np.sign(pose.y) for pose in poses if abs(pose.y) > 0.02}
    assert len(sides) == 1
    assert max(abs(pose.y) for pose in poses) > 0.45  # 0.4 m and the padding


@pytest.mark.parametrize(("bearing", "speed"), [(0.3, 1.0), (1.05, 1.0), (2.09, 0.8)])
def test_a_motion_goes_on_with_its_second_part(bearing, speed):
    """Turn, then drive. A motion that began with each step again leaves 0.06 to 0.09 m."""
    toward = -speed * np.cos(bearing), -speed * np.sin(bearing)
    person, poses = (2.5 * np.cos(bearing), 2.5 * np.sin(bearing), *toward, 0.2), []
    least, _ = simulate(made(), STANDSTILL, [person], seconds=6.0, poses=poses)
    assert least > 0.09
    moves = [hypot(b.x - a.x, b.y - a.y) > 1e-3 for a, b in pairwise(poses)]
    turns = [abs(b.heading - a.heading) > 1e-3 for a, b in pairwise(poses)]
    first = moves.index(True)
    assert sum(turns[:first]) >= 10  # half a second and more
    assert not any(turns[first + 10 :])  # the turning speed falls to zero meanwhile


def reversing(retreat: bool, gap: float, **changes) -> Twist:
    """The answer to a reverse at 0.15 m/s before somebody who comes at 0.3 m/s; 1 m is free."""
    evasion, wanted = made(**changes), Twist(-0.15, -0.5)
    front = float(RECTANGLE.points[:, 0].max())
    return evade(evasion, wanted, Situation(
        0.0, Pose2D(0.0, 0.0), wanted, [track(front + 0.2 + gap, 0.0, -0.3)],
        ObstaclePoints(0.0, corridor(1.0)), -STRAIGHT, makes_way=retreat,
    ))  # fmt: skip


def test_who_makes_way_goes_on_to_its_place_as_fast_as_it_can():
    """Another motion may be met later, but it leads nowhere. The robot reverses at 0.3 m/s."""
    limits = moving("differential").limits
    assert reversing(retreat=True, gap=0.1) == Twist(
        -limits.reverse_speed, -0.5 * limits.reverse_speed / 0.15
    )
    other = reversing(retreat=False, gap=0.1)
    assert other.angular / other.linear != pytest.approx(0.5 / 0.15)
    assert reversing(retreat=True, gap=2.0) == Twist(-0.15, -0.5)


def test_a_robot_that_is_blind_behind_does_not_hurry_backwards():
    evasion, wanted = made(), Twist(-0.1)
    behind = np.array([[0.5 * pi, pi]])
    blind = replace(ObstaclePoints(0.0), blind_sectors=behind)
    asked = evade(evasion, wanted, Situation(
        0.0, Pose2D(0.0, 0.0), wanted, [track(0.6, 0.0, -0.3)], blind, -STRAIGHT, makes_way=True,
    ))  # fmt: skip
    assert asked == wanted


@pytest.mark.parametrize("ahead", [0.0, 0.2])
@pytest.mark.parametrize("gap", [0.0, 0.1, 0.3])
def test_it_passes_people_the_more_slowly_the_closer(gap, ahead):
    """Somebody beside the robot walks outward at 0.5 m/s, and may turn back."""
    half = float(RECTANGLE.points[:, 1].max())
    beside = track(ahead, half + gap + 0.2, 0.0, 0.5)
    evasion, wanted = made(passing_speed=0.1, passing_time=0.5), Twist(0.8, 0.2)

    def asked(x):
        at = Pose2D(x, 0.0)
        return evade(evasion, wanted, Situation(0.0, at, wanted, [beside], ObstaclePoints()))

    share = min(1.0, (0.1 + gap / 0.5) / 0.8)
    assert asked(0.0).linear == pytest.approx(share * 0.8)
    assert asked(0.0).angular == pytest.approx(share * 0.2)
    assert asked(1.0) == wanted  # they are behind
    evasion.configure(EvasionParameters(passing_time=0.0))
    assert asked(0.0) == wanted


@given(st.floats(-0.9, 0.9), st.floats(0.1, 0.4))
@settings(deadline=None, max_examples=30)
def test_a_lane_is_followed_in_reverse(offset, speed):
    """The mirror image of driving forward along the same way: one heading, one sign differ."""
    steering = Lanes(moving("differential")).steering
    way = kernels.way_beside(np.ascontiguousarray(-STRAIGHT[:60]))
    forward = kernels.lane_twist(way, 0, np.array([0.0, 0.1, pi]), speed, offset, steering)
    backward = kernels.lane_twist(way, 0, np.array([0.0, 0.1, 0.0]), -speed, offset, steering)
    assert backward[0] == pytest.approx(-forward[0])
    assert backward[1] == pytest.approx(forward[1])
    assert backward[2] == forward[2]


def test_motions_off_the_path_keep_off_walls():
    """A robot closer to a wall than its corners reach could not turn: with 0.04 m it comes nearer.

    Somebody who does not fit beside it comes at its reverse speed in a corridor of 1 m.
    """
    poses, evasion = [], made(retreat_time=0.6)
    person = (2.5, 0.2, -0.3, 0.0, 0.25)
    simulate(evasion, Twist(0.3), [person], corridor(1.0), 8.0, STRAIGHT, poses)
    assert poses[-1].x < max(pose.x for pose in poses) - 0.5  # it backs out
    half = float(RECTANGLE.points[:, 1].max())
    assert max(abs(pose.y) for pose in poses) < 0.5 - half - 0.1


@pytest.mark.parametrize(("retreat_time", "backs"), [(2.0, True), (0.5, False)])
def test_it_backs_only_from_who_would_soon_hit_a_standing_robot(retreat_time, backs):
    """A corridor of 1 m leaves 0.2 m beside both. The person, 1.5 m away, comes at 0.8 m/s."""
    evasion, wanted = made(retreat_time=retreat_time), Twist(0.6)
    now = Situation(
        0.0, Pose2D(0.0, 0.0), wanted, [track(1.5, 0.0, -0.8)],
        ObstaclePoints(0.0, corridor(1.0)), STRAIGHT,
    )  # fmt: skip
    asked = evade(evasion, wanted, now)
    assert (asked.linear < 0.0) == backs
    assert backs or asked == wanted


@pytest.mark.parametrize("aside", [-0.15, 0.0, 0.15])
def test_along_a_path_it_passes_on_a_lane_and_does_not_turn_away(aside):
    """2 m: 0.4 m of robot and 0.4 m of person leave 1.2 m. Undisturbed it drives 3.2 m in 4 s."""
    poses = []
    least, pose = simulate(
        made(), Twist(0.8), [(5.0, aside, -1.0, 0.0, 0.2)], corridor(2.0), 5.0, STRAIGHT, poses
    )
    assert least > 0.0
    assert pose.x > 3.0
    assert max(abs(pose.heading) for pose in poses) < 1.0
    assert abs(pose.y) < 0.3  # on the way back to its path


def test_it_passes_somebody_who_stands_on_the_path():
    """Costmaps leave out who has walked a moment ago, so only evasion leads round them."""
    poses = []
    least, pose = simulate(
        made(), Twist(0.8), [(3.0, 0.0, 0.0, 0.0, 0.2)], corridor(2.4), 8.0, STRAIGHT, poses
    )
    assert least > 0.0
    assert pose.x > 4.0


def test_a_bend_of_the_path_is_not_taken_for_a_circle():
    """The path turns left by 45 degrees over 1 m and goes on straight. Somebody walks where the
    circle of the first arc would lead: 1.5 m left of the bend, away from the path."""
    bend = 0.25 * pi * np.arange(11) / 10
    corner = np.column_stack([np.sin(bend), 1.0 - np.cos(bend)]) / (0.25 * pi)
    end = corner[-1] + np.outer(np.arange(0.1, 6.0, 0.1), [np.cos(0.25 * pi), np.sin(0.25 * pi)])
    path = np.concatenate([corner, end])
    person, wanted = [track(0.3, 3.0, 0.2, -0.6)], Twist(0.8, 0.8 * 0.25 * pi)
    here = Pose2D(0.0, 0.0)
    situation = Situation(0.0, here, wanted, person, ObstaclePoints(), path)
    assert evade(made(horizon=3.0, time_to_meeting=3.0), wanted, situation) == wanted
    without = Situation(0.0, here, wanted, person, ObstaclePoints())
    assert evade(made(horizon=3.0, time_to_meeting=3.0), wanted, without) != wanted


@pytest.mark.parametrize("kind", ["differential", "ackermann"])
@given(st.floats(-0.9, 0.9), st.floats(0.2, 0.8))
@settings(deadline=None, max_examples=30)
def test_a_lane_is_reached_and_kept(kind, offset, speed):
    """Pure pursuit closes in within a few lookahead distances of way."""
    robot = moving(kind)
    lanes = Lanes(robot)
    way = lanes.way(STRAIGHT, Pose2D(0.0, 0.0), Twist(speed), 12.0)
    pose, passed, least = Pose2D(0.0, 0.0), 0, inf
    while pose.x < 8.0 * LANE_LOOKAHEAD:
        here = np.array([pose.x, pose.y, pose.heading])
        linear, angular, passed = kernels.lane_twist(
            way, passed, here, speed, offset, lanes.steering
        )
        twist = robot.drivetrain.feasible(Twist(linear, angular))
        assert (twist.linear, twist.angular) == pytest.approx((linear, angular))
        pose = pose.compose(Pose2D(0.05 * linear, 0.0, 0.05 * angular))
        least = min(least, linear)
    assert pose.y == pytest.approx(offset, abs=0.03)
    assert least > 0.0


def test_somebody_walks_until_a_wall_and_not_through_it():
    disc = np.array([[3.0, 0.0, -1.0, 0.0, 0.2, 0.0]])
    wall = np.array([[1.0, 0.0]])
    # 2 m to the wall, less the radius without the overlap of 0.1 m
    assert kernels.times_to_obstacles(disc, wall, 3.0, 0.1, 0.1) == pytest.approx([1.9])
    aside = np.array([[1.0, 0.15]])
    assert kernels.times_to_obstacles(disc, aside, 3.0, 0.1, 0.1) == pytest.approx([3.0])
    least, _ = simulate(made(), STANDSTILL, [])
    assert least == inf
    evasion = made()
    around = ObstaclePoints(0.0, np.array([[1.0, y] for y in np.arange(-1.0, 1.0, 0.05)]))
    now = Situation(0.0, Pose2D(0, 0), STANDSTILL, [track(3.0, 0.0, -1.0)], around)
    assert evade(evasion, STANDSTILL, now) == STANDSTILL


@given(
    st.floats(-0.6, 0.8), st.floats(-1.2, 1.2), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0),
    st.floats(-1.2, 1.2), st.floats(-1.2, 1.2),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_a_predicted_meeting_is_that_of_small_steps(linear, angular, x, y, vx, vy):
    """Both already move at the motion's velocity, so that nothing accelerates."""
    radius, padding = 0.2, 0.05
    gap = signed_distance(CORNERS, x, y) - radius
    if gap < padding + 0.05:
        return
    motion = np.array([[linear, 0.0, angular, 9.0, linear, 0.0, angular]])
    options = np.array([3.0, 0.1, padding, 0.0, 0.0, 0.3, 0.04, 1.0, 1.0, 1.0, 1.0, 0.15])
    _, times = kernels.motion_costs(
        NO_LANES, NO_WAY, np.zeros(5), motion, np.array([linear, 0.0, angular]),
        np.array([1.0, 1.5, 3.2]),
        np.array([[x, y, vx, vy, radius, 0.0]]), np.array([9.0]), np.empty((0, 2)), CORNERS,
        RECTANGLE.circumscribed_radius, options,
    )  # fmt: skip
    pose, least = Pose2D(0.0, 0.0), inf
    for step in range(1, 31):
        turn = 0.5 * angular * 0.1
        way = 0.1 * linear
        pose = pose.compose(Pose2D(way * np.cos(turn), way * np.sin(turn), 2 * turn))
        time = 0.1 * step
        there = Pose2D(x + time * vx, y + time * vy).relative_to(pose)
        least = min(least, signed_distance(CORNERS, there.x, there.y) - radius)
        if least < padding - 1e-6:
            assert times[0] == pytest.approx(time, abs=0.101)
            return
    assert times[0] == inf or least < padding + 1e-6


PLACES = st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), max_size=12)


@given(PLACES, PLACES, st.floats(0.1, 0.5))
@settings(deadline=None)
def test_points_stay_if_they_are_off_everybody(places, people, radius):
    points = np.array(places, dtype=np.float64).reshape(-1, 2)
    discs = np.array([(x, y, 0.0, 0.0, radius) for x, y in people], dtype=np.float64)
    left = kernels.points_outside_discs(points, discs.reshape(-1, 5), inf, 0.1)
    gaps = [min((hypot(x - u, y - v) for u, v in people), default=inf) for x, y in places]
    assert left.tolist() == [
        list(place) for place, gap in zip(places, gaps, strict=True) if gap > radius + 0.1
    ]


@pytest.mark.parametrize("kind", KINDS)
def test_all_motions_are_feasible(kind):
    made_robot = moving(kind)
    for row in motions_of(made_robot):
        for linear, lateral, angular in (row[:3], row[4:]):
            twist = Twist(linear, angular, lateral)
            found = made_robot.drivetrain.feasible(twist)
            assert (found.linear, found.angular, found.lateral) == pytest.approx(
                (linear, angular, lateral)
            )
            assert made_robot.limits.clipped(twist) == twist


def test_the_blind_side_is_entered_slowly():
    evasion = made()
    blind = ObstaclePoints(blind_sectors=np.array([[pi - 0.7, 1.4]]))
    twist, now = STANDSTILL, [track(1.2, 0.0, -1.0)]
    asked = evade(evasion, STANDSTILL, Situation(0.0, Pose2D(0, 0), twist, now, blind))
    assert asked.linear >= -0.15


def test_who_ran_into_the_robot_and_stands_is_expected_to_go_on():
    pushing, here = PushingPeople(), Pose2D(1.0, 0.0, pi / 2)
    walks, stands = track(1.0, 0.8, 0.0, -1.0), track(1.0, 0.5)
    pushing.expected(0.0, [walks], here, moving_discs([walks], here))
    (disc,) = pushing.expected(0.4, [stands], here, moving_discs([stands], here))
    # base frame: ahead of the robot, towards it at 1 m/s, 0.6 s from now
    assert disc == pytest.approx([0.5, 0.0, -1.0, 0.0, 0.2, SETS_OFF - 0.4], abs=1e-9)
    (late,) = pushing.expected(20.0, [stands], here, moving_discs([stands], here))
    assert hypot(late[2], late[3]) == 0.0


def test_the_same_situation_gives_the_same_motion():
    now = Situation(0.0, Pose2D(0, 0), Twist(0.4), [track(1.5, 0.1, -1.0)],
                    ObstaclePoints(0.0, corridor(1.8)))  # fmt: skip
    assert made().step(Twist(0.4), now) == made().step(Twist(0.4), now)


@pytest.mark.parametrize("aside", [0.0, 0.1, 0.2])
def test_a_decision_is_kept_while_others_are_about_as_good(aside):
    """Somebody comes straight at the robot, measured a little to either side in turn.

    Its plan comes and goes, so that there are lanes in every other step only. Without keeping, the
    motion changes in 10 to 13 of the 13 steps.
    """
    evasion, asked = made(), []
    path = np.column_stack([np.arange(0.0, 6.0, 0.05), np.zeros(120)])
    for step in range(14):
        time, drives = 0.05 * step, step % 2 == 0
        people = [track(1.2 - time, aside * (-1) ** step, -1.0, stamp=time)]
        around = ObstaclePoints(time, corridor(2.4))
        way = path if drives else NOTHING
        now = Situation(time, Pose2D(0.0, 0.0), STANDSTILL, people, around, way)
        asked.append(evade(evasion, Twist(0.4) if drives else STANDSTILL, now))
    assert sum(before != after for before, after in pairwise(asked)) <= 1
