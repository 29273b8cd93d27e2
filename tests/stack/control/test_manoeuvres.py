"""Motions in tight places: what is clear there, and what is done where no arc to the path is."""

from __future__ import annotations

from math import inf, pi

import numpy as np
import pytest

from stack.components import ControlState
from stack.control.manoeuvre import REACH, ArcPrimitive, Manoeuvres
from stack.control.pure_pursuit import PurePursuit, PurePursuitParameters
from stack.control.swept import SweptFootprint
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, CostGrid, Pose2D, Twist
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
        swept.seen = pose.transform(points)
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
    swept.seen = pose.transform(np.array([[1.0, 0.0]]))
    assert swept.arc(costs, pose, Twist(1.0), 2.0)[0] == pytest.approx(0.73, abs=0.005)
    assert swept.arc(costs, pose, Twist(-1.0), 2.0)[0] == inf


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
    assert abs(leg.end.heading) < 0.1 and found.is_clear(now, leg)


def test_a_lot_askew_it_turns_first():
    found, now = askew(-0.9, 0.025)
    assert found.ahead(now, AHEAD) is None
    first, then = found.around(now, AHEAD)
    assert first.twist == Twist(angular=1.0) and first.span == pytest.approx(1.0)
    assert then.twist.linear == 1.0
    assert then.end.distance_to(Pose2D(3.6, 3.0)) < 0.03 and abs(then.end.heading) < 0.1
    assert found.is_clear(now, first)


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
