"""Obstacles from depth cameras: what stands or hangs in the robot's way, and where the floor ends.

A pixel shows an obstacle if its point is between `lowest` and the robot's height, and a missing
floor if it sees below the floor, or nothing where the floor would be within range. The points are
kept in the odom frame, one per voxel, until a picture sees through them: a thing below or beside
the camera's view is still there. This is the ray clearing of a voxel grid, computed by projecting
the kept points into the new picture instead of tracing its rays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf, tan

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.geometry.polygons import points_inside
from stack.geometry.voxels import voxel_keys
from stack.perception.depth.cloud import rays, used_pixels, voxel_means
from stack.perception.depth.parameters import DepthParameters
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

NEARER = 0.8
"""Share of the distance of a point's last sighting from which on a new one replaces its position.
The error of a point grows with the square of its distance."""

PLANE_CELL = 0.02
"""Metres; of points above each other only one is an obstacle in the plane."""

_SQUARE = np.ones((3, 3), np.uint8)


class DepthObstacles:
    """Collects obstacles from the depth cameras of a robot."""

    def __init__(self, robot: RobotDescription, parameters: DepthParameters) -> None:
        self.parameters = parameters
        self._robot = robot
        self._stamps: dict[str, float] = {}
        # x, y, z in the odom frame, last sighting, distance from the camera when placed
        self._points: FloatArray = np.empty((0, 5))
        self._plane: FloatArray = np.empty((0, 2))

    @property
    def is_on(self) -> bool:
        """Whether the depth cameras shall take pictures."""
        return self.parameters.obstacles and bool(self._robot.depth_cameras)

    def configure(self, parameters: DepthParameters) -> None:
        """Apply new parameters; kept points stay unless the cameras are switched off."""
        self.parameters = parameters
        if not parameters.obstacles:
            self._points, self._plane, self._stamps = np.empty((0, 5)), np.empty((0, 2)), {}

    def update(self, observation: Observation, frames: TransformBuffer) -> DepthPoints:
        """Process new pictures; return the obstacles.

        Args:
            observation: the new measurements, with usable pictures only
                (stack/perception/cameras).
            frames: with the odometry up to the observation's time.
        """
        if not self.is_on:
            return NO_DEPTH
        now, changed = observation.time, False
        for name, image in observation.of(DepthImage).items():
            if name not in self._robot.depth_cameras:
                continue
            if not frames.covers(image.stamp) or image.stamp <= self._stamps.get(name, -inf):
                continue  # older than the poses that are kept, or than the last one
            base = frames.pose_at("odom", image.stamp)
            self._forget(image, base)
            self._add(image, base)
            self._stamps[name], changed = image.stamp, True
        if changed:
            self._drop_old(now, frames.pose_at("odom", now))
            self._plane = _in_plane(self._points)
        ages = {name: now - self._stamps.get(name, -inf) for name in self._robot.depth_cameras}
        return DepthPoints(self._plane, ages, changed, self._points[:, :3])

    def _add(self, image: DepthImage, base: Pose2D) -> None:
        """Add the points of a picture; a known point stays where it was unless it came nearer."""
        found = obstacle_points(image, self.parameters, self._robot.height)
        if not len(found):
            return
        away = np.linalg.norm(found - image.camera.position, axis=1)
        rows = np.column_stack(
            [base.transform(found[:, :2]), found[:, 2], np.full(len(found), image.stamp), away]
        )
        both = np.concatenate([rows, self._points])
        _, first, group = np.unique(
            voxel_keys(both, self.parameters.voxel), return_index=True, return_inverse=True
        )
        old = np.full(len(first), -1)
        old[group[len(rows) :]] = np.arange(len(rows), len(both))
        new = first < len(rows)
        stays = new & (old >= 0) & (both[first, 4] > NEARER * both[old, 4])
        kept = both[np.where(stays, old, first)]
        kept[new, 3] = image.stamp
        self._points = kept[np.argsort(-kept[:, 3], kind="stable")][:MOST_POINTS]

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
        known = np.fmax(np.minimum(image.depth, np.float32(NOTHING)), np.float32(0.0))
        nearest = cv2.erode(known, _SQUARE)
        beyond = nearest[np.where(shown, rows, 0), np.where(shown, columns, 0)] - depth
        margin = CLEAR_MARGIN + CLEAR_SHARE * depth
        missing = self._points[:, 2] <= 0.0
        gone = shown & np.where(missing, np.abs(beyond) < margin, beyond > margin)
        self._points = self._points[~gone]

    def _drop_old(self, now: float, base: Pose2D) -> None:
        """Drop the points that are too old, and those below the robot, where it stands."""
        gone = self._points[:, 3] < now - self.parameters.memory
        local = base.inverse().transform(self._points[:, :2])
        near = np.hypot(local[:, 0], local[:, 1]) <= self._robot.footprint.circumscribed_radius
        gone[near] |= points_inside(local[near], self._robot.footprint.points)
        self._points = self._points[~gone]


@dataclass(frozen=True, slots=True)
class _Bounds:
    """Depths, (rows, columns) float32 metres, that decide what each used pixel shows.

    It is an obstacle between `near` and `far`, and a missing floor from `pit` on, at `floor`.
    """

    near: NDArray[np.float32]
    far: NDArray[np.float32]
    pit: NDArray[np.float32]
    floor: FloatArray


@lru_cache(maxsize=8)
def _bounds(
    camera: CameraModel, ranges: tuple[float, float], p: DepthParameters, height: float
) -> _Bounds:
    """Solve the limits of height for the depth of each pixel.

    A point at depth d is at z = h + d r, with h of the camera and r of the ray. The limits widen by
    the error of the pitch, d t up to the floor: an obstacle has z > lowest + d t, which a ray that
    rises less than t leaves at d = (h - lowest) / (t - r), and a missing floor z < -deepest - f t,
    where f is the depth of the floor.
    """
    h, rise, t = camera.position[2], rays(camera)[:, :, 2], tan(p.tilt)
    top, (least, most) = height + p.clearance, ranges
    with np.errstate(divide="ignore", invalid="ignore"):
        leaves = (h - p.lowest) / (t - rise)
        passes = (top - h) / rise
        floor = np.where(rise < 0.0, -h / rise, inf)
        pit = np.where(floor < 0.9 * most, (h + p.deepest + floor * t) / -rise, inf)
    is_low, falls = rise < t, rise < 0.0
    near = np.where(is_low | (h > p.lowest), least, leaves)
    near = np.where(falls & (h > top), np.maximum(near, passes), near)
    far = np.where(is_low, leaves, inf)
    far = np.where(falls, far, np.minimum(far, np.where(rise > 0.0, passes, inf)))
    far = np.minimum(far, np.nextafter(np.float32(most), np.float32(inf)))
    if h > top:
        far = np.where(falls, far, -inf)
    return _Bounds(
        near.astype(np.float32), far.astype(np.float32), pit.astype(np.float32), floor
    )  # fmt: skip


def obstacle_points(image: DepthImage, parameters: DepthParameters, height: float) -> FloatArray:
    """Return (n, 3) obstacles in a picture, one per voxel, base frame; z is 0 where floor misses.

    Args:
        image: of a depth camera.
        parameters: thresholds.
        height: of the robot, metres.
    """
    p, camera = parameters, image.camera
    bounds = _bounds(camera, (image.range_min, image.range_max), p, height)
    depth = used_pixels(image)
    found = (depth >= bounds.near) & (depth < bounds.far)
    beyond = depth > np.float32(image.range_max)
    unseen = cv2.erode(beyond.view(np.uint8), _SQUARE).view(np.bool_)
    missing = ((depth > bounds.pit) & ~beyond) | (unseen & (bounds.pit < inf))
    origin, directions = np.array(camera.position), rays(camera).reshape(-1, 3)
    solid, gaps = np.flatnonzero(found), np.flatnonzero(missing)
    solid_points = origin + depth.ravel()[solid, None] * directions[solid]
    edges = origin + bounds.floor.ravel()[gaps, None] * directions[gaps]
    edges[:, 2] = 0.0
    return np.concatenate([
        voxel_means(solid_points, p.voxel, p.least_pixels),
        voxel_means(edges, p.voxel, p.least_pixels),
    ])  # fmt: skip


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


def _in_plane(points: FloatArray) -> FloatArray:
    """Return (m, 2) the first of all points (n, 3 or more) in the same cell of the plane."""
    columns = np.floor(points[:, :2] * (1.0 / PLANE_CELL)).astype(np.int64) + (1 << 30)
    _, first = np.unique((columns[:, 0] << 31) + columns[:, 1], return_index=True)
    return points[np.sort(first), :2]
