from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.drivetrain.description import LidarDescription
from stack.sim.physics.pybullet_engine.engine import BulletEngine
from stack.sim.scene_state import SceneState
from stack.sim.sensors.lidar import Lidar
from stack.sim.worlds.world import Box, Cylinder, Door, Wall
from stack.streams import stream
from stack.types import Pose2D
from tests.stack.sim.sim_rover import EMPTY, LIDAR, square_range, square_room


def take(description, world, pose=Pose2D(0.0, 0.0), seed=1, step=0, people=()):
    doors = {door.name: door.closed for door in world.doors}
    crowd = np.array(people, dtype=float).reshape(-1, 3)
    return Lidar(description, world, seed).scan([(0.0, pose)], SceneState(crowd, doors), step, 0.0)


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
    )
    scan = take(LIDAR, world, people=[(0.1, -4.0, 0.25)])
    ahead, left, right, behind = scan.ranges[[180, 270, 90, 0]]
    assert ahead == pytest.approx(2.0, abs=1e-3)
    assert left == pytest.approx(2.5, abs=1e-3)
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


def rays(world, pose, scan, height):
    """The same beams through PyBullet's own shapes, the robot's left out."""
    import pybullet

    physics = BulletEngine(world)
    sensor = pose.compose(scan.mount)
    angles = sensor.heading + scan.angles
    starts = np.tile([sensor.x, sensor.y, height], (len(angles), 1))
    ends = starts + 20.0 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    hits = pybullet.rayTestBatch(starts, ends, numThreads=1, physicsClientId=physics.client)
    physics.close()
    return np.array([20.0 * hit[2] if hit[0] >= 0 else np.inf for hit in hits])


@pytest.mark.parametrize("turn", [2.0 * pi, 1.5 * pi])
def test_ranges_agree_with_the_collision_shapes(turn):
    random = stream(7, "places")
    poses = [Pose2D(*random.uniform(-8, 8, 2), random.uniform(0, 6)) for _ in range(60)]
    zigzag = Wall(random.uniform(-9, 9, (6, 2)), thickness=0.2)
    world = replace(
        EMPTY,
        walls=(zigzag,),
        boxes=tuple(Box(pose, (0.6, 0.3, 0.1 * n)) for n, pose in enumerate(poses[:20])),
        cylinders=tuple(Cylinder(p.x, p.y, 0.1, 0.05 * n) for n, p in enumerate(poses[20:50])),
    )
    description = replace(LIDAR, height=0.33, range_max=20.0, range_min=0.0, field_of_view=turn)
    for pose in poses[50:]:
        scan = take(description, world, pose)
        true = rays(world, pose, scan, 0.33)
        both = np.isfinite(true) & np.isfinite(scan.ranges)
        # A few beams graze a prism's edge where the cylinder bulges, or pass a corner on the
        # other side; all others agree to the prism's depth.
        agree = np.abs(true[both] - scan.ranges[both]) < 2e-3
        assert agree.mean() > 0.96
        assert (np.isfinite(true) == np.isfinite(scan.ranges)).mean() > 0.99
        assert both.sum() > 50


def test_all_ranges_inside_a_cylinder_are_invalid():
    world = replace(EMPTY, cylinders=(Cylinder(0.1, 0.0, 0.5),))
    assert np.isnan(take(LIDAR, world).ranges).all()
