"""Virtual scans and point clouds of rendered scenes and of known planes."""

from dataclasses import replace
from math import cos, hypot, inf, nan, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.description import DepthScanDescription, lidar_of
from stack.perception.depth.cloud import point_cloud
from stack.perception.depth.scan import VirtualScan
from stack.sim.worlds.world import Box, Wall
from stack.types import DepthImage, Pose2D
from tests.stack.perception.cameras.pictures import DEPTH, SCOUT, floor_picture
from tests.stack.perception.depth.test_depth_obstacles import picture

BAND = DepthScanDescription()
LIDAR = lidar_of(DEPTH, BAND)
SCAN = VirtualScan(DEPTH, BAND, LIDAR)
FRONT = Wall(np.array([[2.05, -3.0], [2.05, 3.0]]))
"""Its face is at x = 2.0."""


def test_the_scan_is_described_as_the_lidar_that_it_stands_for():
    # 87 deg across 160 columns; seen from above, the rows that look down have a wider opening: the
    # topmost, at 35.4 deg above the axis, which is 25 deg below the horizon, has the narrowest.
    camera = replace(DEPTH, scan=BAND)
    robot = replace(SCOUT, lidar=None, depth_cameras={"depth": camera})
    lidar = robot.all_lidars["depth_scan"]
    up = 59.5 / DEPTH.model.focal_length
    widest = 79.5 / DEPTH.model.focal_length / (cos(radians(25)) + up * sin(radians(25)))
    assert lidar.field_of_view == pytest.approx(2 * np.arctan(widest))
    assert lidar.mount == Pose2D(0.14, 0.0) and lidar.beams == 80 and lidar.rate == 10.0
    assert lidar.range_max == 4.0  # the topmost row looks up
    assert robot.main_lidar == "depth_scan" and robot.real_lidars == {}
    assert "depth_scan" in replace(SCOUT, depth_cameras={"depth": camera}).all_lidars


def test_a_camera_that_looks_far_down_has_a_scan_as_far_as_it_sees_the_lower_edge():
    # The topmost row falls by 50 - 35.4 deg: from 0.36 m it is 8 cm high after 0.28 / tan(14.6 deg)
    # in the plane.
    camera = replace(DEPTH, model=replace(DEPTH.model, pitch=radians(50)))
    top = radians(50) - np.arctan(59.5 / DEPTH.model.focal_length)
    assert lidar_of(camera, BAND).range_max == pytest.approx(0.28 / np.tan(top), rel=1e-6)


def test_a_wall_is_where_it_stands_in_every_beam():
    scan = SCAN.of(picture(walls=(FRONT,)))
    points = scan.points()
    assert len(points) > 70
    assert np.abs(points[:, 0] - 2.0).max() < 0.12  # noise 2 cm at 2 m, smallest of two pixels
    assert abs(np.median(points[:, 0]) - 2.0) < 0.05


def test_things_outside_the_band_are_not_in_the_scan():
    low = Box(Pose2D(1.5, 0.0), (0.2, 2.0, 0.05))
    high = Box(Pose2D(1.5, 0.0), (0.2, 2.0, 0.04), elevation=0.45)
    within = Box(Pose2D(1.5, 0.0), (0.2, 2.0, 0.04), elevation=0.25)
    assert not np.isfinite(SCAN.of(picture(boxes=(low, high))).ranges).any()
    points = SCAN.of(picture(boxes=(within,))).points()
    assert len(points) > 40 and np.abs(points[:, 0] - 1.4).max() < 0.1


def test_an_empty_floor_is_free_and_a_blind_camera_is_unknown():
    free = SCAN.of(floor_picture(1.0))
    assert np.all(free.ranges == inf) and free.stamp == 1.0
    blind = replace(floor_picture(1.0), depth=np.full((120, 160), nan, np.float32))
    assert np.isnan(SCAN.of(blind).ranges).all()


@settings(deadline=None, max_examples=25)
@given(st.floats(0.4, 3.5), st.floats(-0.4, 0.4), st.floats(-0.3, 0.6))
def test_a_plane_is_measured_at_its_distance_whatever_the_mount(distance, yaw, pitch):
    model = replace(DEPTH.model, pitch=pitch, yaw=yaw)
    camera = replace(DEPTH, model=model)
    turn = model.base_from_optical()[:3, :3]
    columns = (np.arange(160) + 0.5 - 80) / model.focal_length
    rows = (np.arange(120) + 0.5 - 60) / model.focal_length
    optical = np.stack(
        [np.tile(columns, (120, 1)), np.tile(rows[:, None], (1, 160)), np.ones((120, 160))], axis=-1
    )
    ahead = (optical @ turn.T)[:, :, 0] * cos(yaw) + (optical @ turn.T)[:, :, 1] * sin(yaw)
    depth = np.where(ahead > 0.05, distance / np.maximum(ahead, 0.05), inf)
    depth[depth > 4.0] = inf
    image = DepthImage(0.0, depth.astype(np.float32), model, 0.15, 4.0)
    scan = VirtualScan(camera, BAND, lidar_of(camera, BAND)).of(image)
    away = (scan.points() - model.position[:2]) @ [cos(yaw), sin(yaw)]
    assert np.abs(away - distance).max(initial=0.0) < 0.02 * distance + 1e-3


def test_a_cloud_has_one_point_for_each_voxel_and_can_leave_out_the_floor():
    image = picture(walls=(FRONT,))
    everything, standing = point_cloud(image), point_cloud(image, above=0.06)
    cells = np.floor(everything.points / 0.05).astype(int)
    # A mean may be rounded over the edge of its voxel, but that is rare.
    assert len(np.unique(cells, axis=0)) > 0.99 * len(everything.points)
    assert (everything.points[:, 2] < 0.03).any()
    assert np.abs(np.median(standing.points[:, 0]) - 2.0) < 0.06
    assert standing.points[:, 2].min() > 0.06 and standing.stamp == image.stamp
    coarse = point_cloud(image, voxel=0.2)
    assert len(coarse.points) < 0.2 * len(everything.points)


def test_a_wide_picture_is_decimated_and_shows_the_same():
    scale = 4
    model = replace(
        DEPTH.model, width=640, height=480, focal_length=scale * DEPTH.model.focal_length
    )
    depth = np.kron(floor_picture(0.0).depth, np.ones((scale, scale), np.float32))
    cloud = point_cloud(DepthImage(0.0, depth, model, 0.15, 4.0), voxel=0.2)
    small = point_cloud(floor_picture(0.0), voxel=0.2)
    assert abs(len(cloud.points) - len(small.points)) < 0.15 * len(small.points)
    assert abs(np.median(cloud.points[:, 2])) < 0.02


def test_pixels_out_of_range_are_no_points():
    depth = np.full((120, 160), 9.0, np.float32)
    depth[60, 80], depth[0, 0], depth[1, 1] = 1.0, nan, inf
    points = point_cloud(DepthImage(0.0, depth, DEPTH.model, 0.15, 4.0)).points
    assert len(points) == 1
    x, _, z = points[0]
    assert hypot(x - 0.14, z - 0.36) == pytest.approx(1.0, abs=0.01)
