"""Generated buildings: boundaries, ranges, and a small building that is mapped."""

from itertools import pairwise

import cv2
import numpy as np
import pytest

from stack.mapping.slam.mapper import Mapper
from stack.types import Pose2D
from tests.benchmarks.buildings import long_run
from tests.benchmarks.buildings.drives import BEAMS, NOISE, cast, drive
from tests.benchmarks.buildings.long_run import day_table, sessions_table
from tests.benchmarks.buildings.plans import KINDS, Building, boundary, building
from tests.benchmarks.buildings.scores import false_edges, loops_closed, revisits, wall_errors

RING = boundary([(0, 0, 12, 2), (10, 0, 12, 9), (0, 7, 12, 9), (0, 0, 2, 9), (5, 2, 6, 2.5)])


def test_the_boundary_of_two_rectangles_is_one_line_without_the_common_side():
    """An L of 3 x 1 and 1 x 2 m: its outline is 10 m long, in six sides."""
    walls = boundary([(0.0, 0.0, 3.0, 1.0), (0.0, 0.0, 1.0, 2.0)])
    assert len(walls) == 6
    assert np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum() == pytest.approx(10.0)


def test_a_beam_ends_at_a_wall_and_passes_glass_that_it_meets_askew():
    """From the middle of a box of 4 x 4 m with its right side of glass."""
    walls = boundary([(0.0, 0.0, 4.0, 4.0)])
    glass = (walls[:, 0] == 4.0) & (walls[:, 2] == 4.0)
    ranges = cast(Building("box", walls, glass, ()), Pose2D(2.0, 2.0))
    middle, quarter = BEAMS // 2, round((BEAMS - 1) / 6)
    assert ranges[middle] == pytest.approx(2.0)
    assert ranges[middle + 2 * quarter] == pytest.approx(2.0)  # 90 degrees to the left
    assert not np.isfinite(ranges[middle + quarter - 2])  # 43 degrees


@pytest.mark.parametrize(("seed", "loops"), list(enumerate((1, 2, 2, 4, 1))))
def test_a_building_has_long_corridors_with_loops_and_a_way_through_them(seed, loops):
    """Loops: of a ring 1, of a ladder and of two wings 2, of a grid of 3 x 3 crossings 4."""
    plan = building(seed)
    assert plan.kind == KINDS[seed]
    assert 100.0 <= corridor_length(plan) <= 200.0
    assert blocks(plan) == loops
    xs, ys = plan.walls[:, [0, 2]], plan.walls[:, [1, 3]]
    for (x, y), (to_x, to_y) in pairwise(plan.route):
        low, high = sorted((x, to_x)), sorted((y, to_y))
        crossed = (xs.min(1) <= low[1]) & (xs.max(1) >= low[0])
        crossed &= (ys.min(1) <= high[1]) & (ys.max(1) >= high[0])
        assert not crossed.any()  # no wall stands across the way


def corridor_length(plan: Building) -> float:
    """Metres of the route, each place counted once: cells of 0.1 m along the axes."""
    cells = set()
    for one, other in pairwise(np.array(plan.route)):
        count = round(10.0 * float(np.abs(other - one).sum()))
        middles = one + (np.arange(count)[:, None] + 0.5) / count * (other - one)
        cells.update(map(tuple, np.floor(10.0 * middles + 1e-6).tolist()))
    return 0.1 * len(cells)


def blocks(plan: Building) -> int:
    """Count the blocks of more than 8 m x 8 m that corridors run around; the outline is none."""
    pixels = np.round(10.0 * (plan.walls - plan.walls.min())).astype(int)
    picture = np.zeros(pixels.max(axis=0)[[3, 2]] + 1, np.uint8)
    for x, y, to_x, to_y in pixels.tolist():
        picture[min(y, to_y) : max(y, to_y) + 1, min(x, to_x) : max(x, to_x) + 1] = 1
    _, _, found, _ = cv2.connectedComponentsWithStats(picture, connectivity=4)
    sides = found[1:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]]
    return int((sides.min(axis=1) > 80).sum()) - 1


def test_a_small_building_is_mapped_and_its_loop_closed():
    """A ring of 42 m, driven once and a half; the same scores as of the large ones."""
    route = ((1.0, 1.0), (11.0, 1.0), (11.0, 8.0), (1.0, 8.0), (1.0, 1.0), (11.0, 1.0), (11.0, 8.0))
    plan = Building("ring", RING, np.zeros(len(RING), np.bool_), route)
    steps = drive(plan, 3)
    assert steps[-1].odometry.distance_to(steps[-1].truth) > 0.3
    mapper = Mapper(noise=NOISE, keep_trajectory=True)
    mapper.start(steps[0].truth)
    for step in steps:
        mapper.add(step.scan.stamp, step.odometry, step.scan)
    mapper.optimise()
    truth = {step.scan.stamp: step.truth for step in steps}
    true = {n: truth[k.stamp] for n, k in mapper.graph.keyframes.items()}
    assert len(revisits(steps)) == 1
    assert loops_closed(mapper, steps, true) == (1, 1) and false_edges(mapper, true) == 0
    assert np.median(wall_errors(mapper, plan, true)) < 0.02


@pytest.fixture
def small(monkeypatch):
    """A ring of 42 m with six cupboards, of which two are moved, instead of a large building."""
    route = ((1.0, 1.0), (11.0, 1.0), (11.0, 8.0), (1.0, 8.0), (1.0, 1.0))
    plan = Building("ring", RING, np.zeros(len(RING), np.bool_), route)
    monkeypatch.setattr(long_run, "building", lambda seed: plan)
    monkeypatch.setattr(long_run, "CUPBOARDS", 6)
    monkeypatch.setattr(long_run, "MOVED_A_SESSION", 2)


def test_cupboards_that_are_moved_leave_a_map_that_is_resumed(small):
    first, second = sessions_table(sessions=2)
    assert first["shown"] == second["shown"] == "6/6"
    assert second["left"] == "0/2"
    assert second["keyframes"] < 1.2 * first["keyframes"]
    assert max(first["worst m"], second["worst m"]) < 0.2


def test_a_patrol_has_a_row_for_each_hour(small, monkeypatch):
    """Hours of a lap there and back."""
    monkeypatch.setattr(long_run, "HOUR", 300.0)
    rows = day_table(2)
    assert [row["hour"] for row in rows] == [1, 2]
    assert rows[1]["keyframes"] < 1.2 * rows[0]["keyframes"]
    assert max(row["worst m"] for row in rows) < 0.2
