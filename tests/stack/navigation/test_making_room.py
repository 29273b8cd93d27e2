"""A robot that is not round leaves a wall beside it, and minds walls that it does not see."""

from math import pi

import numpy as np
import pytest

from stack.navigation.escape.unseen import unseen_walls, zone_edges
from stack.types import (
    LETHAL_COST,
    STANDSTILL,
    CostGrid,
    ObstaclePoints,
    Pose2D,
    TaskStatus,
)
from tests.stack.navigation.toy_world import ToyWorld, robot, room


@pytest.mark.parametrize(
    "start",
    [Pose2D(3.0, 0.23, 0.0), Pose2D(3.0, 0.23, pi), Pose2D(0.29, 0.24, pi / 2)],
    ids=["left of it", "right of it", "in a corner"],
)
def test_a_box_beside_a_wall_leaves_it_without_contact(make, start):
    # 0.5 x 0.4 m, 2 to 4 cm beside the wall: it cannot turn, its corners swing 12 cm out.
    world = ToyWorld(room(8, 6), robot(), start)
    toy = make(world)
    task = toy.navigator.base.navigate_to(Pose2D(4.0, 3.0))
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert world.nearest > 0.0
    makes_room = any("making room" in text for _, text, _ in toy.events)
    assert makes_room or start.x < 1.0  # from the corner it drives on and turns


def test_giving_way_ends_the_making_of_room(make):
    """A motion of odometry that goes on after a drive elsewhere would lead anywhere."""
    toy = make(ToyWorld(room(8, 6), robot(), Pose2D(3.0, 0.23, 0.0)))
    toy.navigator.base.navigate_to(Pose2D(4.0, 3.0))
    toy.step()
    drive = toy.navigator.activities.current.drive
    while not drive._making_room.is_driving:
        toy.step()
    drive._give_way.step = lambda *_: STANDSTILL
    toy.step()
    assert not drive._making_room.is_driving


def obstacles(*sectors):
    return ObstaclePoints(blind_sectors=np.array(sectors).reshape(-1, 2))


def test_walls_of_the_map_count_where_no_sensor_sees():
    cells = np.zeros((80, 80), np.uint8)
    cells[:, 20] = LETHAL_COST  # x 1.0 to 1.05 m
    ground, pose = CostGrid(cells, 0.05), Pose2D(1.4, 2.0, pi / 2)  # the wall is to its left
    left = obstacles((pi / 4, pi / 2))
    points = unseen_walls(ground, pose, left, 0.6)
    assert np.allclose(points[:, 1], 0.375)  # from the base to the middles of the cells
    assert np.abs(points[:, 0]).max() <= 0.375 + 0.03  # within 45 deg of its left
    assert not len(unseen_walls(ground, pose, obstacles(), 0.6))
    assert not len(unseen_walls(ground, pose, obstacles((-pi / 4 - pi / 2, pi / 2)), 0.6))
    assert not len(unseen_walls(ground, pose, left, 0.2))


def zone_above(globe, y):
    """A keep-out zone from x = 1.5 m to 4.5 m and from y on, as the global costmap has it."""
    cells = np.zeros(globe.grid.cells.shape, bool)
    row, first = globe.grid.cell_at(1.5, y)
    _, last = globe.grid.cell_at(4.5, y)
    cells[row:, first:last] = True
    return {"stage": cells}


@pytest.mark.parametrize("zone", [None, 0.6])
def test_an_escape_stays_out_of_keepout_zones(make, zone):
    """Beside the wall at y = 0; without the zone it drives away from the wall, over y = 0.6 m."""
    world = ToyWorld(room(8, 6), robot(), Pose2D(3.0, 0.23, 0.0))
    toy = make(world)
    if zone is not None:
        toy.globe.forbidden = zone_above(toy.globe, zone)
    toy.step()
    task, highest = toy.navigator.base.escape(), 0.0
    while task.running and world.time < 60.0:
        toy.step()
        corners = world.pose.transform(world.robot.footprint.points)
        within = (corners[:, 0] > 1.5) & (corners[:, 0] < 4.5)
        highest = max(highest, corners[within, 1].max(initial=0.0))
    assert not task.running and world.nearest > 0.0
    assert bool(highest > 0.6) is (zone is None)


def test_only_the_edge_of_a_zone_counts():
    zone = np.zeros((80, 80), bool)
    zone[20:40, 20:40] = True  # x and y from 1 m to 2 m
    pose = Pose2D(1.5, 0.8, pi / 2)
    points = pose.transform(zone_edges([zone], CostGrid(zone.astype(np.uint8), 0.05), pose, 0.5))
    # The near side whole, and of the two beside it what is within half a metre of y = 0.8 m.
    assert points[:, 1].max() < 1.4
    assert (np.isclose(points[:, 1], 1.025) | np.isclose(abs(points[:, 0] - 1.5), 0.475)).all()
    assert np.isclose(points[:, 1], 1.025).sum() == 20
