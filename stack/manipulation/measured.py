"""What depth cameras see around an arm and nobody knows: points in cells of a grid.

The points of a picture on known objects, on the robot and on what it holds are left out. A thing
that a camera beside the arm sees is taken to be `DEPTH` deep: it does not see the back. A cell
stays occupied while it is hidden, at most for a while, and is free once a picture looks through it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stack.frames.tree import inverse
from stack.geometry.voxels import voxel_keys
from stack.manipulation.kinematics import ArmKinematics
from stack.manipulation.model import ArmModel
from stack.manipulation.own_shape import OwnShape
from stack.manipulation.scene import (
    Box,
    Capsule,
    Cylinder,
    Scene,
    SceneObject,
    ScenePoints,
    Sphere,
)
from stack.types import DepthImage, FloatArray

CELL = 0.02
"""Edge of a cell, metres."""

LEAST = 2
"""Pixels in a cell that make it occupied: single ones may be noise."""

COLUMNS = 160
"""Columns of a picture that are used at least; of wider ones every second, third… row and column.
A pixel of 160 in 60 degrees is 7 mm wide at 1 m."""

KNOWN, ASIDE = 0.015, 0.04
"""Metres above and below known objects, and beside them, within which points belong to them: noise,
and errors of places and mounts. Blocks are picked with a camera that is 3 cm beside its place."""

OWN = 0.045
"""Metres around the robot and what it holds, likewise."""

DEPTH = 0.15
"""Metres that a thing is taken to be deep behind the side of it that is seen."""

BORDER, TALL = 0.03, 0.6
"""Share of the width of a picture at its border, and metres above a thing there that it is taken to
be tall: the picture shows a part of it."""

BEHIND = 0.03
"""Metres behind a cell that a picture shows when it looks through it."""

KEPT = 3.0
"""Seconds for which a cell that is not seen stays occupied."""

BEYOND = 0.2
"""Metres beyond the arm's reach up to which points count."""

MOVED = 0.01
"""Metres by which the base has moved: what was seen before is elsewhere then."""

SAME = 0.045
"""Metres between a new cell and an older one of the same surface."""

SOMETHING = "something that the cameras see"
"""Name of the points in sentences."""


@dataclass(frozen=True, eq=False)
class ArmPicture:
    """A depth picture, and where the robot was when it was taken.

    Attributes:
        image: its mount is in the base frame.
        link_from_base: (4, 4) the arm's base link <- base.
        odom_from_link: (4, 4).
        positions: (n,) of the joints.
        width: between the fingers, metres; None: open, or without fingers.
        in_hand: whether the arm moves the camera.
    """

    image: DepthImage
    link_from_base: FloatArray
    odom_from_link: FloatArray
    positions: FloatArray
    width: float | None
    in_hand: bool = False


class MeasuredPoints:
    """Occupied cells in the frame of the arm's base link.

    Attributes:
        newest: stamp of the newest picture, seconds.
    """

    def __init__(self, model: ArmModel) -> None:
        self._own, self._kinematics = OwnShape(model), ArmKinematics(model)
        self._reach = float(model.reach.max()) + BEYOND
        self._cells = np.empty((0, 3))
        self._first, self._last = np.empty(0), np.empty(0)
        self._place: FloatArray | None = None
        self.newest = -np.inf

    def see(self, picture: ArmPicture, scene: Scene) -> None:
        """Take a picture, while what is known is as in a scene."""
        stamp, place = picture.image.stamp, picture.odom_from_link
        if self._place is None or np.linalg.norm((place - self._place)[:3, 3]) > MOVED:
            self._keep(np.zeros(len(self._cells), bool))
        self._place = place
        self.newest = max(self.newest, stamp)
        kept = ~_looks_through(picture, self._cells) & (self._last > stamp - KEPT)
        self._keep(kept & ~_on_known(self._cells, scene))
        cells = self._unknown(_cells(_points(picture, self._reach), LEAST), picture, scene)
        if not picture.in_hand:  # the other cameras would see through what it guesses
            whole = np.vstack((_behind(cells, picture), _above(cells, picture)))
            cells = self._unknown(_cells(whole, 1), picture, scene)
        known = dict(
            zip(voxel_keys(self._cells, CELL).tolist(), range(len(self._cells)), strict=True)
        )
        fresh = []
        for index, key in enumerate(voxel_keys(cells, CELL).tolist()):
            if key in known:
                self._last[known[key]] = stamp
            else:
                fresh.append(index)
        self._cells = np.vstack((self._cells, cells[fresh]))
        self._first = np.append(self._first, np.full(len(fresh), stamp))
        self._last = np.append(self._last, np.full(len(fresh), stamp))

    @property
    def points(self) -> FloatArray:
        """(m, 3) middles of the occupied cells."""
        return self._cells

    def added_to(self, scene: Scene) -> Scene:
        """Return a scene in which the points are avoided, too."""
        return replace(scene, points=(*scene.points, ScenePoints(SOMETHING, self.points, CELL)))

    def since(self, stamp: float) -> FloatArray:
        """Return the points (k, 3) that were first seen after a time, away from older ones."""
        new = self._first > stamp
        fresh, old = self._cells[new], self._cells[~new]
        if not len(fresh) or not len(old):
            return fresh
        apart = np.linalg.norm(fresh[:, None] - old[None], axis=2).min(axis=1)
        away: FloatArray = fresh[apart > SAME]
        return away

    def _keep(self, kept: NDArray[np.bool_]) -> None:
        self._cells, self._first = self._cells[kept], self._first[kept]
        self._last = self._last[kept]

    def _unknown(self, cells: FloatArray, picture: ArmPicture, scene: Scene) -> FloatArray:
        """Return the cells (k, 3) that are neither on known objects nor on the robot."""
        cells = cells[~_on_known(cells, scene)]
        unknown: FloatArray = cells[~self._is_own(cells, picture, scene)]
        return unknown

    def _is_own(self, points: FloatArray, picture: ArmPicture, scene: Scene) -> NDArray[np.bool_]:
        """Return which points (m, 3) are on the robot or on what it holds."""
        own = self._own.covers(points, picture.positions, picture.width, OWN)
        if scene.held is not None:
            tool = self._kinematics.forward(picture.positions)
            own |= _covers(scene.held, tool @ scene.held.pose, points, (OWN, OWN))
        return own


def _points(picture: ArmPicture, reach: float) -> FloatArray:
    """Return the points (m, 3) of a picture within a distance of the base link, in its frame."""
    image, step = picture.image, max(1, picture.image.camera.width // COLUMNS)
    depth, shown = image.depth[::step, ::step].astype(np.float64), image.camera
    valid = (depth >= image.range_min) & (depth <= image.range_max)
    valid &= depth < reach + float(np.linalg.norm(shown.position))
    rows, columns = np.nonzero(valid)
    pixels: FloatArray = np.column_stack((columns, rows)).astype(np.float64) * step + 0.5
    optical = np.column_stack((shown.rays(pixels), np.ones(len(pixels)))) * depth[valid, None]
    pose = picture.link_from_base @ shown.base_from_optical()
    points = optical @ pose[:3, :3].T + pose[:3, 3]
    found: FloatArray = points[np.square(points).sum(axis=1) < reach**2]
    return found


def _on_known(points: FloatArray, scene: Scene) -> NDArray[np.bool_]:
    """Return which points (m, 3) are in known objects or near them."""
    known = np.zeros(len(points), bool)
    for item in scene.objects:
        known |= _covers(item, item.pose, points, (ASIDE, KNOWN))
    return known


def _covers(
    item: SceneObject, pose: FloatArray, points: FloatArray, margins: tuple[float, float]
) -> NDArray[np.bool_]:
    """Return which points (m, 3) are in an object at a pose (4, 4), or beside or above it."""
    local, (aside, above) = (points - pose[:3, 3]) @ pose[:3, :3], margins
    match item.shape:
        case Box(size):
            half = np.array(size) / 2.0 + (aside, aside, above)
            return np.asarray((np.abs(local) < half).all(axis=1))
        case Cylinder(radius, length) | Capsule(radius, length):
            away, half_length = np.hypot(local[:, 0], local[:, 1]), length / 2.0 + above
            return np.asarray((away < radius + aside) & (np.abs(local[:, 2]) < half_length))
        case Sphere(radius):
            return np.asarray(np.linalg.norm(local, axis=1) < radius + aside)


def _behind(cells: FloatArray, picture: ArmPicture) -> FloatArray:
    """Return cells (k, 3) and points behind them, as seen by the camera."""
    eye = (picture.link_from_base @ np.array([*picture.image.camera.position, 1.0]))[:3]
    ways = cells - eye
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    depths = np.arange(0.0, DEPTH + CELL / 2.0, CELL)
    return np.asarray(cells + depths[:, None, None] * ways).reshape(-1, 3)


def _above(cells: FloatArray, picture: ArmPicture) -> FloatArray:
    """Return what is above the cells (k, 3) at the border of the picture."""
    image = picture.image
    to_optical = inverse(picture.link_from_base @ image.camera.base_from_optical())
    pixels = image.camera.project(cells @ to_optical[:3, :3].T + to_optical[:3, 3])
    height, width = image.depth.shape
    border = BORDER * width
    inner = (pixels > border) & (pixels < (width - border, height - border))
    rises = np.arange(CELL, TALL + CELL / 2.0, CELL)[:, None, None] * (0.0, 0.0, 1.0)
    return np.asarray(cells[~inner.all(axis=1)] + rises).reshape(-1, 3)


def _cells(points: FloatArray, least: int) -> FloatArray:
    """Return the middles (k, 3) of the cells that hold enough points."""
    if not len(points):
        return points
    _, first, counts = np.unique(voxel_keys(points, CELL), return_index=True, return_counts=True)
    middles: FloatArray = (np.floor(points[first[counts >= least]] / CELL) + 0.5) * CELL
    return middles


def _looks_through(picture: ArmPicture, cells: FloatArray) -> NDArray[np.bool_]:
    """Return which cells (k, 3) a picture looks through; what is nearer hides a cell."""
    image = picture.image
    to_optical = inverse(picture.link_from_base @ image.camera.base_from_optical())
    points = cells @ to_optical[:3, :3].T + to_optical[:3, 3]
    column, row = np.floor(np.nan_to_num(image.camera.project(points), nan=-1.0)).astype(np.int64).T
    height, width = image.depth.shape
    in_view = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    through = np.zeros(len(cells), bool)
    seen = image.depth[row[in_view], column[in_view]]
    through[in_view] = (seen <= image.range_max) & (seen > points[in_view, 2] + BEHIND)
    return through
