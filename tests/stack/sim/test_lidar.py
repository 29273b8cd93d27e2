from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.description import LidarDescription
from stack.sim.lidar import Lidar
from stack.sim.physics import Physics
from stack.sim.settings import SimulationSettings
from stack.sim.world import Box, Cylinder, Door, Person
from stack.types import Pose2D
from tests.stack.sim.sim_rover import EMPTY, LIDAR, ROVER, square_range, square_room


def take(description, world, pose=Pose2D(0.0, 0.0), seed=1, step=0, people=()):
    physics = Physics(ROVER, world, pose, SimulationSettings())
    if people:
        physics.scene.place_people(np.array(people))
    try:
        return Lidar(description, seed).scan(physics, 0.0, step)
    finally:
        physics.close()


@pytest.mark.parametrize("pose", [Pose2D(0.0, 0.0), Pose2D(1.2, -0.7, 0.4)])
def test_ranges_in_a_square_room(pose):
    description = replace(LIDAR, mount=Pose2D(0.1, 0.05, 0.3), noise=0.01)
    scan = take(description, square_room(3.0), pose)
    sensor = pose.compose(description.mount)
    true = [square_range(sensor.x, sensor.y, sensor.heading + a, 3.0) for a in scan.angles]
    errors = scan.ranges - np.array(true)
    # The corners' ranges, up to 6 m, are among them; 4 sigma for 360 draws.
    assert np.abs(errors).max() < 4 * 0.01
    assert np.std(errors) == pytest.approx(0.01, rel=0.15)
    assert abs(errors.mean()) < 3 * 0.01 / np.sqrt(360)


def test_the_corner_beam():
    scan = take(LIDAR, square_room(3.0), Pose2D(-0.1, 0.0))
    # 45 degrees to the left of ahead, beam (45 + 180) of 360: 3 sqrt(2)
    assert scan.angles[225] == pytest.approx(pi / 4)
    assert scan.ranges[225] == pytest.approx(3.0 * np.sqrt(2), abs=1e-3)


def test_points_lie_on_the_walls_in_the_base_frame():
    scan = take(replace(LIDAR, mount=Pose2D(0.1, 0.0, pi)), square_room(3.0))
    assert np.abs(scan.points()).max(axis=1) == pytest.approx(3.0, abs=1e-3)


def test_all_kinds_of_things_are_seen_and_the_robot_is_not():
    world = replace(
        EMPTY,
        boxes=(Box(Pose2D(2.6, 0.0), (1.0, 1.0, 0.5)), Box(Pose2D(0.0, -1.0), (4.0, 0.4, 0.15))),
        cylinders=(Cylinder(0.1, 3.0, 0.5),),
        doors=(
            Door("d", (-2.0, -1.0), (-2.0, 1.0), closed=True),
            Door("o", (-1.0, -1.0), (-1.0, 1.0)),
        ),
        people=(Person("p", np.array([[0.1, -4.0], [1.0, -4.0]]), radius=0.25),),
    )
    scan = take(LIDAR, world, people=[(0.1, -4.0, 0.25)])
    ahead, left, right, behind = scan.ranges[[180, 270, 90, 0]]
    assert ahead == pytest.approx(2.0, abs=1e-3)
    assert left == pytest.approx(2.5, abs=0.003)  # a prism's flat may lie 0.5 % of 0.5 m deeper
    assert right == pytest.approx(3.75, abs=1e-3)  # over the box that is lower than the lidar
    assert behind == pytest.approx(2.06, abs=1e-3)  # the closed door's near face; the open one not
    assert np.nanmin(scan.ranges) > 1.9


def test_out_of_range_is_infinite_and_too_near_is_not_a_number():
    near = Box(Pose2D(0.0, 0.66), (4.0, 1.0, 0.5))  # from y = 0.16
    scan = take(
        replace(LIDAR, mount=Pose2D(0.0, 0.1), range_max=2.0), replace(EMPTY, boxes=(near,))
    )
    assert np.isnan(scan.ranges[270])
    assert np.isposinf(scan.ranges[90])
    assert np.isnan(scan.ranges).sum() + np.isinf(scan.ranges).sum() < 360


def test_the_share_of_lost_beams():
    description = replace(LIDAR, dropout=0.1, beams=4000)
    scan = take(description, square_room(3.0))
    # 400 +- 3 sqrt(4000 x 0.1 x 0.9) = 57
    assert np.isinf(scan.ranges).sum() == pytest.approx(400, abs=57)


def test_noise_belongs_to_seed_and_step():
    noisy = replace(LIDAR, noise=0.01)
    first, again = (take(noisy, square_room(3.0), step=50).ranges for _ in range(2))
    assert (first == again).all()
    assert (first != take(noisy, square_room(3.0), step=100).ranges).mean() > 0.9
    assert (first != take(noisy, square_room(3.0), step=50, seed=2).ranges).mean() > 0.9


def test_a_narrow_field_of_view_reaches_both_ends():
    description = LidarDescription(Pose2D(0.0, 0.0), beams=271, field_of_view=1.5 * pi)
    scan = take(description, square_room(3.0))
    assert (scan.angles[0], scan.angles[-1]) == pytest.approx((-0.75 * pi, 0.75 * pi))
