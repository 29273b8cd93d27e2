"""Generated buildings: boundaries, ranges, and a small building that is mapped."""

import numpy as np
import pytest

from stack.mapping.slam.mapper import Mapper
from stack.types import Pose2D
from tests.benchmarks.buildings.drives import BEAMS, NOISE, cast, drive
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


@pytest.mark.parametrize("seed", range(len(KINDS)))
def test_a_building_has_long_corridors_with_loops_and_a_way_through_them(seed):
    plan = building(seed)
    assert plan.kind == KINDS[seed]
    xs, ys = plan.walls[:, [0, 2]], plan.walls[:, [1, 3]]
    for (x, y), (to_x, to_y) in zip(plan.route, plan.route[1:], strict=False):
        low, high = sorted((x, to_x)), sorted((y, to_y))
        crossed = (xs.min(1) <= low[1]) & (xs.max(1) >= low[0])
        crossed &= (ys.min(1) <= high[1]) & (ys.max(1) >= high[0])
        assert not crossed.any()  # no wall stands across the way


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
