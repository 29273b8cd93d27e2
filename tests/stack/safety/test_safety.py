from dataclasses import replace
from math import inf, nan, pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.safety.monitor import CollisionMonitor
from stack.safety.parameters import SafetyParameters
from stack.types import (
    STANDSTILL,
    ContactZone,
    Footprint,
    ObstaclePoints,
    Odometry,
    Pose2D,
    Scan,
    Twist,
)
from tests.stack.navigation.toy_world import RECTANGLE, ToyWorld, moving, robot, room
from tests.stack.safety.obstacles import SafetyStage, drive_until_still, seen, standing

PERIOD = 0.05
LONG = Footprint(np.array([[-0.2, -0.15], [0.6, -0.15], [0.6, 0.15], [-0.2, 0.15]]))
L_SHAPE = Footprint(
    np.array([[-0.3, -0.3], [0.3, -0.3], [0.3, 0.0], [0.0, 0.0], [0.0, 0.3], [-0.3, 0.3]])
)


def run(world, wanted, seconds, safety=None, **more):
    """Drive with one wish for some seconds; the twists that were let through."""
    safety = safety or SafetyStage(world.robot, SafetyParameters(), world.period)
    driven = []
    for _ in range(round(seconds / world.period)):
        twist = safety.limit(wanted, world.odometry, world.obstacles, **more)
        driven.append(twist)
        world.drive(twist)
    return driven


@settings(deadline=None, max_examples=65)
@given(
    st.sampled_from([RECTANGLE, Footprint.circle(0.25), LONG, L_SHAPE]),
    st.floats(0.6, 3.4), st.floats(0.6, 3.4), st.floats(-pi, pi),
    st.floats(-0.3, 0.8), st.floats(-1.8, 1.8),
    st.lists(
        st.tuples(st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.1, 0.4)), max_size=5
    ),
)  # fmt: skip
def test_no_command_causes_a_contact(footprint, x, y, heading, linear, angular, circles):
    """In a room as small as this, two of three robots come within 10 cm of something."""
    world = ToyWorld(room(4, 4), robot(footprint), Pose2D(x, y, heading), circles, beams=720)
    assume(world.clearance() > 0.05)
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    drive_until_still(world, safety, Twist(linear, angular), 5.0)
    assert world.nearest > 0.0


@settings(deadline=None, max_examples=25)
@given(
    st.floats(1.5, 2.5), st.floats(1.5, 2.5), st.floats(-pi, pi),
    st.lists(st.tuples(st.floats(-0.3, 0.8), st.floats(-1.8, 1.8)), min_size=12, max_size=12),
)  # fmt: skip
def test_changing_commands_cause_no_contact(x, y, heading, wishes):
    """Every fourth robot comes within 10 cm of a wall."""
    world = ToyWorld(room(4, 4), robot(LONG), Pose2D(x, y, heading), beams=720)
    safety = SafetyStage(world.robot, SafetyParameters(), world.period)
    for linear, angular in wishes:
        drive_until_still(world, safety, Twist(linear, angular), 1.0)
    assert world.nearest > 0.0


def test_it_slows_in_proportion_and_stops_short_of_a_wall():
    world = ToyWorld(room(8, 8), robot(), Pose2D(4.0, 4.0))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    driven = run(world, Twist(0.8), 4.5, safety)
    assert max(twist.linear for twist in driven) == pytest.approx(0.8)
    assert safety.reason.startswith("slower: obstacle ")
    run(world, Twist(0.8), 6.0, safety)
    assert safety.reason.startswith("stopped: obstacle 0.")
    assert "ahead" in safety.reason
    # the nose stops `padding` from the wall, plus what is too little to creep over: 0.02 m
    assert world.clearance() == pytest.approx(0.03 + 0.02, abs=0.015)


def test_a_clear_twist_is_not_limited():
    world = ToyWorld(room(8, 1.0), robot(), Pose2D(1.0, 0.5))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    driven = run(world, Twist(0.5), 3.0, safety)
    assert driven[-1] == Twist(0.5)
    assert safety.reason == ""


def test_a_long_robot_may_not_turn_its_nose_into_a_wall_but_may_turn_away():
    at_the_wall = Pose2D(4.0, 0.3, 0.0)  # beside the wall at y = 0, 15 cm from it
    world = ToyWorld(room(8, 8), robot(LONG), at_the_wall, beams=720)
    run(world, Twist(angular=-1.0), 5.0)
    assert -0.35 < world.pose.heading < -0.05
    assert world.nearest > 0.0
    run(world, Twist(angular=1.0), 1.5)
    assert world.pose.heading > 0.5


def test_it_may_move_away_from_a_point_inside_the_padding_but_not_nearer():
    world = ToyWorld(room(8, 8), robot(), Pose2D(0.26, 4.0, pi), beams=720)  # nose 1 cm off
    assert run(world, Twist(0.3), 1.0)[-1] == STANDSTILL
    run(world, Twist(-0.3), 2.0)
    assert world.pose.x > 0.6
    assert world.nearest > 0.0


def test_the_time_to_contact_is_exact_for_a_straight_line_and_a_turn():
    monitor = CollisionMonitor(robot(LONG))
    wall = np.array([[1.63, 0.0]])
    contact = monitor.contact(Twist(0.5), wall, 5.0, 0.03)
    assert contact.time == pytest.approx((1.63 - 0.6 - 0.03) / 0.5, abs=0.01)
    beside = np.array([[0.0, 0.5]])  # the nose's corner at 14 degrees comes round to 90
    turn = monitor.contact(Twist(angular=1.0), beside, 5.0, 0.0)
    # first contact with the left edge y = 0.15 of the nose: asin(0.15 / 0.5) before 90 degrees
    assert turn.time == pytest.approx(pi / 2 - np.arcsin(0.15 / 0.5), abs=0.02)
    assert monitor.contact(Twist(-0.5), wall, 5.0, 0.03).time == inf


@pytest.mark.parametrize("angular", [0.4, -0.4])
@pytest.mark.parametrize("course", [0.0, pi / 2, -pi / 2, pi, 2.5])
def test_the_time_to_contact_is_exact_on_an_arc_in_any_direction(course, angular):
    """A circle of 0.28 m on an arc of R = 0.4 / 0.4 = 1 m, a point 90 degrees along that arc.

    Both are 2 R sin(a / 2) apart when the arc between them is a: contact 2 asin(0.14) before.
    """
    monitor = CollisionMonitor(robot(Footprint.circle(0.25)))
    c, s, side = np.cos(course), np.sin(course), np.copysign(1.0, angular)
    point = np.array([[c - s * side, s + c * side]])
    twist = Twist(0.4 * c, angular, 0.4 * s)
    contact = monitor.contact(twist, point, 5.0, 0.03)
    # the 16-gon that stands for the circle is up to 5 mm inside it: 0.012 s at 0.4 m/s
    assert contact.time == pytest.approx((pi / 2 - 2.0 * np.arcsin(0.14)) / 0.4, abs=0.02)


def test_a_point_in_the_notch_of_an_l_shape_is_outside():
    monitor = CollisionMonitor(robot(L_SHAPE))
    notch = np.array([[0.15, 0.15]])
    assert monitor.contact(Twist(angular=0.2), notch, 0.2, 0.03).time == inf
    assert monitor.contact(Twist(0.5), notch, 2.0, 0.03).time == pytest.approx(0.24, abs=0.01)


@pytest.mark.pain("s720", "s543", "s465")
def test_an_old_or_missing_scan_stops_the_robot_and_says_so():
    world = ToyWorld(room(8, 8), robot(), Pose2D(2.0, 4.0))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    run(world, Twist(0.5), 1.0, safety)
    world.frozen_scan = True
    driven = run(world, Twist(0.5), 1.0, safety)
    assert driven[3].linear > 0.4  # 0.3 s are allowed
    assert driven[-1] == STANDSTILL
    assert safety.reason == "stopped: the newest lidar scan is 0.95 s old"
    safety.limit(Twist(0.5), standing(), seen(world.robot))
    assert safety.reason == "stopped: no lidar scan yet"


def test_a_robot_that_cannot_see_drives_at_most_at_the_blind_speed():
    blind = robot(lidar=False)
    safety = SafetyStage(blind, SafetyParameters(), PERIOD)
    for _ in range(20):
        twist = safety.limit(Twist(0.5, 0.2), standing(9.0), seen(blind, 9.0))
    # its fastest point is the front right corner: hypot(0.5 + 0.2 · 0.2, 0.2 · 0.25) = 0.5423 m/s
    share = 0.15 / 0.5423
    assert twist.linear == pytest.approx(0.5 * share, rel=1e-3)
    assert twist.angular == pytest.approx(0.2 * share, rel=1e-3)
    assert safety.reason == "slower: no sensor has seen this ground"


@pytest.mark.parametrize(("course", "speed"), [(0.0, 0.5), (2.0, 0.15), (2.7, 0.15), (pi, 0.15)])
def test_the_speed_is_limited_towards_a_blind_sector(course, speed):
    """A lidar of 270 degrees in the middle is blind from 135 degrees on to both sides.

    At a course of 2.0 its rear corner, at 141 degrees, enters ground that it has not seen yet.
    """
    kind = moving("omni", reverse_speed=0.8)
    described = replace(kind, lidar=replace(kind.lidar, field_of_view=1.5 * pi))
    scan = Scan(0.0, np.full(270, np.inf, np.float32), -0.75 * pi, pi / 180, 0.05, 12.0)
    safety = SafetyStage(described, SafetyParameters(), PERIOD)
    for _ in range(30):
        twist = safety.limit(
            Twist(0.5 * np.cos(course), 0.0, 0.5 * np.sin(course)),
            standing(), seen(described, lidar=scan),
        )  # fmt: skip
    assert np.hypot(twist.linear, twist.lateral) == pytest.approx(speed)


def test_speeds_rise_and_fall_no_faster_than_the_robot_can():
    world = ToyWorld(room(30, 30), robot(), Pose2D(5.0, 15.0))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    up = [t.linear for t in run(world, Twist(0.8, 1.0), 1.0, safety)]
    down = [t.linear for t in run(world, Twist(-0.3), 1.0, safety)]
    assert up[0] == pytest.approx(0.05)  # 1.0 m/s² · 0.05 s
    assert np.diff(up).max() == pytest.approx(0.05)
    assert np.diff(down).min() == pytest.approx(-0.075)  # 1.5 m/s² · 0.05 s
    assert down[-1] == pytest.approx(-0.3)


def test_the_speed_limit_keeps_the_arc():
    world = ToyWorld(room(30, 30), robot(), Pose2D(15.0, 15.0))
    safety = SafetyStage(world.robot, replace(SafetyParameters(), top_speed=0.4), PERIOD)
    last = run(world, Twist(0.8, 0.6), 3.0, safety)[-1]
    assert (last.linear, last.angular) == (pytest.approx(0.4), pytest.approx(0.3))


def test_after_an_emergency_stop_the_speed_rises_from_zero():
    world = ToyWorld(room(8, 8), robot(), Pose2D(2.0, 4.0))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    run(world, Twist(0.5), 1.0, safety)
    stopped = run(world, Twist(0.5), 2.0, safety, emergency_stop="operator")
    assert stopped == [STANDSTILL] * 40
    assert safety.reason == "emergency stop: operator"
    assert run(world, Twist(0.5), 1.0, safety)[0].linear == pytest.approx(0.05)


def test_it_brakes_for_the_arc_that_the_robot_still_drives():
    """It drives 0.8 m/s and turns right at 1.5 rad/s; straight ahead, as wanted, all is clear.

    Braking takes 0.8 / 1.5 = 0.53 s and turning back 1.5 / 3.2 = 0.47 s; both at once share the
    grip: 0.71 s, so it moves on as in 0.15 + 0.71 / 2 = 0.505 s at full speed. On that arc its
    front reaches the point after 0.48 s. The longer of both times alone would give 0.42 s.
    """
    point, empty = np.array([[0.49, -0.36]]), np.empty((0, 2))
    arc, wanted = Twist(0.8, -1.5), Twist(0.8)
    monitor = CollisionMonitor(robot())
    assert monitor.contact(wanted, point, 1.0, 0.03).time == inf
    assert monitor.contact(arc, point, 1.0, 0.0).time == pytest.approx(0.48, abs=0.02)
    safety = SafetyStage(robot(), SafetyParameters(), PERIOD)

    def step(measured, points):
        motion = Odometry(0.0, Pose2D(0.0, 0.0), measured)
        return safety.limit(wanted, motion, ObstaclePoints(0.0, points)).linear

    assert [step(wanted, empty) for _ in range(20)][-1] == pytest.approx(0.8)
    assert step(wanted, point) == pytest.approx(0.8)
    assert step(arc, empty) == pytest.approx(0.8)
    assert step(arc, point) == pytest.approx(0.8 - 0.075)  # 1.5 m/s² · 0.05 s
    assert safety.reason == "braking: obstacle 0.6 m ahead, contact in 0.5 s"


def test_a_robot_that_starts_beside_a_post_starts_on_the_wanted_arc():
    """A post stands 2 cm beside the rear corner, which leaves it on the wanted arc. At rest the
    robot turns faster than it drives off, and on that arc the corner swings into the post."""
    post, wanted = np.array([[-0.23, 0.22]]), Twist(0.5, -0.5)
    monitor = CollisionMonitor(robot())
    assert monitor.contact(wanted, post, 1.0, 0.015).time == inf
    assert monitor.contact(Twist(0.05, -0.16), post, 1.0, 0.015).time < 1.0
    safety = SafetyStage(robot(), SafetyParameters(), PERIOD)
    driven = [safety.limit(wanted, standing(), ObstaclePoints(0.0, post)) for _ in range(6)]
    assert [twist.linear for twist in driven] == pytest.approx([0.05 * n for n in range(1, 7)])
    assert [twist.angular for twist in driven] == pytest.approx([-0.05 * n for n in range(1, 7)])


def test_something_that_is_no_velocity_stops_the_robot():
    world = ToyWorld(room(8, 8), robot(), Pose2D(4.0, 4.0))
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    assert run(world, Twist(nan, 0.1), 0.1, safety)[-1] == STANDSTILL
    assert "not a finite velocity" in safety.reason


@pytest.mark.parametrize(
    ("bearing", "side"),
    [(0.0, "ahead"), (pi / 2, "to the left"), (pi, "behind"), (-pi, "behind"), (-2.0, "to the r")],
)
def test_it_says_on_which_side_something_is(bearing, side):
    ranges = np.full(1, 0.3, np.float32)
    scan = Scan(0.0, ranges, bearing, 0.1, 0.05, 12.0)
    safety = SafetyStage(moving("omni", Footprint.circle(0.25)), SafetyParameters(), PERIOD)
    towards = Twist(0.5 * np.cos(bearing), 0.0, 0.5 * np.sin(bearing))
    safety.limit(towards, standing(), seen(robot(), lidar=scan))
    assert f"0.3 m {side}" in safety.reason


def test_beams_without_return_stand_for_nothing():
    ranges = np.full(360, np.inf, np.float32)
    ranges[::2] = np.nan
    scan = Scan(0.0, ranges, 0.0, 2 * pi / 360, 0.05, 12.0)
    safety = SafetyStage(robot(), SafetyParameters(), PERIOD)
    assert safety.limit(Twist(0.5), standing(), seen(robot(), lidar=scan)).linear > 0.0


@pytest.mark.parametrize("beams", [90, 120, 180, 360])
def test_the_corner_of_a_box_is_not_smoothed_away(beams):
    # It juts 4 mm into the way, and the lidar's few beams lie centimetres apart on it.
    apex, far = (1.5, 0.196), 0.5
    walls = [(*apex, apex[0] + side * far, apex[1] + far) for side in (-1, 1)]
    world = ToyWorld(walls, robot(), Pose2D(0.0, 0.0), beams=beams)
    safety = SafetyStage(world.robot, SafetyParameters(), PERIOD)
    for _ in range(200):
        world.drive(safety.limit(Twist(0.3), world.odometry, world.obstacles))
    assert world.nearest > 0.015
    assert world.pose.x == pytest.approx(1.2, abs=0.05)  # its front is 0.25 m ahead


def test_a_robot_whose_lidars_are_all_further_ones_is_guarded_by_them():
    described = replace(robot(), lidar=None, lidars={"rear": robot().lidar})
    safety = SafetyStage(described, SafetyParameters(), PERIOD)
    assert safety.limit(Twist(0.3), standing(1.0), seen(described, 1.0)) == STANDSTILL
    assert safety.reason == "stopped: no rear scan yet"
    world = ToyWorld(room(4, 4), described, Pose2D(1.0, 2.0), lidar="rear")
    for _ in range(300):
        world.drive(safety.limit(Twist(0.8), world.odometry, world.obstacles))
    assert 0.0 < world.nearest < 0.1


def test_a_robot_may_touch_what_is_in_its_contact_zone_slowly_and_nothing_else():
    def pushed(zone):
        world = ToyWorld(room(4, 4), robot(Footprint.circle(0.25)), Pose2D(3.0, 2.0), beams=720)
        driven = run(world, Twist(0.3), 9.0, contact=zone)
        return world, driven

    stopped, _ = pushed(None)
    assert stopped.nearest > 0.02
    here = stopped.odometry.pose  # the wall is ahead: the robot's radius and the room left
    wall = Pose2D(here.x + 0.25 + stopped.clearance(), here.y)
    touching, driven = pushed(ContactZone(wall, 0.4, 3.0))
    assert touching.nearest < 0.001
    assert max(twist.linear for twist in driven) == pytest.approx(0.1)
    elsewhere = ContactZone(wall.compose(Pose2D(-3.0, 0.0)), 0.4, 3.0)
    assert pushed(elsewhere)[0].nearest > 0.02
