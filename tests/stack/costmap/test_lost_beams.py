"""Beams without return: lost ones do not open walls, agreeing ones clear what is gone."""

from math import hypot, inf, nan, pi

import numpy as np
import pytest

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.types import LETHAL_COST, UNKNOWN_COST, Footprint, Pose2D, Scan
from tests.stack.costmap.marks import seen, sensed

BEAMS = 360
ONLY_CELLS = CostmapParameters(inflation_radius=0.0)
MIDDLE = Pose2D(0.025, 0.025)


def costmap():
    layers = read_layers(["obstacle"], ONLY_CELLS)
    return Costmap(ONLY_CELLS, Footprint.circle(0.02), None, window=8.0, layers=layers)


def scan(ranges, angle_min=0.0, angle_increment=2.0 * pi / BEAMS):
    array = np.array(ranges, dtype=np.float32)
    return Scan(0.0, array, angle_min, angle_increment, 0.08, 12.0)


def square_room(half):
    """Ranges to the walls of a square room from its middle."""
    angles = np.arange(BEAMS) * 2.0 * pi / BEAMS
    return half / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))


def test_lost_beams_do_not_open_a_wall():
    """One beam in 200 is lost, as in the lidars of the shipped robots; the wall stays closed.

    500 scans of 360 beams lose 900; two neighbours are lost together in 0.005² of the cases.
    """
    here, random = costmap(), np.random.default_rng(7)
    ranges = square_room(2.0)
    here.update(seen(MIDDLE, scan(ranges), 0.0))
    wall = sensed(here)
    assert wall.sum() > 200
    for step in range(1, 501):
        lost = np.where(random.random(BEAMS) < 0.005, inf, ranges)
        here.update(seen(MIDDLE, scan(lost), 0.1 * step))
        assert sensed(here)[wall].all(), step


@pytest.mark.parametrize("lost", [(50,), (50, 51), (0,), (BEAMS - 1,), (BEAMS - 1, 0)])
def test_a_lost_beam_shows_no_more_than_its_neighbours(lost):
    here = costmap()
    ranges = square_room(2.0)
    here.update(seen(MIDDLE, scan(ranges), 0.0))
    wall = sensed(here)
    ranges[list(lost)] = inf
    here.update(seen(MIDDLE, scan(ranges), 0.1))
    assert np.array_equal(sensed(here), wall)
    middles = -3.975 + 0.05 * np.arange(160)
    outside = np.abs(middles - MIDDLE.x) > 2.05
    assert (here.grid.cells[outside] == UNKNOWN_COST).all()
    assert (here.grid.cells[:, outside] == UNKNOWN_COST).all()


def test_what_is_gone_is_cleared_by_beams_that_agree():
    """A box of 10 beams at 1 m in an open hall is carried away: all beams are without return."""
    here = costmap()
    ranges = np.full(BEAMS, inf)
    ranges[40:50] = 1.0
    here.update(seen(MIDDLE, scan(ranges), 0.0))
    assert sensed(here).sum() > 2
    here.update(seen(MIDDLE, scan(np.full(BEAMS, inf)), 0.1))
    assert not sensed(here).any()
    assert np.count_nonzero(here.grid.cells == LETHAL_COST) == 0


def test_a_beam_beside_an_obstacle_shows_free_space_up_to_its_distance():
    """Beam 1 has no return; beam 0 returns from 1.0 m: free up to there, unknown beyond."""
    here = costmap()
    here.update(seen(MIDDLE, scan([1.0, inf, inf, inf], angle_increment=0.2), 0.0))
    for distance, known in ((0.9, True), (1.2, False)):
        x, y = MIDDLE.x + distance * np.cos(0.2), MIDDLE.y + distance * np.sin(0.2)
        assert hypot(x - MIDDLE.x, y - MIDDLE.y) == pytest.approx(distance)
        assert (here.grid.cells[here.grid.cell_at(x, y)] == 0) is np.bool_(known)


def test_an_invalid_beam_confirms_nothing():
    here = costmap()
    here.update(seen(MIDDLE, scan([2.0, 2.0, 2.0], angle_increment=0.2), 0.0))
    before = here.grid.cells.copy()
    here.update(seen(MIDDLE, scan([2.0, inf, nan], angle_increment=0.2), 0.1))
    assert np.array_equal(here.grid.cells, before)


def test_a_single_beam_has_no_neighbours_to_agree_with():
    here = costmap()
    here.update(seen(MIDDLE, scan([2.0]), 0.0))
    here.update(seen(MIDDLE, scan([inf]), 0.1))
    assert not sensed(here).any()
