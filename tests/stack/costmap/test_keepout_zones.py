"""Keep-out zones: the footprint stays outside, a robot inside gets out, and zones are named."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.costmap.way_out import WayOut
from stack.costmap.zones import ZONE_MARGIN, Zone
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.types import (
    FREE,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN_COST,
    Footprint,
    OccupancyGrid,
    Pose2D,
)
from tests.stack.costmap.marks import seen

ROUND = Footprint.circle(0.22)


def floor(side=6.0, resolution=0.05):
    cells = round(side / resolution)
    return OccupancyGrid(np.full((cells, cells), FREE, np.int8), resolution)


def costmap_of(*zones, static=None, footprint=ROUND):
    given = [{"name": name, "corners": corners} for name, corners in zones]
    parameters = CostmapParameters()
    layers = read_layers(["static", {"use": "keepout", "zones": given}], parameters)
    return Costmap(parameters, footprint, static or floor(), layers=layers)


def star(heading, tips=5, x=3.0, y=3.0):
    """A concave polygon: a star with tips at 1.5 m and notches at 0.7 m."""
    angles = heading + np.arange(2 * tips) * pi / tips
    radii = np.where(np.arange(2 * tips) % 2, 0.7, 1.5)
    return np.column_stack([x + radii * np.cos(angles), y + radii * np.sin(angles)]).tolist()


@settings(deadline=None, max_examples=15)
@given(heading=st.floats(0.0, pi), shift=st.floats(0.0, 0.05), fine=st.booleans())
def test_a_centre_on_a_passable_cell_keeps_the_robot_outside(heading, shift, fine):
    resolution = 0.025 if fine else 0.05
    corners = star(heading, x=3.0 + shift, y=3.0 - shift)
    costmap = costmap_of(("star", corners), static=floor(resolution=resolution))
    cells = costmap.grid.cells
    rows, columns = np.nonzero(cells < INSCRIBED_COST)
    middles = (np.column_stack([columns, rows]) + 0.5) * resolution
    gaps = distances_to_edges(middles, np.array(corners))
    assert not points_inside(middles, np.array(corners)).any()
    # The robot may be anywhere in the cell: half a diagonal, 0.71 cells, nearer. The cell nearest
    # to it is up to half a diagonal aside: 0.22 - sqrt(0.22² - 0.035²) = 0.3 cm.
    tips = np.hypot(*(middles[:, None] - np.array(corners)).T).min(axis=0)
    beside = gaps < tips - 1e-6
    assert gaps[beside].min() - 0.71 * resolution >= 0.22 - 0.003
    # Before a tip there may be no cell of the zone's: one more half diagonal.
    assert gaps.min() - 0.71 * resolution >= 0.22 - 0.71 * resolution


@pytest.mark.parametrize("heading", [0.0, pi / 4, 1.0])
def test_a_zone_is_drawn_7_cm_larger_and_no_more(heading):
    corners = np.array(star(heading))
    cells = costmap_of(("star", corners.tolist())).grid.cells
    rows, columns = np.indices(cells.shape)
    middles = (np.column_stack([columns.ravel(), rows.ravel()]) + 0.5) * 0.05
    near = points_inside(middles, corners) | (distances_to_edges(middles, corners) <= ZONE_MARGIN)
    assert ((cells == LETHAL_COST).ravel() == near).all()


def square(low, high):
    return [[low, low], [high, low], [high, high], [low, high]]


@settings(deadline=None, max_examples=20)
@given(x=st.floats(2.05, 3.95), y=st.floats(2.05, 3.95))
def test_a_robot_in_a_zone_gets_the_shortest_way_out_and_no_other(x, y):
    costmap = costmap_of(("bed", square(2.0, 4.0)))
    costmap.update(seen(Pose2D(x, y), None, 0.0))
    way_out = costmap.way_out
    depth = min(x - 2.0, y - 2.0, 4.0 - x, 4.0 - y)
    length = way_out.distance_to(Pose2D(x, y))
    # It ends one to three cells beyond the inscribed radius and the margin; octagons are up to
    # 8 % longer than circles.
    assert depth + 0.22 <= length <= 1.1 * (depth + 0.22 + ZONE_MARGIN) + 0.2
    cells = costmap.grid.cells
    for pose in (Pose2D(x, y), way_out):
        assert cells[costmap.grid.cell_at(pose.x, pose.y)] < INSCRIBED_COST
    # Straight across on the other side nothing is open.
    across = Pose2D(6.0 - x, 6.0 - y)
    if across.distance_to(Pose2D(x, y)) > length + 0.6:
        assert cells[costmap.grid.cell_at(across.x, across.y)] == LETHAL_COST
    costmap.update(seen(way_out, None, 1.0))
    assert costmap.way_out is None
    assert cells_closed(costmap) == cells_closed(costmap_of(("bed", square(2.0, 4.0))))


def cells_closed(costmap):
    return int(np.count_nonzero(costmap.grid.cells == LETHAL_COST))


def test_the_way_out_leads_round_the_walls_of_the_map_and_out_of_all_zones():
    static = floor()
    static.cells[:, 36:40] = OCCUPIED  # x 1.8..2.0: the nearest edge of the zone is behind it
    zones = (Zone(tuple(map(tuple, square(2.0, 4.0))), "a"), Zone(
        ((2.0, 3.9), (4.0, 3.9), (4.0, 4.6), (2.0, 4.6)), "b"))  # fmt: skip
    pose = Pose2D(2.5, 3.2)
    end = WayOut(zones, None, ROUND, static, pose).lane(pose).end
    assert end.y < 2.0 - 0.22  # not through the wall, nor into the other zone: 1.4 m to its end
    assert end.distance_to(pose) < 1.8


def test_a_zone_that_covers_everything_has_no_way_out_and_is_named():
    costmap = costmap_of(("all", [[-1, -1], [9, -1], [9, 9], [-1, 9]]))
    costmap.update(seen(Pose2D(3.0, 3.0), None, 0.0))
    assert costmap.way_out is None
    assert costmap.grid.cells[60, 60] == LETHAL_COST


def test_a_rolling_window_opens_the_same_way():
    parameters = CostmapParameters()
    zone = {"use": "keepout", "zones": [{"name": "bed", "corners": square(2.0, 8.0)}]}
    layers = read_layers(["obstacle", zone], parameters)
    window = Costmap(parameters, ROUND, None, window=3.0, layers=layers)
    for x in np.arange(5.5, 1.6, -0.1):  # 3.5 m deep: the way out ends outside the window
        window.update(seen(Pose2D(float(x), 5.0), None, 0.0))
        under = window.grid.cells[window.grid.cell_at(float(x), 5.0)]
        assert under < INSCRIBED_COST or under == UNKNOWN_COST
    assert window.way_out is None


def test_zones_that_close_the_way_are_named_and_others_not():
    bar = ("bar", [[2.5, -1.0], [3.5, -1.0], [3.5, 9.0], [2.5, 9.0]])
    aside = ("aside", [[0.2, 5.0], [1.0, 5.0], [1.0, 5.8], [0.2, 5.8]])
    ends = Pose2D(1.0, 1.0), Pose2D(5.0, 1.0)
    assert costmap_of(bar, aside).zones_between(*ends) == ("bar",)
    assert costmap_of(aside).zones_between(*ends) == ()
    both = (bar, ("second", [[4.0, -1.0], [4.2, -1.0], [4.2, 9.0], [4.0, 9.0]]))
    assert costmap_of(*both).zones_between(*ends) == ("bar", "second")
    walled = floor()
    walled.cells[:, 60] = OCCUPIED
    assert costmap_of(bar, static=walled).zones_between(*ends) == ()
    assert costmap_of(aside).zones_between(ends[0], Pose2D(0.6, 5.4)) == ("aside",)
