"""Frontiers and lanes in small maps, worked out by hand."""

from itertools import pairwise

import numpy as np
import pytest

from stack.geometry.travel.kernels import UNREACHED, travel_distances
from stack.mapping.exploration.coverage import coverage_plan
from stack.mapping.exploration.frontiers import (
    VIEW_SPACING,
    FrontierParameters,
    frontiers_of,
    known_area,
    passable_cells,
)
from stack.types import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Pose2D

RESOLUTION = 0.1


def grid_of(cells):
    return OccupancyGrid(np.asarray(cells, np.int8), RESOLUTION)


def room(width, height):
    """A room of free cells with walls around it, sides in metres."""
    cells = np.full((round(height / RESOLUTION), round(width / RESOLUTION)), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    return cells


def test_travel_distances_go_around_walls_and_not_through_corners():
    passable = np.ones((5, 5), np.uint8)
    passable[:4, 2] = 0
    tenths = travel_distances(passable, 0, 0)
    assert tenths[4, 0] == 40
    assert tenths[0, 4] == 108  # 14 + 30 down, 20 across, 30 up, 14
    passable[4, 2] = 0
    assert travel_distances(passable, 0, 0)[0, 4] == UNREACHED


def test_the_end_of_the_known_part_of_a_corridor_is_a_frontier():
    """A corridor 1 m wide, unknown after 3 m: 2 m of it count, 2 m²; cells at walls do not."""
    cells = room(6.0, 1.2)
    cells[1:-1, 31:-1] = UNKNOWN
    found = frontiers_of(grid_of(cells), Pose2D(0.6, 0.6), 0.2)
    assert len(found) == 1
    (frontier,) = found
    assert frontier.middle == pytest.approx((3.05, 0.6), abs=0.06)
    assert frontier.size == pytest.approx(0.8)
    assert frontier.distance == pytest.approx(2.45, abs=0.15)
    assert frontier.gain == pytest.approx(2.0, abs=0.4)
    assert abs(frontier.pose.heading) < 0.3


def corridor_with_a_door():
    """A corridor 1 m wide, unknown after 3 m; a door at 2.3 to 2.7 m leads to an unknown room."""
    cells = room(6.0, 3.2)
    cells[11, :] = OCCUPIED
    cells[11, 23:27] = FREE
    cells[12:-1, 1:-1] = cells[1:11, 31:-1] = UNKNOWN
    return grid_of(cells)


def test_the_view_with_the_most_to_see_is_chosen():
    """From the door the robot sees the end of the corridor and into the room."""
    (frontier,) = frontiers_of(corridor_with_a_door(), Pose2D(0.6, 0.6), 0.2)
    assert frontier.middle == pytest.approx((3.05, 0.6), abs=0.06)
    assert 2.3 <= frontier.pose.x <= 2.7
    assert frontier.gain > 2.4, "2 m² of the corridor alone"


def test_views_to_which_no_way_leads_are_not_returned_again():
    grid, avoided = corridor_with_a_door(), []
    for _ in range(3):
        (frontier,) = frontiers_of(grid, Pose2D(0.6, 0.6), 0.2, avoided=avoided)
        assert all(frontier.pose.distance_to(view) > VIEW_SPACING for view in avoided)
        avoided.append(frontier.pose)
    everywhere = [Pose2D(2.0 + 0.3 * k, y) for k in range(5) for y in (0.3, 0.6, 0.9)]
    assert frontiers_of(grid, Pose2D(0.6, 0.6), 0.2, avoided=everywhere) == []


def test_frontiers_behind_a_passage_that_is_too_narrow_are_not_reachable():
    cells = room(6.0, 3.0)
    cells[:, 30] = OCCUPIED
    cells[14:18, 30] = FREE  # 0.4 m
    cells[1:-1, 45:-1] = UNKNOWN
    assert len(frontiers_of(grid_of(cells), Pose2D(1.0, 1.0), 0.1)) == 1
    assert frontiers_of(grid_of(cells), Pose2D(1.0, 1.0), 0.25) == []


def test_gaps_between_beams_and_views_that_show_little_do_not_count():
    cells = room(4.0, 4.0)
    cells[20, 1:4] = UNKNOWN
    assert frontiers_of(grid_of(cells), Pose2D(2.0, 1.0), 0.2) == []
    few = FrontierParameters(least_size=0.1, least_gain=0.0)
    assert len(frontiers_of(grid_of(cells), Pose2D(2.0, 1.0), 0.2, few)) >= 1


def test_a_known_map_has_no_frontiers_and_its_area():
    cells = room(4.0, 3.0)
    assert frontiers_of(grid_of(cells), Pose2D(1.0, 1.0), 0.2) == []
    assert known_area(grid_of(cells)) == pytest.approx(12.0)
    cells[:15] = UNKNOWN
    assert known_area(grid_of(cells)) == pytest.approx(6.0)


def covered_share(plan, width):
    """Share of the plan's points within half a width of a lane, by dense sampling."""
    on = np.concatenate([
        np.column_stack([np.linspace(a.x, b.x, 200), np.linspace(a.y, b.y, 200)])
        for a, b in plan.lanes
    ])  # fmt: skip
    near = [np.hypot(*(on - point).T).min() <= width / 2 for point in plan.points]
    return float(np.mean(near))


def test_lanes_cover_an_empty_room_back_and_forth():
    """4 m x 3 m inside, radius 0.25: 8 or 9 lanes at 0.35 m along the longer side."""
    plan = coverage_plan(grid_of(room(4.2, 3.2)), Pose2D(0.5, 0.5), 0.25, 0.35)
    assert 7 <= len(plan.lanes) <= 9
    for start, end in plan.lanes:
        assert abs(end.x - start.x) > 3.0 and abs(end.y - start.y) < 0.1
    heads = [np.sign(end.x - start.x) for start, end in plan.lanes]
    assert all(one == -other for one, other in pairwise(heads))
    assert covered_share(plan, 0.5) > 0.95


def test_lanes_go_around_a_pillar_in_cells():
    cells = room(4.2, 3.2)
    cells[12:20, 17:25] = OCCUPIED
    grid = grid_of(cells)
    plan = coverage_plan(grid, Pose2D(0.5, 0.5), 0.2, 0.3)
    passable = passable_cells(grid, 0.15)  # a cell less: ends of lanes may be on its edge
    for start, end in plan.lanes:
        for share in np.linspace(0.0, 1.0, 50):
            at = (start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
            assert passable[grid.cell_at(*at)]
    assert covered_share(plan, 0.45) > 0.9


def test_only_the_room_of_the_robot_or_the_polygon_is_covered():
    cells = room(8.2, 3.2)
    cells[:, 41] = OCCUPIED
    cells[12:21, 41] = FREE  # a door of 0.9 m
    plan = coverage_plan(grid_of(cells), Pose2D(1.0, 1.0), 0.2, 0.3)
    assert max(max(a.x, b.x) for a, b in plan.lanes) < 4.2
    corners = np.array([[5.0, 0.5], [7.0, 0.5], [7.0, 2.0], [5.0, 2.0]])
    plan = coverage_plan(grid_of(cells), Pose2D(1.0, 1.0), 0.2, 0.3, corners)
    xs = [value for a, b in plan.lanes for value in (a.x, b.x)]
    assert min(xs) > 4.9 and max(xs) < 7.1
    assert len(plan.points) * RESOLUTION**2 == pytest.approx(3.0, abs=0.3)


def test_a_map_that_is_only_beginning_has_no_frontiers():
    empty = OccupancyGrid(np.zeros((0, 0), np.int8), 0.05, (0.0, 0.0))
    assert frontiers_of(empty, Pose2D(0.0, 0.0), 0.2) == []
