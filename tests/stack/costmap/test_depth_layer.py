import numpy as np

from stack.costmap.layer import NO_BOX, Canvas, Frame, LayerUpdate, NoParameters, Region
from stack.costmap.layers.depth_layer import DepthLayer
from stack.types import FREE_COST, LETHAL_COST, Footprint, Pose2D

FRAME = Frame((20, 30), 0.1, (-1.0, -1.0))


def layer():
    made = DepthLayer(NoParameters(), Footprint.circle(0.2))
    made.lay_out(FRAME, None)
    return made


def update(*points):
    depth = None if not points else np.array(points, dtype=float).reshape(-1, 2)
    return LayerUpdate(Pose2D(0.0, 0.0), 5.0, depth=depth)


def painted(made):
    cells = np.full(FRAME.shape, FREE_COST, dtype=np.uint8)
    made.paint(Canvas(cells, cells.copy(), FRAME.everywhere))
    return {(int(r), int(c)) for r, c in np.argwhere(cells == LETHAL_COST)}


def test_points_are_lethal_cells_and_those_outside_are_not_drawn():
    made = layer()
    # (0.05, 0.25) is in column 10 and row 12 of cells of 0.1 m from (-1, -1).
    assert made.update(update((0.05, 0.25), (9.0, 9.0))) == (12, 13, 10, 11)
    assert painted(made) == {(12, 10)}
    assert made.origin_of(12, 10) == ("depth", 5.0) and made.origin_of(0, 0) is None


def test_only_changes_are_repainted():
    made = layer()
    made.update(update((0.05, 0.25), (1.05, 0.25)))
    assert made.update(update((0.05, 0.25), (1.05, 0.25))) == NO_BOX
    assert made.update(update()) == NO_BOX
    assert made.update(update((0.05, 0.25))) == (12, 13, 20, 21)
    assert painted(made) == {(12, 10)}


def test_points_keep_their_place_when_the_costmap_moves():
    made = layer()
    made.update(update((0.05, 0.25)))
    made.lay_out(Frame((20, 30), 0.1, (-0.5, -1.0)), (0, 5))
    assert painted(made) == {(12, 5)}


def test_a_cleared_region_is_free_until_the_next_picture():
    made = layer()
    made.update(update((0.05, 0.25), (1.05, 0.25)))
    box = (12, 13, 10, 11)
    assert made.clear(Region(box, np.ones((1, 1), dtype=bool))) == box
    assert painted(made) == {(12, 20)}
    assert made.clear(None) == FRAME.everywhere and painted(made) == set()
    made.update(update((0.05, 0.25)))
    assert painted(made) == {(12, 10)}
