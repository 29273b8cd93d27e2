"""A robot that is blind behind: how fast its outline enters ground that no sensor has seen."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from stack.drivetrain.description import LidarDescription
from stack.geometry.polygons import outline_points
from stack.safety.monitor import UnseenGroundLimit
from stack.safety.parameters import SafetyParameters
from stack.types import STANDSTILL, Pose2D, SeenGround, Twist
from tests.stack.navigation.toy_world import RECTANGLE, ToyWorld, robot, room
from tests.stack.safety.obstacles import SafetyStage

BLIND_BEHIND = replace(robot(), lidar=LidarDescription(Pose2D(0.0, 0.0), field_of_view=1.5 * pi))
BLIND_SPEED = SafetyParameters().blind_speed
RADIUS = hypot(0.25, 0.2)
CELL = 0.03
OUTLINE = outline_points(RECTANGLE.points, 0.04)

speeds = st.tuples(st.floats(-0.3, 0.8), st.floats(-1.8, 1.8))
circles = st.lists(st.tuples(st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.1, 0.4)))


def drive(world, safety, wanted, seconds):
    """Yield the twists that are let through."""
    for _ in range(round(seconds / world.period)):
        twist = safety.limit(wanted, world.odometry, world.obstacles)
        world.drive(twist)
        yield twist


def test_the_first_turn_in_place_is_slow_and_the_second_is_not():
    """The rear corner is 0.32 m from the middle: 0.15 / 0.32 = 0.47 rad/s. It starts at a bearing
    of 141 degrees, the lidar has seen the ground from 225 degrees on: 1.46 rad, 3.1 s."""
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(2.0, 2.0))
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    driven = [twist.angular for twist in drive(world, safety, Twist(angular=1.5), 2.5)]
    assert driven[10:] == pytest.approx([BLIND_SPEED / RADIUS] * 40, rel=0.01)
    assert safety.reason == "slower: no sensor has seen this ground"
    driven = [twist.angular for twist in drive(world, safety, Twist(angular=1.5), 2.0)]
    assert driven[-1] == 1.5
    assert safety.reason == ""


def test_after_driving_forwards_a_turn_in_place_is_not_limited():
    """Its rear corners then sweep ground that the lidar has seen or that it stood on."""
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(1.0, 2.0))
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    list(drive(world, safety, Twist(0.5), 1.5))
    list(drive(world, safety, STANDSTILL, 0.5))
    driven = list(drive(world, safety, Twist(angular=1.5), 0.8))
    assert driven[-1] == Twist(angular=1.5)


def test_a_blind_speed_of_zero_refuses_unseen_ground_but_not_driving_off():
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(1.0, 2.0))
    safety = SafetyStage(world.robot, SafetyParameters(blind_speed=0.0), world.period)
    assert sum(twist.angular for twist in drive(world, safety, Twist(0.0, 1.0), 1.0)) < 1.0
    assert safety.reason == "stopped: no sensor has seen this ground"
    assert list(drive(world, safety, Twist(0.5), 1.0))[-1] == Twist(0.5)


class Witness:
    """Which ground was seen, from all scans and poses so far, without a grid."""

    def __init__(self, world: ToyWorld) -> None:
        self._world, self._poses, self._scans = world, [world.pose], [(world.pose, world.scan)]

    def note(self) -> None:
        """Remember the pose and the scan of this step."""
        self._poses.append(self._world.pose)
        if self._world.scan.stamp == self._world.time:
            self._scans.append((self._world.pose, self._world.scan))

    def fastest_to_unseen_ground(self) -> float:
        """Largest speed, m/s, of a point of the outline that is 6 cm before unseen ground."""
        twist, (x, y) = self._world.twist, OUTLINE.T
        velocity = np.column_stack([twist.linear - twist.angular * y, twist.angular * x])
        speed = np.hypot(*velocity.T)
        ahead = OUTLINE + 0.06 * velocity / np.maximum(speed, 1e-9)[:, None]
        points = self._world.pose.transform(ahead)
        unseen = np.ones(len(points), dtype=bool)
        for pose in self._poses:
            local = np.abs(pose.inverse().transform(points))
            # what shares a cell with ground that the robot stood on counts as seen
            unseen &= (local[:, 0] > 0.25 + 1.5 * CELL) | (local[:, 1] > 0.2 + 1.5 * CELL)
        for pose, scan in self._scans:
            x, y = pose.inverse().transform(points).T
            beam = np.round((np.arctan2(y, x) - scan.angle_min) / scan.angle_increment).astype(int)
            inside = (beam >= 0) & (beam < scan.ranges.size)
            ranges = scan.ranges[np.clip(beam, 0, scan.ranges.size - 1)]
            unseen &= ~(inside & (np.hypot(x, y) <= ranges + 1.5 * CELL))
        return float(speed[unseen].max(initial=0.0))


@settings(deadline=None, max_examples=12)
@given(st.floats(-pi, pi), st.lists(speeds, min_size=4, max_size=4), circles)
@example(0.0, [(0.0, 0.0), (0.0, -1.0), (0.0625, 1.5), (-0.25, 0.0)], [])
@example(0.0, [(0.0, 0.0), (0.0, 1.25), (0.056, -1.71), (-0.245, 0.0)], [])
def test_no_point_of_the_outline_enters_unseen_ground_fast(heading, wishes, things):
    """Its wheels lag, and 1.5 cm are left to slow down: 5 cm/s more than the limit.

    In the examples it is on an arc over seen ground, and braking leads off it: to 0.21 and 0.22 m/s
    where each component slows down for itself.
    """
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(2.0, 2.0, heading), things, beams=360)
    assume(world.clearance() > 0.05)
    safety, witness = SafetyStage(world.robot, SafetyParameters(), world.period), Witness(world)
    for wish in wishes:
        for _ in drive(world, safety, Twist(*wish), 0.6):
            witness.note()
            assert witness.fastest_to_unseen_ground() < BLIND_SPEED + 0.05


@settings(deadline=None, max_examples=30)
@given(st.floats(-pi, pi), st.sampled_from([-0.3, -0.1, 0.0, 0.1, 0.4]), st.floats(-1.8, 1.8))
def test_it_goes_on_into_unseen_ground(heading, linear, angular):
    """Slowly, but it never stays where it is: its outline moves at the blind speed."""
    assume(hypot(linear, angular * RADIUS) > 0.1)
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(2.0, 2.0, heading), beams=360)
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    twists = list(drive(world, safety, Twist(linear, angular), 1.5))
    slowest = min(abs(twist.linear) + RADIUS * abs(twist.angular) for twist in twists[6:])
    assert slowest > 0.5 * min(BLIND_SPEED, hypot(linear, angular * RADIUS))


@settings(deadline=None, max_examples=12)
@given(st.floats(-pi, pi), st.lists(speeds, min_size=4, max_size=4), circles)
def test_nothing_on_ground_once_seen_is_touched(heading, wishes, things):
    """The robot has turned round once, and so has seen what stands around it."""
    world = ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(2.0, 2.0, heading), things, beams=360)
    assume(all(hypot(x - 2.0, y - 2.0) - radius > RADIUS + 0.05 for x, y, radius in things))
    for _ in range(45):
        world.drive(Twist(angular=3.0))
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    for wish in wishes:
        list(drive(world, safety, Twist(*wish), 0.6))
    assert world.nearest > 0.0


def share(twist, unseen_from, **more):
    """Share for a toy robot when all ground with x below `unseen_from` is unseen."""
    stamps = np.ones((80, 80))
    stamps[:, : round((unseen_from + 2.0) / 0.05)] = -np.inf
    ground = SeenGround(stamps, (-2.0, -2.0), 0.05, 0.0, Pose2D(0.0, 0.0), np.empty((0, 7)))
    settings = {"reaction": 0.1, "braking": 0.2, "slowest": 0.15, **more}
    return UnseenGroundLimit(robot()).share(twist, ground, **settings)


def test_the_share_leaves_the_distance_to_slow_down_before_unseen_ground():
    """Reverse at 1 m/s, the rear edge 0.15 m from unseen ground. Cells are 5 cm, steps half a cell:
    it is entered after 0.15 to 0.175 s, less 0.075 s for the diagonal of a cell. The roots of
    0.075 = 0.1 s + 0.2 (s² - 0.15²) and of 0.1 = … are 0.428 and 0.515; of 0.475 = … more."""
    assert share(Twist(-1.0), -0.8) == 1.0
    assert 0.428 <= share(Twist(-1.0), -0.4) <= 0.515
    assert share(Twist(-1.0), -0.25) == pytest.approx(0.15)
    assert share(Twist(1.0), -0.25) == 1.0
    assert share(Twist(-0.15), -0.25) == 1.0


def test_a_robot_that_sees_all_around_has_no_seen_ground():
    world = ToyWorld(room(4, 4), robot(), Pose2D(2.0, 2.0))
    assert world.obstacles.ground is None
    assert ToyWorld(room(4, 4), BLIND_BEHIND, Pose2D(2.0, 2.0)).obstacles.ground is not None
