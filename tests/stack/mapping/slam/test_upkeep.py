"""Upkeep of a map that is driven in again: moved things, bounded size, pruning."""

import numpy as np
import pytest

from stack.mapping.graph_files import read_graph
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import SlamParameters
from stack.mapping.slam.upkeep import ScanBeams, contradicted
from stack.types import OccupancyGrid, Pose2D, Scan
from tests.stack.mapping.slam.drives import line, mapped, saved
from tests.stack.mapping.slam.rooms import box, scan_at

ROOM = [*box(0, 0, 8, 6), *box(2, 2, 1, 0.6), (3, 6, 3, 4.6)]
BEFORE = np.array([*ROOM, *box(6.2, 4.6, 1.2, 0.5)])
AFTER = np.array([*ROOM, *box(4.4, 0.05, 1.2, 0.5)])
"""The cupboard of 1.2 x 0.5 m has been moved across the room."""

LAP = line((1, 1.3), (7, 1.3), (7, 3), (4, 3), (4, 5), (4, 3), (1, 3), (1, 1.3), step=0.18)


def occupied_in(grid: OccupancyGrid, x: float, y: float, width: float, height: float) -> int:
    low, high = grid.cell_at(x, y), grid.cell_at(x + width, y + height)
    return int(grid.occupied[low[0] : high[0] + 1, low[1] : high[1] + 1].sum())


@pytest.fixture(scope="module")
def patrol(tmp_path_factory):
    """A saved map, and its continuation over two laps after the cupboard was moved."""
    first = mapped(BEFORE, LAP)
    folder = saved(first, tmp_path_factory.mktemp("maps") / "room")
    again, sizes, errors = Mapper(SlamParameters(), read_graph(folder)), [], []
    again.set_pose(LAP[0], LAP[0])
    for lap in range(2):
        for k, pose in enumerate(LAP):
            scan = scan_at(AFTER, pose, 0.1 * k, 0.01, 1000 * lap + k)
            errors.append(again.add(0.1 * k, pose, scan).distance_to(pose))
        sizes.append((len(again.graph.keyframes), len(again.graph.edges)))
    return first, again, sizes, errors


def test_a_moved_cupboard_leaves_its_old_place_and_appears_at_the_new_one(patrol):
    first, again, _, _ = patrol
    before, after = first.grid(), again.grid()
    # its visible sides are 2 to 3 m of 5 cm cells
    assert occupied_in(before, 6.1, 4.5, 1.4, 0.7) > 30
    assert occupied_in(after, 6.1, 4.5, 1.4, 0.7) == 0
    assert occupied_in(before, 4.3, 0.2, 1.4, 0.45) == 0
    assert occupied_in(after, 4.3, 0.2, 1.4, 0.45) > 20
    walls = after.occupied[:, after.cell_at(8.0, 0.0)[1] - 1 : after.cell_at(8.0, 0.0)[1] + 2]
    assert walls.any(axis=1).sum() > 100  # the wall of 6 m next to the old place is complete


def test_the_graph_does_not_grow_with_time_and_the_pose_stays_exact(patrol):
    first, _, sizes, errors = patrol
    keyframes, edges = len(first.graph.keyframes), len(first.graph.edges)
    assert all(count <= 1.15 * keyframes for count, _ in sizes)
    assert all(count <= 1.15 * edges for _, count in sizes)
    assert max(errors) < 0.03


def test_the_graph_stays_connected(patrol):
    graph = patrol[1].graph
    seen, queue = set(), [next(iter(graph.keyframes))]
    while queue:
        number = queue.pop()
        if number not in seen:
            seen.add(number)
            queue += [edge.source + edge.target - number for edge in graph.edges_of(number)]
    assert seen == set(graph.keyframes)


def test_a_trajectory_keeps_all_keyframes():
    there_and_back = line((1, 1.3), (4, 1.3), (1, 1.3))
    kept = Mapper(SlamParameters(), keep_trajectory=True)
    for mapper in (kept, Mapper(SlamParameters())):
        mapper.start(there_and_back[0])
        mapped(BEFORE, there_and_back, mapper)
    assert len(kept.graph.keyframes) > 1.5 * len(mapper.graph.keyframes)


def test_beams_that_end_early_or_pass_are_contradicted():
    def scan(ranges):
        return Scan(0.0, np.array(ranges, np.float32), -0.2, 0.1, 0.05, 10.0)

    here, old = Pose2D(1.0, 2.0, 0.3), ScanBeams.of(scan([4, 4, 4, 4, 4]))

    def beams_against(ranges):
        return contradicted(old, here, ScanBeams.of(scan(ranges)), here)

    # a thing behind which the wall is now seen; the outermost beams have no neighbour
    assert beams_against([9, 9, 9, 9, 9]).tolist() == [0, 1, 1, 1, 0]
    # a thing in front of the old wall
    assert beams_against([2, 2, 2, 2, 2]).tolist() == [0, 1, 1, 1, 0]
    # 20 cm and 3 % are no contradiction; an invalid beam says nothing
    assert not beams_against([4.3, 4.3, 4.3, 4.3, 4.3]).any()
    assert not beams_against([np.nan] * 5).any()
