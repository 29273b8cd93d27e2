"""One threshold decides which cells of a map are occupied, whoever reads the map."""

import numpy as np
import pytest

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.layer import Frame
from stack.costmap.parameters import CostmapParameters
from stack.costmap.zones import ZoneCells, read_mask
from stack.localisation.distance_field import surface_field
from stack.mapping.passages import clearance_of
from stack.mapping.ros_map import read_ros_map
from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.tracker import Tracker
from stack.sim.worlds.map_world import read_map_world
from stack.types import FREE_COST, LETHAL_COST, UNKNOWN_COST, Footprint, OccupancyGrid, Pose2D
from tests.stack.mapping.written_maps import write_ros_map

ONLY_CELLS = CostmapParameters(inflation_radius=0.0)
TINY = Footprint.circle(0.02)
PERCENT = (-1, 0, 25, 26, 64, 65, 99, 100)
KINDS = "?ff??ooo"
"""Unknown, free or occupied, with the default threshold of 65 %."""


def row_of(values=PERCENT, **more):
    """A map with each value in a column of its own, three cells wide and three rows high."""
    cells = np.repeat(np.array(values, dtype=np.int8), 3)
    return OccupancyGrid(np.tile(cells, (3, 1)), 0.1, (0.0, 0.0), **more)


def kinds(free, occupied):
    return "".join(
        "o" if is_occupied else "f" if is_free else "?"
        for is_free, is_occupied in zip(free[1, 1::3], occupied[1, 1::3], strict=True)
    )


def of_costmap(grid, window=None):
    costmap = Costmap(
        ONLY_CELLS, TINY, grid, window=window, layers=read_layers(["static"], ONLY_CELLS)
    )
    cells = costmap.grid.cells
    assert set(np.unique(cells)) <= {FREE_COST, LETHAL_COST, UNKNOWN_COST}
    return cells == FREE_COST, cells == LETHAL_COST


def test_the_costmap_and_the_localisation_see_the_same_walls():
    grid = row_of()
    assert kinds(grid.free, grid.occupied) == KINDS
    assert kinds(*of_costmap(grid)) == KINDS
    field = surface_field(grid)
    assert kinds(field.occupancy == 0, field.occupancy == 1) == KINDS


def test_the_doctor_and_the_tracker_see_them_as_well():
    grid = row_of((0, 64, 0, 65, 0, 100))
    assert clearance_of(grid)[1, 1::3].tolist()[3::2] == [0.0, 0.0]
    near = Tracker(TrackerParameters(), grid)._near_map
    assert near[1, 10] and near[1, 16]


def test_a_mask_forbids_cells_from_the_threshold_on(tmp_path):
    write_ros_map(row_of(), tmp_path / "mask.yaml")
    zone = ZoneCells((), read_mask(str(tmp_path / "mask.yaml")))
    zone.lay_out(Frame((3, 24), 0.1, (0.0, 0.0)), None)
    assert kinds(zone.cells == 0, zone.cells > 0) == "fffffooo"


def test_the_walls_of_a_simulated_map_are_those_of_its_readers(tmp_path):
    write_ros_map(row_of((0, 64, 0, 65, 0, 100)), tmp_path / "map.yaml")
    boxes = read_map_world(tmp_path / "map.yaml").boxes
    assert sorted((round(box.pose.x, 2), round(box.size[0], 2)) for box in boxes) == [
        (1.05, 0.3), (1.65, 0.3),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("threshold", "expected"), [(0.65, KINDS), (0.9, "?ff???oo"), (0.2, "?foooooo")]
)
def test_a_raw_map_brings_its_own_threshold(tmp_path, threshold, expected):
    write_ros_map(row_of(occupied_from=round(100 * threshold)), tmp_path / "map.yaml")
    grid = read_ros_map(tmp_path / "map.yaml")
    assert grid.occupied_from == round(100 * threshold)
    assert kinds(grid.free, grid.occupied) == expected
    assert kinds(*of_costmap(grid)) == expected
    field = surface_field(grid)
    assert kinds(field.occupancy == 0, field.occupancy == 1) == expected


def test_the_rolling_window_sees_the_same_walls():
    """Cells of 5 cm over a map of 10 cm."""
    grid = row_of()
    costmap = Costmap(
        ONLY_CELLS, TINY, grid, window=6.0, layers=read_layers(["static"], ONLY_CELLS)
    )
    costmap.clear_around(Pose2D(0.0, 0.0), 1.0)
    for column, kind in enumerate(KINDS):
        cost = costmap.grid.cells[costmap.grid.cell_at(0.15 + 0.3 * column, 0.15)]
        assert cost == {"?": UNKNOWN_COST, "f": FREE_COST, "o": LETHAL_COST}[kind]
