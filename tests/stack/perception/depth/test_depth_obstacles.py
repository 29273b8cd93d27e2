"""Obstacles from depth pictures: rendered scenes with known things, faults, and the memory."""

from dataclasses import replace
from math import cos, inf, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.frames.buffer import TransformBuffer
from stack.perception.depth.obstacles import (
    DepthObstacles,
    obstacle_points,
    projected,
)
from stack.perception.depth.parameters import DepthParameters
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box, Drop, Wall
from stack.types import CameraModel, DepthImage, Observation, Odometry, Pose2D, Twist
from tests.stack.sim.sim_rover import EMPTY

SCOUT = read_robot(find_robot("scout", Path()))
CAMERA = SCOUT.depth_cameras["depth"]
PLATE = Box(Pose2D(2.0, 0.0), (0.8, 1.2, 0.04), elevation=0.30)
KERB = Box(Pose2D(1.2, 0.6), (0.1, 0.1, 0.08))
WELL = Drop((1.0, -0.5, 1.8, 0.5), 1.5)
STEP = Drop((1.0, -0.5, 1.8, 0.5), 0.12)


def picture(*, at=Pose2D(0.0, 0.0), stamp=0.0, number=0, **parts):
    setup = RenderSetup(replace(EMPTY, **parts), SCOUT.model, CAMERA, "depth")
    renderer = CameraRenderer(setup)
    turn = (0.0, 0.0, sin(at.heading / 2), cos(at.heading / 2))
    try:
        depth = renderer.render(
            RenderRequest(number, (at.x, at.y, 0.0), turn, np.empty((0, 3)), {})
        )
    finally:
        renderer.close()
    return DepthImage(stamp, depth, CAMERA.model, CAMERA.range_min, CAMERA.range_max)


def points(image, **parameters):
    return obstacle_points(image, DepthParameters(**parameters), SCOUT.height)


def within(found, x, y, margin=0.06):
    """Which points lie in a rectangle x, y (each low, high), grown by a voxel and its noise."""
    return (
        (found[:, 0] > x[0] - margin) & (found[:, 0] < x[1] + margin)
        & (found[:, 1] > y[0] - margin) & (found[:, 1] < y[1] + margin)
    )  # fmt: skip


def test_the_depth_of_a_wall_is_that_along_the_optical_axis():
    # The camera is at x = 0.14, 0.36 m high, 25 deg down; its axis meets a wall at x = 1.05, with
    # its face at 1.0, after 0.86 / cos(25 deg) = 0.9489 m, 0.401 m lower: below the floor. So it
    # is the floor that the axis meets, after 0.36 / sin(25 deg) = 0.8518 m.
    far = picture().depth[60, 80]
    near = picture(walls=(Wall(np.array([[0.85, -2.0], [0.85, 2.0]])),)).depth[60, 80]
    assert far == pytest.approx(0.8518, abs=0.02)
    assert near == pytest.approx(0.66 / cos(np.radians(25.0)), abs=0.02)


def test_a_free_floor_shows_no_obstacle():
    for number in range(20):
        assert len(points(picture(number=number))) == 0


def test_a_plate_below_the_robots_top_and_a_kerb_are_obstacles():
    found = points(picture(boxes=(PLATE, KERB)))
    plate, kerb = within(found, (1.6, 2.4), (-0.6, 0.6)), within(found, (1.15, 1.25), (0.55, 0.65))
    assert plate.sum() >= 20 and kerb.sum() >= 2
    assert np.all(plate | kerb)
    assert np.all(np.abs(found[plate, 2] - 0.32) < 0.06)


def test_what_hangs_above_the_robot_is_no_obstacle():
    assert len(points(picture(boxes=(replace(PLATE, elevation=0.55),)))) == 0


@pytest.mark.parametrize("drop", [WELL, STEP], ids=["stairwell", "step"])
def test_the_edge_of_a_missing_floor_is_an_obstacle(drop):
    found = points(picture(drops=(drop,)))
    assert np.all(within(found, (1.0, 1.8), (-0.5, 0.5)))
    assert np.all(found[:, 2] == 0.0)
    edge = found[within(found, (1.0, 1.15), (-0.5, 0.5))]
    assert np.ptp(edge[:, 1]) > 0.85  # the whole edge of 1 m, but for the last voxels


@given(
    st.floats(-0.6, 0.6), st.floats(0.0, 1.2), st.floats(0.3, 5.0), st.floats(-1.0, 1.0),
    st.floats(-0.2, 0.3),
)  # fmt: skip
def test_a_projected_point_is_where_its_ray_goes(pitch, yaw, ahead, left, z):
    camera = CameraModel(320, 240, 200.0, (0.1, 0.05, 0.3), pitch, yaw)
    point = np.array([0.1 + ahead, 0.05 + left, z])
    rows, columns, depth = projected(camera, point[None])
    if depth[0] < 0.1:
        return
    x, y = (columns[0] + 0.5 - 160) / 200.0, (rows[0] + 0.5 - 120) / 200.0
    back = camera.base_from_optical() @ [x * depth[0], y * depth[0], depth[0], 1.0]
    # Half a pixel at this depth, in both directions.
    assert np.linalg.norm(back[:3] - point) <= depth[0] * np.hypot(0.5, 0.5) / 200.0 + 1e-9


class Seen:
    """A robot at rest, or moved by `to`, whose pictures pass through the memory."""

    def __init__(self, **parameters):
        self.obstacles = DepthObstacles(SCOUT, DepthParameters(**{"obstacles": True, **parameters}))
        self.frames, self.now = TransformBuffer(10.0), 0.0

    def see(self, image=None, *, at=Pose2D(0.0, 0.0), after=0.1):
        self.now += after
        self.frames.add(Odometry(self.now, at, Twist()))
        measured = {} if image is None else {"depth": replace(image, stamp=self.now)}
        return self.obstacles.update(Observation(self.now, measured), self.frames)


def test_a_thing_taken_away_is_forgotten_and_one_out_of_view_is_not():
    seen = Seen()
    assert len(seen.see(picture(boxes=(KERB,))).points) >= 2
    behind = Pose2D(1.6, 0.0)  # the kerb is now 0.35 m behind the camera
    assert len(seen.see(picture(at=behind, boxes=(KERB,)), at=behind).points) >= 2
    assert len(seen.see(picture(number=3), at=Pose2D(0.0, 0.0)).points) == 0


def test_a_missing_floor_stays_until_the_floor_is_seen():
    seen = Seen()
    assert len(seen.see(picture(drops=(WELL,))).points) > 50
    kept = seen.see(picture(drops=(WELL,), number=1)).points
    assert len(kept) > 50
    assert len(seen.see(picture(number=2)).points) < 0.02 * len(kept)


def test_points_that_no_picture_shows_again_expire():
    seen, away = Seen(memory=5.0), Pose2D(3.0, 0.0)
    seen.see(picture(boxes=(KERB,)))
    assert len(seen.see(picture(at=away, boxes=(KERB,)), at=away, after=4.0).points) >= 2
    assert len(seen.see(picture(at=away, boxes=(KERB,)), at=away, after=2.0).points) == 0


def test_a_camera_that_never_delivers_is_infinitely_old_and_one_that_is_off_has_no_age():
    assert Seen().see().ages == {"depth": inf}
    off = Seen(obstacles=False)
    assert off.see(picture(boxes=(KERB,))).ages == {} and not off.obstacles.is_on


def test_a_known_point_stays_where_it_is_until_it_is_seen_from_much_nearer():
    seen, near = Seen(), Pose2D(1.0, 0.0)
    first = {tuple(p) for p in seen.see(picture(boxes=(PLATE,))).spatial.tolist()}
    again = {tuple(p) for p in seen.see(picture(boxes=(PLATE,), number=1)).spatial.tolist()}
    assert len(first) >= 20 and len(first & again) > 0.9 * len(first)
    closer = picture(boxes=(PLATE,), at=near, number=2)
    after = {tuple(p) for p in seen.see(closer, at=near).spatial.tolist()}
    # From 1.5 m instead of 2.5 m, the points in view have moved; those beside the view have not.
    assert 0 < len(first & after) < 0.5 * len(first)
