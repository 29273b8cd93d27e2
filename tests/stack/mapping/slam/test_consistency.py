"""Health while mapping: known walls decide, new territory says nothing."""

import numpy as np
import pytest

from stack.mapping.slam.consistency import MapConsistency
from stack.mapping.slam.mapper import Mapper
from stack.types import UNKNOWN, OccupancyGrid, Pose2D
from tests.stack.mapping.slam.drives import line, mapped
from tests.stack.mapping.slam.rooms import BEAMS, ROOM, box, scan_at

HERE = Pose2D(4.0, 1.2, 0.4)


@pytest.fixture(scope="module")
def grid() -> OccupancyGrid:
    mapper: Mapper = mapped(ROOM, line((1.0, 1.2), (7.0, 1.2), (7.0, 3.0), (4.0, 3.0), (4.0, 5.0)))
    return mapper.shown_grid


def compared(grid: OccupancyGrid) -> MapConsistency:
    consistency = MapConsistency()
    consistency.use(grid)
    return consistency


def test_scans_of_the_mapped_room_speak_for_the_pose(grid):
    assert compared(grid).share(HERE, scan_at(ROOM, HERE, noise=0.01)) > 0.95


def test_a_shoved_robot_contradicts_the_map(grid):
    after = HERE.compose(Pose2D(0.6, 0.3, 0.3))
    assert compared(grid).share(HERE, scan_at(ROOM, after, noise=0.01)) < 0.35


def test_unknown_space_says_nothing(grid):
    """Half of the map is unknown; what the scan shows there is neither for nor against the pose."""
    cells = grid.cells.copy()
    column = grid.cell_at(4.5, 0.0)[1]
    cells[:, column:] = UNKNOWN
    half = OccupancyGrid(cells, grid.resolution, grid.origin)
    assert compared(half).share(HERE, scan_at(ROOM, HERE, noise=0.01)) > 0.95
    cells = np.full_like(cells, UNKNOWN)
    empty = OccupancyGrid(cells, grid.resolution, grid.origin)
    assert compared(empty).share(HERE, scan_at(ROOM, HERE)) is None


def test_a_scan_without_returns_says_nothing(grid):
    scan = scan_at(np.array([(90.0, 90.0, 91.0, 90.0)]), HERE)
    assert scan.ranges.size == BEAMS and np.isinf(scan.ranges).all()
    assert compared(grid).share(HERE, scan) is None


def test_somebody_in_front_is_weak_evidence(grid):
    """A person at 0.8 m hides 30 of 180 beams: they count half."""
    person = np.array(box(HERE.x + 0.6, HERE.y + 0.1, 0.4, 0.4))
    scan = scan_at(np.concatenate([ROOM, person]), HERE, noise=0.01)
    assert 0.8 < compared(grid).share(HERE, scan) < 0.95
