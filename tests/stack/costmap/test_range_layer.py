"""Range layer: walls of glass that only sonars measure, with the simulated sonars of `scout`."""

from math import tan
from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.costmap.layer import Frame, LayerUpdate, Posed
from stack.costmap.layers.range_layer import RangeLayer
from stack.sim.scene_state import SceneState
from stack.sim.sensors.sonar import Sonar
from stack.sim.worlds.world import Wall, World
from stack.types import Pose2D

SCOUT = read_robot(find_robot("scout", Path()))
CELL, HALF, LENGTH = 0.025, 5.0, 2.0
"""Side of a cell, half the side of the grid, length of a pane; metres."""

NAV2 = {"rim": 0.0, "fading": 1.2}


def driven(direction, panes, poses, **parameters):
    """Marks after a drive along some poses, 0.1 s apart.

    Args:
        direction: of the x axis on the grid, radians.
        panes: ends of walls of glass 4 cm thick, metres.
        poses: of the base; like the panes, relative to the x axis.
        parameters: of the layer.

    Returns:
        (n, 2) middles of the marked cells in the same frame, metres.
    """
    frame = Pose2D(0.0, 0.0, direction)
    walls = [frame.transform(np.array(ends, dtype=float)).tolist() for ends in panes]
    world = World(
        "panes", (-HALF, -HALF, HALF, HALF),
        walls=tuple(Wall(tuple(map(tuple, ends)), 0.04, glass=True) for ends in walls),
    )  # fmt: skip
    sonars = [Sonar(sonar, world, 1, name) for name, sonar in SCOUT.sonars.items()]
    layer = RangeLayer(RangeLayer.Parameters(**parameters), SCOUT.footprint)
    cells = round(2 * HALF / CELL)
    layer.lay_out(Frame((cells, cells), CELL, (-HALF, -HALF)), None)
    for step, pose in enumerate(poses):
        base, time = frame.compose(pose), 0.1 * step
        readings = (sonar.reading(base, SceneState(), 50 * step, time) for sonar in sonars)
        posed = tuple(Posed(reading, base) for reading in readings)
        layer.update(LayerUpdate(base, time, readings=posed))
    rows, columns = np.nonzero(layer.marked)
    middles = np.column_stack([columns + 0.5, rows + 0.5]) * CELL - HALF
    return frame.inverse().transform(middles)


def passed(lateral, direction, approach, **parameters):
    """Marks after a drive at 0.5 m/s past a pane from (0, 0) to (2, 0).

    Args:
        lateral: distance of the base from its middle, metres.
        direction: of the pane on the grid, radians.
        approach: angle at which the robot comes nearer, radians.
        parameters: of the layer.
    """
    along = -2.0 + 0.05 * np.arange(100)
    poses = [Pose2D(x, lateral - (x - 0.5 * LENGTH) * tan(approach), -approach) for x in along]
    return driven(direction, [((0.0, 0.0), (LENGTH, 0.0))], poses, **parameters)


def marked_share(marks):
    """Share of the face of the pane with a mark within 5 cm: two cells, or a reading's error."""
    face = np.column_stack([np.linspace(0.0, LENGTH, 201), np.full(201, 0.02)])
    nearest = np.linalg.norm(face[:, None] - marks[None], axis=2).min(axis=1, initial=np.inf)
    return float((nearest <= 0.05).mean())


@pytest.mark.parametrize("approach", [0.0, 0.15])
@pytest.mark.parametrize(("lateral", "direction"), [(0.4, 0.0), (0.6, 0.4), (0.8, 1.2), (1.0, 0.8)])
def test_a_pane_that_the_robot_passes_is_marked_up_to_its_ends(lateral, direction, approach):
    """Most of it is only ever on the rim of a cone, where Nav2's confidence is 0."""
    marks = passed(lateral, direction, approach)
    assert marked_share(marks) >= 0.95
    # beyond its ends at most half an arc: 0.3 m at 1.2 m, with an error of 5 % (0.06 m)
    assert marks[:, 0].min() >= -0.36 and marks[:, 0].max() <= LENGTH + 0.1
    assert marked_share(passed(lateral, direction, approach, **NAV2)) < 0.75


@pytest.mark.parametrize(("gap", "distance"), [(1.0, 1.0), (1.0, 0.6), (1.4, 1.5), (1.4, 1.0)])
def test_a_gap_between_two_panes_opens_while_the_robot_drives_towards_it(gap, distance):
    """What the cones see through is cleared, in their whole width."""
    panes = [
        ((0.0, side * 0.5 * gap), (0.0, side * (0.5 * gap + 1.5))) for side in (-1.0, 1.0)
    ]  # fmt: skip
    poses = [Pose2D(x, 0.0) for x in np.arange(-2.5, -distance + 1e-6, 0.05)]
    marks = driven(0.3, panes, poses)
    near = marks[np.abs(marks[:, 0]) < 0.25, 1]
    assert near[near > 0.0].min() - near[near < 0.0].max() > 2.0 * SCOUT.footprint.inscribed_radius
