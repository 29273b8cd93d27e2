"""Layers, beams, window and inflation of the costmap, by hand and against Nav2's values."""

from dataclasses import replace
from math import exp, inf, nan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap import kernels
from stack.costmap.costmap import Costmap
from stack.costmap.inflation import inflation_costs
from stack.costmap.parameters import CostmapParameters
from stack.errors import ParameterError
from stack.parameters import build
from stack.types import (
    FREE,
    FREE_COST,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    Footprint,
    OccupancyGrid,
    Pose2D,
    Scan,
)
from tests.stack.costmap.marks import seen, sensed

ROUND = Footprint.circle(0.22)
ONLY_CELLS = CostmapParameters(inflation_radius=0.0)
TINY = Footprint.circle(0.02)


def room(rows=100, columns=120, value=FREE, origin=(-1.0, -2.0)):
    return OccupancyGrid(np.full((rows, columns), value, dtype=np.int8), 0.05, origin)


def scan(ranges, angle_min=0.0, angle_increment=0.01, mount=Pose2D(0.0, 0.0)):
    array = np.array(ranges, dtype=np.float32)
    return Scan(0.0, array, angle_min, angle_increment, 0.08, 12.0, mount)


def at(costmap, x, y):
    return int(costmap.grid.cells[costmap.grid.cell_at(x, y)])


def test_inflation_gives_nav2s_costs_by_hand():
    cells = room()
    cells.cells[50, 60] = OCCUPIED
    costs = Costmap(CostmapParameters(), ROUND, cells).grid.cells
    assert costs[50, 60] == 254
    assert costs[50, 64] == 253  # 0.20 m <= 0.22 m
    assert costs[50, 65] == int(252 * exp(-4.0 * (0.25 - 0.22))) == 223
    assert costs[53, 64] == int(252 * exp(-4.0 * (0.25 - 0.22))) == 223  # 3-4-5
    assert costs[50, 70] == int(252 * exp(-4.0 * (0.50 - 0.22))) == 82
    assert costs[50, 71] == int(252 * exp(-4.0 * (0.55 - 0.22))) == 67
    assert costs[50, 72] == 0  # 0.60 m is beyond the inflation radius


def test_a_090_door_stays_comfortably_open_for_a_022_robot():
    cells = room()
    cells.cells[50] = OCCUPIED
    cells.cells[50, 50:68] = FREE  # 18 cells are 0.9 m
    row = Costmap(CostmapParameters(), ROUND, cells).grid.cells[50, 50:68]
    assert row.argmin() in (8, 9) and row.min() < 126
    assert np.count_nonzero(row < INSCRIBED_COST) >= 9


def test_a_turning_cost_raises_the_cost_where_a_long_robot_cannot_turn():
    oblong = Footprint(np.array([[0.3, -0.2], [0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]]))  # R 0.361 m
    parameters = CostmapParameters(turning_cost=140.0, cost_scaling=5.0)
    table = inflation_costs(parameters, oblong, 0.01)
    assert (table[0], table[20**2]) == (LETHAL_COST, INSCRIBED_COST)
    assert table[28**2] == int(252 - 112 * 0.08 / (13**0.5 / 10 - 0.2))  # straight down to 140 at R
    assert table[46**2] == int(140 * np.exp(-5.0 * (0.46 - 13**0.5 / 10)))
    assert (np.diff(table.astype(int)) <= 0).all()


def test_returns_mark_and_beams_clear_what_they_pass():
    costmap = Costmap(ONLY_CELLS, TINY, room())
    costmap.update(seen(Pose2D(0.025, 0.025), scan([1.0]), 0.0))
    assert at(costmap, 1.025, 0.025) == LETHAL_COST
    costmap.update(seen(Pose2D(0.025, 0.025), scan([2.0]), 0.1))
    assert at(costmap, 1.025, 0.025) == FREE_COST
    assert at(costmap, 2.025, 0.025) == LETHAL_COST


def test_no_return_clears_up_to_the_clearing_range_and_nan_does_nothing():
    parameters = replace(ONLY_CELLS, obstacle_range=2.5, clearing_range=3.0)
    costmap = Costmap(parameters, TINY, None, window=10.0)
    costmap.update(seen(Pose2D(0.025, 0.025), scan([nan]), 0.0))
    assert at(costmap, 0.525, 0.025) == UNKNOWN_COST
    costmap.update(seen(Pose2D(0.025, 0.025), scan([2.0]), 0.1))
    costmap.update(seen(Pose2D(0.025, 0.025), scan([nan]), 0.2))
    assert at(costmap, 2.025, 0.025) == LETHAL_COST
    costmap.update(seen(Pose2D(0.025, 0.025), scan([inf]), 0.3))
    assert at(costmap, 2.025, 0.025) == at(costmap, 2.925, 0.025) == FREE_COST
    assert at(costmap, 3.125, 0.025) == UNKNOWN_COST


def test_a_return_beyond_the_obstacle_range_clears_and_does_not_mark():
    costmap = Costmap(ONLY_CELLS, TINY, None, window=10.0)
    costmap.update(seen(Pose2D(0.025, 0.025), scan([2.8]), 0.0))
    assert not sensed(costmap).any()
    assert at(costmap, 2.725, 0.025) == FREE_COST


def test_no_beam_clears_what_another_one_of_its_scan_marks():
    costmap = Costmap(ONLY_CELLS, TINY, room())
    along_a_wall = scan([1.0, 1.02, 1.3, 2.0], angle_increment=0.001)
    costmap.update(seen(Pose2D(0.025, 0.025), along_a_wall, 0.0))
    assert np.count_nonzero(sensed(costmap)) == 3
    assert at(costmap, 1.025, 0.025) == LETHAL_COST


def test_sensing_never_clears_the_static_map():
    cells = room()
    cells.cells[40, 40] = OCCUPIED  # x 1.0..1.05, y 0..0.05
    costmap = Costmap(ONLY_CELLS, TINY, cells)
    costmap.update(seen(Pose2D(0.025, 0.025), scan([2.0]), 0.0))
    costmap.update(seen(Pose2D(1.025, 0.025), scan([2.0]), 0.1))
    costmap.clear()
    assert at(costmap, 1.025, 0.025) == LETHAL_COST


def test_the_sensors_mount_and_the_robots_heading_place_the_marks():
    costmap = Costmap(ONLY_CELLS, TINY, room())
    mounted = scan([1.0], mount=Pose2D(0.2, 0.0, pi / 2))
    costmap.update(seen(Pose2D(0.525, 0.525, pi / 2), mounted, 0.0))
    # the sensor is 0.2 m up the y axis and looks along -x: 0.525 - 1 = -0.475, 0.725
    assert at(costmap, -0.475, 0.725) == LETHAL_COST


def test_marks_fade_after_the_decay_unless_seen_again():
    costmap = Costmap(replace(ONLY_CELLS, decay=10.0), TINY, room())
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.0]), 0.0))
    costmap.update(seen(pose, scan([1.0]), 8.0))
    costmap.update(seen(pose, None, 15.0))
    assert at(costmap, 1.025, 0.025) == LETHAL_COST
    costmap.update(seen(pose, None, 18.6))
    assert at(costmap, 1.025, 0.025) == FREE_COST


def test_without_decay_marks_stay():
    costmap = Costmap(replace(ONLY_CELLS, decay=0.0), TINY, room())
    costmap.update(seen(Pose2D(0.0, 0.0), scan([1.0]), 0.0))
    costmap.update(seen(Pose2D(0.0, 0.0), None, 1e4))
    assert sensed(costmap).any()


def test_denoise_drops_what_becomes_single_when_its_neighbour_fades():
    costmap = Costmap(replace(ONLY_CELLS, denoise=True, decay=10.0), TINY, room())
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.0]), 0.0))
    costmap.update(seen(pose, scan([1.0], angle_min=0.05), 5.0))
    assert np.count_nonzero(costmap.grid.cells == LETHAL_COST) == 2
    costmap.update(seen(pose, None, 11.0))
    assert np.count_nonzero(sensed(costmap)) == 1
    assert not np.count_nonzero(costmap.grid.cells == LETHAL_COST)


def test_the_robots_own_footprint_is_clear():
    costmap = Costmap(CostmapParameters(), ROUND, room())
    costmap.update(seen(Pose2D(0.0, 0.0), scan([1.0]), 0.0))
    costmap.update(seen(Pose2D(1.0, 0.1), None, 0.1))
    assert not sensed(costmap).any() and at(costmap, 1.0, 0.1) == FREE_COST


def test_version_grows_only_when_cells_change_and_grids_are_kept():
    costmap = Costmap(CostmapParameters(), ROUND, room())
    pose = Pose2D(0.025, 0.025)
    costmap.update(seen(pose, scan([1.0]), 0.0))
    version, grid = costmap.version, costmap.grid
    costmap.update(seen(pose, scan([1.0]), 0.1))
    assert costmap.version == version and costmap.grid is grid
    before = grid.cells.copy()
    costmap.update(seen(pose, scan([1.5]), 0.2))
    assert costmap.version > version
    assert np.array_equal(grid.cells, before)


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=8))
@settings(deadline=None, max_examples=40)
def test_a_rolling_window_does_not_smear_what_it_saw(places):
    costmap = Costmap(replace(ONLY_CELLS, decay=0.0), TINY, None, window=9.0)
    costmap.update(seen(Pose2D(0.025, 0.025), scan([1.0]), 0.0))
    for index, (x, y) in enumerate(places):
        if abs(x - 1.025) < 0.1 and abs(y - 0.025) < 0.1:
            continue  # the robot drives over the mark
        costmap.update(seen(Pose2D(x, y), None, 0.1 * index))
        grid = costmap.grid
        (mark,) = np.argwhere(grid.cells == LETHAL_COST)
        assert grid.centre_of(*mark) == pytest.approx((1.025, 0.025))
        assert grid.cells[grid.cell_at(0.525, 0.025)] == FREE_COST  # the beam went through
        middle = Pose2D(grid.origin[0] + 4.5, grid.origin[1] + 4.5)
        assert middle.distance_to(Pose2D(x, y)) <= 0.05


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_a_polygon_clears_the_cells_whose_middles_it_holds(turn):
    """A triangle between (0, 0), (a, 0) and (0, b), turned by quarters: x / a + y / b < 1."""
    a, b = 1.01, 0.53
    c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
    corners = np.array([(0.0, 0.0), (a, 0.0), (0.0, b)]) @ np.array([[c, s], [-s, c]])
    marked = np.zeros((60, 60), np.float32)
    seen = np.zeros((60, 60), np.uint8)
    box = kernels.clear_polygon(marked, seen, 1, -1.5, -1.5, 0.05, corners)
    rows, columns = np.mgrid[:60, :60]
    x, y = -1.5 + 0.05 * (columns + 0.5), -1.5 + 0.05 * (rows + 0.5)
    back_x, back_y = c * x + s * y, c * y - s * x
    held = (back_x > 0.0) & (back_y > 0.0) & (back_x / a + back_y / b < 1.0)
    assert held.sum() == pytest.approx(0.5 * a * b / 0.05**2, abs=8)
    assert np.array_equal(marked == -np.inf, held)
    assert np.array_equal(seen == 1, held)
    top, bottom, left, right = box
    assert held[top:bottom, left:right].sum() == held.sum()


@pytest.mark.parametrize(("dx", "dy"), [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)])
def test_what_was_seen_keeps_its_place_when_the_window_rolls_cell_by_cell(dx, dy):
    costmap = Costmap(replace(ONLY_CELLS, decay=0.0), TINY, None, window=4.0)
    costmap.update(seen(Pose2D(0.025, 0.025), scan([1.0]), 0.0))
    for step in range(1, 11):
        x, y = 0.025 + step * dx, 0.025 + step * dy
        costmap.update(seen(Pose2D(x, y), None, 0.1 * step))
        assert costmap.grid.origin == pytest.approx((x - 2.0, y - 2.0), abs=0.05)
        (mark,) = np.argwhere(costmap.grid.cells == LETHAL_COST)
        assert costmap.grid.centre_of(*mark) == pytest.approx((1.025, 0.025))


def test_the_window_takes_static_cells_at_their_places_and_drops_what_it_leaves():
    static = room()
    static.cells[40, 40] = OCCUPIED  # middle (1.025, 0.025)
    costmap = Costmap(ONLY_CELLS, TINY, static, window=3.0)
    for x in (0.0, 0.13, 0.77, 2.2):
        costmap.update(seen(Pose2D(x, 0.31), None, x))
        (cell,) = np.argwhere(costmap.grid.cells == LETHAL_COST)
        assert costmap.grid.centre_of(*cell) == pytest.approx((1.025, 0.025))
    costmap.update(seen(Pose2D(2.225, 0.025), scan([1.0]), 3.0))
    assert sensed(costmap).any()
    costmap.update(seen(Pose2D(-0.5, 0.025), None, 3.1))
    costmap.update(seen(Pose2D(2.225, 0.025), None, 3.2))
    assert not sensed(costmap).any()
    assert at(costmap, 1.025, 0.025) == LETHAL_COST


def test_a_new_map_keeps_the_sensed_obstacles_where_they_are():
    costmap = Costmap(ONLY_CELLS, TINY, room())
    costmap.update(seen(Pose2D(0.025, 0.025), scan([1.0]), 0.0))
    costmap.set_static(room(140, 150, UNKNOWN, origin=(-2.0, -3.0)))
    assert costmap.grid.cells.shape == (140, 150)
    assert at(costmap, 1.025, 0.025) == LETHAL_COST
    assert at(costmap, 0.525, 0.025) == FREE_COST
    assert at(costmap, 0.525, 0.525) == UNKNOWN_COST


def test_invalid_sizes_are_refused_with_both_numbers():
    with pytest.raises(ParameterError, match="needs a window"):
        Costmap(CostmapParameters(), ROUND, None)
    with pytest.raises(ParameterError, match=r"0\.1 m is less than three cells of 0\.05 m"):
        Costmap(CostmapParameters(), ROUND, None, window=0.1)
    with pytest.raises(ParameterError, match=r"2 m is less than obstacle_range 2\.5 m"):
        build(CostmapParameters, {"clearing_range": "2 m"})
    costmap = Costmap(CostmapParameters(), ROUND, room())
    with pytest.raises(ParameterError, match=r"resolution 0\.1 m, expected 0\.05 m"):
        costmap.set_static(replace(room(), resolution=0.1))


def test_scans_from_outside_the_map_are_harmless():
    costmap = Costmap(CostmapParameters(), ROUND, room())
    ranges = np.full(60, 1.0)
    costmap.update(seen(Pose2D(-1.5, -2.4), scan(ranges, angle_increment=0.1), 0.0))
    costmap.update(seen(Pose2D(50.0, 50.0), scan(ranges, angle_increment=0.1), 0.1))
    assert sensed(costmap).any()


@settings(deadline=None)  # the first call compiles the kernel
@given(st.integers(0, 2**32 - 1))
def test_the_lower_envelope_gives_the_nearest_lethal_cell_in_any_box(seed):
    """Against the definition: the smallest squared distance to a lethal cell, by brute force."""
    random = np.random.default_rng(seed)
    rows, columns = random.integers(1, 30, 2)
    shares = [0.97, 0.02, 0.01] if random.random() < 0.5 else [0.5, 0.4, 0.1]
    base = random.choice([0, 254, 255], size=(rows, columns), p=shares).astype(np.uint8)
    limit = int(random.integers(0, 12))
    costs = np.sort(random.integers(0, 254, limit * limit + 1)).astype(np.uint8)[::-1].copy()
    costs[0] = 254
    (top, bottom), (left, right) = (np.sort(random.integers(0, n + 1, 2)) for n in (rows, columns))
    cells = np.full_like(base, 7)
    kernels.inflate(cells, base, costs, limit, top, bottom, left, right)
    expected = np.full_like(base, 7)
    lethal = np.argwhere(base == 254)
    for row in range(top, bottom):
        for column in range(left, right):
            value = base[row, column]
            squared = ((lethal - (row, column)) ** 2).sum(axis=1).min(initial=10**6)
            cost = costs[squared] if squared <= limit * limit else 0
            raised = cost >= 253 if value == 255 else cost > value
            expected[row, column] = cost if raised else value
    assert np.array_equal(cells, expected)


def test_clearing_everything_repaints_only_what_was_sensed():
    """On a map of 64 million cells, repainting all of them takes a second."""
    costmap, fresh = (Costmap(CostmapParameters(), ROUND, room()) for _ in range(2))
    version = costmap.version
    costmap.clear()
    assert costmap.version == version  # nothing was sensed
    costmap.update(seen(Pose2D(1.0, 0.0), scan([1.0]), 0.0))
    copy = costmap.copied()
    copy.grid.cells[-1, -1] = 77  # at (5, 3); the robot sees from (0.8, -0.2) to (2, 0.2)
    copy.release()
    costmap.clear()
    assert np.array_equal(costmap.grid.cells, fresh.grid.cells)
    differ = costmap.copied().grid.cells != fresh.grid.cells
    assert differ[-1, -1] and np.count_nonzero(differ) == 1


def test_large_boxes_are_painted_in_bands_with_the_same_costs(monkeypatch):
    monkeypatch.setattr("stack.costmap.layer_compositor.BAND_CELLS", 500)  # four rows of 120 cells
    whole, banded = room(), Costmap(CostmapParameters(), ROUND, room())
    whole.cells[::9, ::7] = OCCUPIED
    banded.set_static(whole)
    monkeypatch.undo()
    assert np.array_equal(banded.grid.cells, Costmap(CostmapParameters(), ROUND, whole).grid.cells)
