"""Motions in tight places: what is clear there, and what is done where no arc to the path is."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest

from stack.components import ControlState
from stack.control.pure_pursuit.controller import PurePursuit
from stack.control.pure_pursuit.manoeuvres import REACH, ArcPrimitive, Manoeuvres
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.control.swept import SweptFootprint
from stack.drivetrain.kinematics import moved
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, CostGrid, Footprint, Pose2D, Twist
from tests.stack.control.driver import Driver
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import RECTANGLE, moving, robot

CELL = 0.05
AHEAD = PathSegment(polyline((3, 3), (5, 3)))


def lane(width):
    """A corridor along y = 3 between walls of one cell, its walls' middles that far apart."""
    cells = np.zeros((120, 120), np.uint8)
    rows = [round((3.0 + side * width / 2) / CELL - 0.5) for side in (-1, 1)]
    cells[rows] = 254
    return CostGrid(cells, CELL), (rows[1] - rows[0]) * CELL


def state(costs, pose, points=None):
    return ControlState(0.0, pose, STANDSTILL, costs, points=points)


def manoeuvres(robot_=None, points=None, pose=None):
    described = robot_ or robot()
    swept = SweptFootprint(described.footprint, padding=0.02, exact=True)
    if points is not None:
        swept.see(pose.transform(points))
    return Manoeuvres(swept, described)


def test_cells_as_points_leave_the_way_open_that_whole_cells_shut():
    """0.45 m between middles of cells: 5 cm more than the body, 0 between their edges."""
    costs, apart = lane(0.45)
    assert apart == pytest.approx(0.45)
    pose = Pose2D(3.0, 3.0, 0.02)
    whole, points = SweptFootprint(RECTANGLE), SweptFootprint(RECTANGLE, exact=True)
    assert whole.arc(costs, pose, Twist(1.0), 1.0)[0] < 1.0
    assert points.arc(costs, pose, Twist(1.0), 1.0)[0] == inf


def test_arcs_keep_the_padding_from_what_the_scan_shows():
    """A post 1 m ahead of the base, the nose 0.25 m before it: 0.73 m are clear of 2 cm."""
    costs = CostGrid(np.zeros((120, 120), np.uint8), CELL)
    swept = SweptFootprint(RECTANGLE, padding=0.02, exact=True)
    pose = Pose2D(3.0, 3.0, pi / 3)
    swept.see(pose.transform(np.array([[1.0, 0.0]])))
    assert swept.arc(costs, pose, Twist(1.0), 2.0)[0] == pytest.approx(0.73, abs=0.005)
    assert swept.arc(costs, pose, Twist(-1.0), 2.0)[0] == inf


def test_a_round_robot_that_touches_a_wall_turns_away_from_it():
    """Its outline is a 16-gon whose corners are 4 mm farther out than its edges: no motion is free.
    The scout stood for minutes where people had pushed it against a wall."""
    wall = np.array([(x, -0.215) for x in np.arange(-1.0, 1.0, 0.01)])
    driver = Driver(PurePursuit, PurePursuitParameters(), robot(Footprint.circle(0.22)), 0.05)
    driver.set_path(polyline((3, 3), (3, 5)))
    now = state(CostGrid(np.zeros((120, 120), np.uint8), CELL), Pose2D(3.0, 3.0, 0.1), wall)
    twist = driver.command(now)
    assert twist.linear == 0.0 and twist.angular > 0.0
    assert driver.controller._turns.twist(now, STANDSTILL, 1.4) is None


def test_a_leg_knows_what_is_left_of_it():
    arc = ArcPrimitive.of(Pose2D(1.0, 1.0, pi / 2), Twist(-1.0, 0.5), 0.25)
    assert arc.left(Pose2D(1.0, 1.0, pi / 2)) == pytest.approx(0.25, abs=0.01)
    assert arc.left(arc.end) == pytest.approx(0.0)
    turn = ArcPrimitive.of(Pose2D(0.0, 0.0, 3.0), Twist(angular=1.0), 0.5)
    assert turn.left(Pose2D(0.0, 0.0, -3.0)) == pytest.approx(0.5 + 3.0 - (2 * pi - 3.0))


def test_in_a_lane_it_goes_on_along_it():
    costs, _ = lane(0.5)
    found = manoeuvres().ahead(state(costs, Pose2D(3.0, 3.0)), AHEAD)
    assert found is not None
    assert found.twist == Twist(1.0, 0.0) and found.span == pytest.approx(REACH)


def askew(heading, room):
    """On the path at an angle to it, a corner that near to a wall along it: finder and state."""
    costs, _ = lane(3.0)
    pose = Pose2D(3.3, 3.0, heading)
    side = pose.transform(RECTANGLE.points)[:, 1].min() - room
    points = pose.inverse().transform(np.array([(x, side) for x in np.arange(2.5, 4.5, 0.01)]))
    return manoeuvres(points=points, pose=pose), state(costs, pose, points)


def test_a_little_askew_it_swings_along_the_wall():
    found, now = askew(-0.5, 0.05)
    leg = found.ahead(now, AHEAD)
    assert leg is not None and leg.twist.angular > 0.0
    assert abs(leg.end.heading) < 0.1
    assert found.room(now, leg) == pytest.approx(leg.left(now.pose))


def test_a_lot_askew_it_turns_first():
    found, now = askew(-0.9, 0.025)
    assert found.ahead(now, AHEAD) is None
    first, then = found.around(now, AHEAD)
    assert first.twist == Twist(angular=1.0) and first.span == pytest.approx(1.0)
    assert then.twist.linear == 1.0
    assert then.end.distance_to(Pose2D(3.6, 3.0)) < 0.03 and abs(then.end.heading) < 0.1
    assert found.room(now, first) == pytest.approx(first.span)


def test_it_does_not_drive_on_where_all_arcs_lead_away_from_the_path():
    """On the path, 1.2 rad askew to the left, a wall beside the right side: straight on is clear,
    but 0.3 m of it gain 0.11 m along the path and lose 0.28 m beside it."""
    costs, _ = lane(3.0)
    pose = Pose2D(3.3, 3.0, 1.2)
    beside = np.array([(x, -0.225) for x in np.arange(-0.6, 0.9, 0.01)])
    found, now = manoeuvres(points=beside, pose=pose), state(costs, pose, beside)
    straight = ArcPrimitive.of(pose, Twist(1.0), REACH)
    assert found.room(now, straight) == pytest.approx(REACH)
    assert found.ahead(now, AHEAD) is None


def test_there_is_room_up_to_the_padding():
    """The nose is 0.25 m before the base, a wall 0.4 m: 0.13 m are clear of 2 cm."""
    costs, _ = lane(3.0)
    pose = Pose2D(3.3, 3.0)
    wall = np.array([(0.4, y) for y in np.arange(-0.3, 0.31, 0.01)])
    found, now = manoeuvres(points=wall, pose=pose), state(costs, pose, wall)
    arc = ArcPrimitive.of(pose, Twist(1.0), 0.25)
    assert found.room(now, arc) == pytest.approx(0.13, abs=0.005)
    open_ = manoeuvres()
    assert open_.room(state(costs, Pose2D(3.5, 3.0)), arc) == pytest.approx(0.05)
    assert open_.room(state(costs, Pose2D(3.6, 3.0)), arc) == 0.0


@pytest.mark.parametrize(("nose", "motions"), [(0.3, 2), (0.28, 3)])
def test_before_a_wall_it_takes_motions_that_cost_more_than_they_gain(nose, motions):
    """On the path, 0.4 rad askew, 5 or 3 cm before a wall: it reverses once or twice, then drives
    on less askew. Each short reverse costs more than 0.4 rad are worth, but to stand is worse."""
    costs, _ = lane(3.0)
    pose = Pose2D(3.3, 3.0, 0.4)
    walls = np.array([(x, y) for x in (nose, -0.6) for y in np.arange(-0.4, 0.41, 0.02)])
    found, now = manoeuvres(points=walls, pose=pose), state(costs, pose, walls)
    assert found.ahead(now, AHEAD) is None
    legs = found.around(now, AHEAD)
    assert len(legs) == motions
    assert [leg.twist.linear for leg in legs] == [-1.0] * (motions - 1) + [1.0]
    assert abs(legs[-1].end.heading) < 0.3


def test_a_car_neither_turns_in_place_nor_on_arcs_it_cannot_drive():
    costs, _ = lane(3.0)
    car = moving("ackermann")
    wall = np.array([(0.45, y) for y in np.arange(-1.0, 1.0, 0.02)])
    pose = Pose2D(3.3, 2.8, 0.0)
    found = manoeuvres(car, wall, pose).around(state(costs, pose, wall), AHEAD)
    for leg in found:
        assert leg.twist.linear
        assert abs(leg.twist.angular) <= 1.0 / car.turning_radius + 1e-9


def test_shut_in_it_finds_nothing():
    costs, _ = lane(3.0)
    around = [(x, y) for x in np.arange(-0.3, 0.31, 0.02) for y in (-0.225, 0.225)]
    around += [(x, y) for y in np.arange(-0.22, 0.23, 0.02) for x in (-0.275, 0.275)]
    points, pose = np.array(around), Pose2D(3.0, 3.0)
    found = manoeuvres(points=points, pose=pose)
    now = state(costs, pose, points)
    assert found.ahead(now, AHEAD) is None and found.around(now, AHEAD) == ()


def test_pure_pursuit_does_not_dodge_what_stands_on_the_path():
    """It waits instead: somebody may be about to step aside."""
    described = robot()
    driver = Driver(PurePursuit, PurePursuitParameters(), described, 0.05)
    cells = np.zeros((120, 120), np.uint8)
    cells[56:64, 66:72] = 254
    cells[50:70, 60:78] = np.maximum(cells[50:70, 60:78], 253)
    costs, pose = CostGrid(cells, CELL), Pose2D(3.02, 3.0)
    driver.set_path(polyline((2, 3), (5, 3)))
    points = np.array([(0.28, y) for y in np.arange(-0.2, 0.2, 0.01)])
    assert driver.command(state(costs, pose, points)) == STANDSTILL


def test_it_does_not_creep_up_to_what_its_arc_touches_where_another_arc_leads_past_it():
    """A post 20 cm beside the path: the arc back to it is shut, a flatter one is not. Before, the
    robot crept at 5 cm/s for 0.7 s, until it was 6 cm before the post."""
    pose, speeds = Pose2D(3.0, 3.0, -0.4), []
    post = Pose2D(3.3, 3.0, -0.4).transform(np.array([(0.36, -0.05)]))
    driver = Driver(PurePursuit, PurePursuitParameters(), robot(), 0.05)
    driver.set_path(polyline((2, 3), (5, 3)))
    costs, twist = lane(3.0)[0], STANDSTILL
    while pose.x < 4.0:
        seen = pose.inverse().transform(post)
        now = ControlState(0.05 * len(speeds), pose, twist, costs, points=seen)
        twist = driver.command(now)
        pose = pose.compose(moved(twist, 0.05))
        speeds.append(twist.linear)
    assert min(speeds[10:]) >= 0.1


@pytest.mark.parametrize(("cruise", "speed"), [(0.1, 0.1), (0.8, 0.12)])
def test_a_manoeuvre_is_no_faster_than_the_cruise_speed_or_than_the_robot_reverses(cruise, speed):
    described = replace(robot(), limits=replace(robot().limits, reverse_speed=0.12))
    parameters = PurePursuitParameters(cruise_speed=cruise)
    driver = Driver(PurePursuit, parameters, described, 0.05)
    driver.set_path(polyline((2, 3), (5, 3)))
    back = ArcPrimitive.of(Pose2D(3.3, 3.0), Twist(-1.0), 0.4)
    driver.controller._manoeuvre._primitives = (back,)
    twist = STANDSTILL
    for step in range(10):
        now = ControlState(0.05 * step, Pose2D(3.3, 3.0), twist, lane(3.0)[0])
        twist = driver.command(now)
    assert twist.linear == pytest.approx(-speed)


def test_a_search_for_three_motions_without_result_rests_for_half_a_second(monkeypatch):
    """It takes most of a step; an operator's command must not wait for it in every one."""
    costs, _ = lane(3.0)
    pose = Pose2D(3.3, 3.0)  # on the path, headed along it: no motion gains 3 cm
    ahead = np.array([(0.28, y) for y in np.arange(-0.19, 0.2, 0.01)])
    found = manoeuvres(points=ahead, pose=pose)
    checked = []
    free_times = SweptFootprint.free_times

    def count(self, costs, poses, twists, horizons):
        checked.append(len(poses) * len(twists))
        return free_times(self, costs, poses, twists, horizons)

    monkeypatch.setattr(SweptFootprint, "free_times", count)
    for step in range(21):
        now = ControlState(0.05 * step, pose, STANDSTILL, costs, points=ahead)
        assert found.around(now, AHEAD) == ()
    long = [step for step in checked if step > 1000]
    assert len(long) == 3, "at 0, 0.5 and 1 s"


class Manoeuvring:
    """Pure pursuit in the middle of a manoeuvre: 0.25 m ahead, then 0.4 m back."""

    def __init__(self, points):
        self.driver = Driver(PurePursuit, PurePursuitParameters(), robot(), 0.05)
        self.driver.set_path(polyline((3, 3), (5, 3)))
        self.costs, self.points, self.time = lane(3.0)[0], points, 0.0
        ahead = ArcPrimitive.of(Pose2D(3.3, 3.0), Twist(1.0), 0.25)
        self.motions = ahead, ArcPrimitive.of(ahead.end, Twist(-1.0), 0.4)
        self.driver.controller._manoeuvre._primitives = self.motions

    def command(self, pose, twist=STANDSTILL):
        self.time += 0.05
        seen = pose.inverse().transform(self.points)
        return self.driver.command(ControlState(self.time, pose, twist, self.costs, points=seen))

    @property
    def left(self):
        return self.driver.controller._manoeuvre._primitives


@pytest.mark.parametrize(
    ("wall", "x", "left"), [(4.5, 3.34, 2), (3.7, 3.34, 2), (3.7, 3.42, 1), (4.5, 3.54, 1)]
)
def test_a_motion_is_driven_as_far_as_there_is_room_and_the_next_one_follows(wall, x, left):
    """A wall at 3.7 m leaves 3.7 - 0.25 - 0.015 m for the base: 3.435 instead of 3.55 m. The rest
    of the manoeuvre was planned from about there and is still what leads on."""
    points = np.array([(wall, y) for y in np.arange(2.7, 3.3, 0.01)])
    manoeuvring = Manoeuvring(points)
    twist = manoeuvring.command(Pose2D(x, 3.0))
    assert manoeuvring.left == manoeuvring.motions[-left:]
    assert (twist.linear > 0.0) == (left == 2)


@pytest.mark.parametrize(("share", "ends"), [(0.0, True), (0.1, True), (0.5, False)])
def test_a_motion_that_something_else_holds_ends_after_half_a_second(share, ends):
    """The safety stage keeps more distance than the plan. A robot that it holds, or lets creep at a
    tenth of the commanded speed, goes on with the next motion; one at half of it does not."""
    manoeuvring = Manoeuvring(np.array([[4.5, 3.0]]))
    measured = STANDSTILL
    for _ in range(10):
        twist = manoeuvring.command(Pose2D(3.3, 3.0), measured)
        assert manoeuvring.left == manoeuvring.motions
        measured = Twist(share * twist.linear)
    for _ in range(5):
        twist = manoeuvring.command(Pose2D(3.3, 3.0), measured)
        measured = Twist(share * twist.linear)
    assert manoeuvring.left == manoeuvring.motions[ends:]
    assert (twist.linear < 0.0) == ends


def test_motions_are_driven_at_an_even_pace_almost_to_their_end():
    """From 0.15 m/s the robot stops within 4 cm; it does not slow down 15 cm before the end."""
    manoeuvring = Manoeuvring(np.array([[4.5, 3.0]]))
    for x in (3.3, 3.3, 3.3, 3.35, 3.4, 3.45):
        twist = manoeuvring.command(Pose2D(x, 3.0), Twist(0.15))
    assert twist.linear == pytest.approx(0.15)
