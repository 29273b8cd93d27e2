"""Obstacles from depth cameras: what stands or hangs in the robot's way, and where the floor ends.

A pixel shows an obstacle if its point is between `lowest` and the robot's height, and a missing
floor if it sees below the floor, or nothing where the floor would be within range. The points are
kept in the odom frame, one per voxel, until a picture sees through them: a thing below or beside
the camera's view is still there. This is the ray clearing of a voxel grid, computed by projecting
the kept points into the new picture instead of tracing its rays.
"""

from __future__ import annotations

from functools import lru_cache
from math import inf, tan

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import DepthCameraDescription, RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.geometry.polygons import points_inside
from stack.perception.depth_parameters import DepthParameters
from stack.types import (
    NO_DEPTH,
    CameraModel,
    DepthImage,
    DepthPoints,
    FloatArray,
    Observation,
    Pose2D,
)

CLEAR_MARGIN, CLEAR_SHARE = 0.05, 0.04
"""Metres, and share of the distance, by which a picture must see beyond a point to forget it."""

NOTHING = 1e3
"""Depth in metres that stands for no return."""

MOST_POINTS = 4000
"""Points that are kept, the newest ones; a picture has a few hundred."""


_SQUARE = np.ones((3, 3), np.uint8)


class DepthObstacles:
    """Collects obstacles from the depth cameras of a robot.

    Args:
        robot: with its depth cameras, footprint and height.
        parameters: of the processing.
    """

    def __init__(self, robot: RobotDescription, parameters: DepthParameters) -> None:
        self.parameters = parameters
        self._robot = robot
        self._stamps: dict[str, float] = {}
        self._points: FloatArray = np.empty((0, 4))  # x, y, z in the odom frame, last sighting
        self._forgotten_at = 0.0

    @property
    def is_on(self) -> bool:
        """Whether the depth cameras shall take pictures."""
        return self.parameters.obstacles and bool(self._robot.depth_cameras)

    def configure(self, parameters: DepthParameters) -> None:
        """Apply new parameters; kept points stay unless the cameras are switched off."""
        self.parameters = parameters
        if not parameters.obstacles:
            self._points, self._stamps = np.empty((0, 4)), {}

    def update(self, observation: Observation, frames: TransformBuffer) -> DepthPoints:
        """Process new pictures; return the obstacles.

        Args:
            observation: the new measurements.
            frames: with the odometry up to the observation's time.
        """
        if not self.is_on:
            return NO_DEPTH
        now, changed = observation.time, False
        for name, image in observation.of(DepthImage).items():
            if not self._is_usable(image, self._robot.depth_cameras.get(name)):
                continue
            base = frames.pose_at("odom", image.stamp)
            self._forget(image, base)
            self._add(image, base)
            self._stamps[name], changed = image.stamp, True
        if changed:
            self._drop_old(now, frames.pose_at("odom", now))
        ages = {name: now - self._stamps.get(name, -inf) for name in self._robot.depth_cameras}
        return DepthPoints(self._points[:, :2], ages, changed)

    def _is_usable(self, image: DepthImage, camera: DepthCameraDescription | None) -> bool:
        """Return whether a picture has the camera's size and enough valid pixels."""
        if camera is None or image.depth.shape != (camera.model.height, camera.model.width):
            return False
        valid = np.count_nonzero(np.isfinite(image.depth))
        return bool(valid >= self.parameters.least_valid * image.depth.size)

    def _add(self, image: DepthImage, base: Pose2D) -> None:
        found = obstacle_points(image, self.parameters, self._robot.height)
        if not len(found):
            return
        rows = np.column_stack(
            [base.transform(found[:, :2]), found[:, 2], np.full(len(found), image.stamp)]
        )
        known = np.concatenate([rows, self._points])
        _, first = np.unique(_voxel_keys(known, self.parameters.voxel), return_index=True)
        self._points = known[np.sort(first)][:MOST_POINTS]

    def _forget(self, image: DepthImage, base: Pose2D) -> None:
        """Forget the points that a picture sees through, and missing floor where it sees floor.

        The picture must see beyond a point in all of the 3 x 3 pixels around it.
        """
        if not len(self._points):
            return
        local = base.inverse().transform(self._points[:, :2])
        rows, columns, depth = projected(image.camera, np.column_stack([local, self._points[:, 2]]))
        height, width = image.depth.shape
        shown = (rows >= 1) & (rows < height - 1) & (columns >= 1) & (columns < width - 1)
        shown &= (depth > image.range_min) & (depth < image.range_max)
        nearest = cv2.erode(np.nan_to_num(image.depth, nan=0.0, posinf=NOTHING), _SQUARE)
        beyond = nearest[np.where(shown, rows, 0), np.where(shown, columns, 0)] - depth
        margin = CLEAR_MARGIN + CLEAR_SHARE * depth
        missing = self._points[:, 2] <= 0.0
        gone = shown & np.where(missing, np.abs(beyond) < margin, beyond > margin)
        self._points = self._points[~gone]

    def _drop_old(self, now: float, base: Pose2D) -> None:
        """Drop the points that are too old, and those below the robot, where it stands."""
        old = self._points[:, 3] < now - self.parameters.memory
        below = points_inside(
            base.inverse().transform(self._points[:, :2]), self._robot.footprint.points
        )
        self._points = self._points[~(old | below)]


def obstacle_points(image: DepthImage, parameters: DepthParameters, height: float) -> FloatArray:
    """Return (n, 3) obstacles in a picture, one per voxel, base frame; z is 0 where floor misses.

    Args:
        image: of a depth camera.
        parameters: thresholds.
        height: of the robot, metres.
    """
    p, rays = parameters, _rays(image.camera)
    origin = np.array(image.camera.position)
    depth = image.depth.astype(np.float64)
    z = origin[2] + depth * rays[:, :, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        floor = np.where(rays[:, :, 2] < 0.0, -origin[2] / rays[:, :, 2], inf)
    slack = np.minimum(depth, floor) * tan(p.tilt)
    found = np.isfinite(depth) & (z > p.lowest + slack) & (z < height + p.clearance)
    unseen = np.isposinf(depth) & (cv2.erode(np.isposinf(depth).astype(np.uint8), _SQUARE) > 0)
    below = np.isfinite(depth) & (z < -p.deepest - slack)
    missing = (below | unseen) & (floor < 0.9 * image.range_max)
    solid = origin + depth[found, None] * rays[found]
    edges = origin + floor[missing, None] * rays[missing]
    edges[:, 2] = 0.0
    return np.concatenate([_thinned(solid, p), _thinned(edges, p)])


def projected(
    camera: CameraModel, points: FloatArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Return rows (n,), columns (n,) and depths (n,) in metres of points (n, 3), base frame.

    Rows and columns are -1 where the camera cannot see.
    """
    optical = (points - camera.position) @ camera.base_from_optical()[:3, :3]
    depth = optical[:, 2]
    columns, rows = np.nan_to_num(camera.project(optical), nan=-1.0).T
    return np.floor(rows).astype(np.int64), np.floor(columns).astype(np.int64), depth


@lru_cache(maxsize=8)
def _rays(camera: CameraModel) -> FloatArray:
    """Return (height, width, 3) points at depth 1 m of every pixel, seen from the camera, base."""
    optical = np.ones((camera.height, camera.width, 3))
    optical[:, :, :2] = camera.rays(camera.pixel_centres()).reshape(camera.height, camera.width, 2)
    rays: FloatArray = optical @ camera.base_from_optical()[:3, :3].T
    rays.setflags(write=False)
    return rays


def _voxel_keys(points: FloatArray, side: float) -> NDArray[np.int64]:
    """Return (n,) one number per voxel of points (n, 3 or more); within 50 km of the origin."""
    cells = np.floor(points[:, :3] / side).astype(np.int64) + (1 << 20)
    keys: NDArray[np.int64] = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    return keys


def _thinned(points: FloatArray, parameters: DepthParameters) -> FloatArray:
    """Return (m, 3) the mean point of each voxel that holds enough points."""
    if not len(points):
        return points
    keys = _voxel_keys(points, parameters.voxel)
    _, group, counts = np.unique(keys, return_inverse=True, return_counts=True)
    means = np.column_stack([np.bincount(group, points[:, n]) / counts for n in range(3)])
    dense: FloatArray = means[counts >= parameters.least_pixels]
    return dense
