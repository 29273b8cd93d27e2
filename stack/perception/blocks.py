"""Blocks for an arm: boxes of one colour in a colour and a depth picture.

Points of the depth picture get the colour that they have in the colour picture. Each connected
group of points of one colour is a block: it stands on the level plane on which most of the points
around it lie, its top face is where its points end upwards, and a rectangle is fitted to that face.
The visible sides are no part of the rectangle. What is seen before the block, such as fingers,
covers a part of it and cuts nothing off.

Blocks of one colour that touch each other are reported as one, with a size that does not fit; so
are blocks of one colour on each other. A block that stands on one of another colour has its own
height; of the lower one too little is seen, and it is left out unless its top is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import pi, sqrt
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.frames.tree import inverse
from stack.perception.coloured_objects import colour_mask
from stack.perception.depth.cloud import decimation, rays, used_pixels
from stack.perception.planes import Plane, level_plane
from stack.perception.rectangles import EdgeEvidence, Rectangle, fit_rectangle
from stack.types import OBJECT_COLOURS, Block, CameraModel, DepthImage, FloatArray, Image, on_floor
from stack.types import ObjectColour as Colour

LEAST_POINTS = 15
"""Points of a group, and of its top face; smaller groups are no blocks."""

LEAST_SIDE, LEAST_HEIGHT = 0.012, 0.008
"""Metres; smaller things, such as coloured tape, are no blocks."""

AROUND, BELOW = 0.06, 0.3
"""Metres to the sides of a group of points and below it in which its support is searched."""

APART = 1.6
"""Side of the cells in which neighbouring points of one block are, in distances of the points."""

BAND, NOISES = 0.001, 2.0
"""Metres, and standard deviations of the points, from the top within which they belong to it."""

LEAST_NOISE = 0.0005
"""Smallest standard deviation of the points of a side, metres."""

BORDER = 4
"""Pixels around a group of points whose labels determine the edges of its top face."""

UNDER = 0.01
"""Metres from the outline of a block within which the middle of what carries it is seen."""

EQUAL_SIDES = 0.004
"""Metres; sides that differ by less look equally long."""

INSIDE, EMPTY = 0.008, 0.3
"""Metres from the faces of a block: errors of its pose are smaller. Share of the points inside it
that a picture looks through if the block is not there."""

MODEL_ERROR = 0.001
"""Standard deviation of a position that noise does not explain, metres: lens, mount, edges."""


@dataclass(frozen=True, eq=False)
class _View:
    """Points of a depth picture and their colours.

    Attributes:
        points: (rows, columns, 3) base frame; NaN where nothing is measured.
        directions: (rows, columns, 3) of their rays, base frame, at depth 1 m.
        depth: (rows, columns) metres; not finite where nothing is measured.
        colours: (rows, columns) index in OBJECT_COLOURS; -1: none.
        eye: (3,) position of the camera, base frame.
        pixel: mean side of a pixel at 1 m, metres.
    """

    points: FloatArray
    directions: FloatArray
    depth: FloatArray
    colours: NDArray[np.int8]
    eye: FloatArray
    pixel: float


@dataclass(frozen=True, eq=False)
class _Group:
    """Connected points of one colour above what they stand on.

    Attributes:
        colour: index in OBJECT_COLOURS.
        members: (rows, columns) its pixels.
        middle: (3,) mean of its points, base frame.
        plane: on which it stands.
        top: height of its top above the plane, metres.
        on_top: number of points of its top.
        face: the top in the coordinates of `_axes`; None if too little of it is seen.
    """

    colour: int
    members: NDArray[np.bool_]
    middle: FloatArray
    plane: Plane
    top: float
    on_top: int
    face: Rectangle | None


class BlockDetector:
    """Detector of blocks; searches the same pictures once.

    Attributes:
        base_from_link: (4, 4) pose in the base frame of the arm's base link, in which the blocks
            are reported.
    """

    def __init__(self, base_from_link: FloatArray) -> None:
        self.base_from_link = base_from_link
        self._last: tuple[Image, DepthImage, tuple[Block, ...]] | None = None

    def detect(self, image: Image, depth: DepthImage) -> tuple[Block, ...]:
        """Return the blocks in a pair of pictures, the largest first for each colour.

        Args:
            image: of a colour camera that sees what the depth camera sees.
            depth: taken while nothing has moved between both.
        """
        last = self._last
        if last is None or last[0] is not image or last[1] is not depth:
            groups = _groups(_view(image, depth))
            found = tuple(
                _block(group, groups, self.base_from_link, depth.stamp)
                for group in groups if group.face is not None
            )  # fmt: skip
            self._last = last = image, depth, found
        return last[2]

    def is_gone(self, block: Block, depth: DepthImage) -> bool:
        """Return whether a picture looks through the place of a block.

        What is nearer than the block hides the place and says nothing.
        """
        half = np.maximum(block.size / 2.0 - INSIDE, 0.0)
        local = half * np.array(list(product((-1.0, -0.5, 0.0, 0.5, 1.0), repeat=3)))
        to_optical = inverse(depth.camera.base_from_optical()) @ self.base_from_link @ block.pose
        points = local @ to_optical[:3, :3].T + to_optical[:3, 3]
        pixels = np.nan_to_num(depth.camera.project(points), nan=-1.0)
        column, row = np.floor(pixels).astype(np.int64).T
        height, width = depth.depth.shape
        in_view = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        seen = depth.depth[row[in_view], column[in_view]]
        through = (seen <= depth.range_max) & (seen > points[in_view, 2])
        return bool(through.sum() > EMPTY * len(points))


def _view(image: Image, depth: DepthImage) -> _View:
    distances = used_pixels(depth).astype(np.float64)
    distances[~((distances >= depth.range_min) & (distances <= depth.range_max))] = np.nan
    camera, directions = depth.camera, rays(depth.camera)
    eye = np.array(camera.position)
    points = eye + distances[..., None] * directions
    pixel = decimation(camera) / sqrt(camera.fx * camera.fy)
    return _View(points, directions, distances, _colours(image, points), eye, pixel)


def _colours(image: Image, points: FloatArray) -> NDArray[np.int8]:
    """Return (rows, columns) the colour of each point in a picture, -1 without one."""
    seen = _picture_colours(image.pixels)
    found = np.full(points.shape[:2], -1, np.int8)
    there = np.isfinite(points[..., 0])
    camera: CameraModel = image.camera
    optical = inverse(camera.base_from_optical())
    pixels = camera.project(points[there] @ optical[:3, :3].T + optical[:3, 3])
    pixels = np.where(np.isfinite(pixels), pixels, -1.0)
    column, row = np.floor(pixels).astype(np.int64).T
    inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
    labels = np.full(len(pixels), -1, np.int8)
    labels[inside] = seen[row[inside], column[inside]]
    found[there] = labels
    return found


def _picture_colours(pixels: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Return (height, width) the colour of each pixel, -1 without one.

    Pixels at the edge of a colour are mixtures: they count to it, and depth decides.
    """
    masks = [colour_mask(pixels, cast("Colour", colour)) for colour in OBJECT_COLOURS]
    found = np.full(pixels.shape[:2], -1, np.int8)
    for number, mask in enumerate(masks):
        found[cv2.dilate(mask, np.ones((3, 3), np.uint8)) > 0] = number
    for number, mask in enumerate(masks):
        found[mask > 0] = number
    return found


def _groups(view: _View) -> list[_Group]:
    found = []
    for colour in range(len(OBJECT_COLOURS)):
        for rough in _connected(view, view.colours == colour):
            plane = _support(view, rough)
            if plane is None:
                continue
            above = rough & (plane.heights(view.points) > LEAST_HEIGHT)
            for members in _connected(view, above):
                found.append(_group(view, colour, members, plane))
    return found


def _connected(view: _View, chosen: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Return the masks of groups of pixels whose points are near each other, seen from above."""
    if np.count_nonzero(chosen) < LEAST_POINTS:
        return []
    level = view.points[chosen][:, :2]
    slope = np.abs(view.directions[chosen][:, 2]) / np.linalg.norm(view.directions[chosen], axis=1)
    spread = view.pixel * view.depth[chosen] / np.maximum(slope, 0.3)
    side = APART * float(np.median(spread))
    cells = np.floor((level - level.min(axis=0)) / side).astype(np.int64)
    occupied = np.zeros(cells.max(axis=0) + 1, np.uint8)
    occupied[cells[:, 0], cells[:, 1]] = 1
    count, labels = cv2.connectedComponents(occupied, connectivity=4)
    numbers = np.zeros(chosen.shape, np.int64)
    numbers[chosen] = labels[cells[:, 0], cells[:, 1]]
    sizes = np.bincount(numbers.ravel(), minlength=count)
    order = sorted(range(1, count), key=lambda number: -int(sizes[number]))
    return [numbers == number for number in order if sizes[number] >= LEAST_POINTS]


def _support(view: _View, members: NDArray[np.bool_]) -> Plane | None:
    """Return the plane of most of the points without colour around and below a group."""
    own = view.points[members]
    low, high = own.min(axis=0), own.max(axis=0)
    around = (view.colours < 0) & (view.points[..., 2] > high[2] - BELOW)
    around &= view.points[..., 2] < high[2]
    for axis in (0, 1):
        around &= view.points[..., axis] > low[axis] - AROUND
        around &= view.points[..., axis] < high[axis] + AROUND
    return level_plane(view.points[around])


def _group(view: _View, colour: int, members: NDArray[np.bool_], plane: Plane) -> _Group:
    points = view.points[members]
    heights = plane.heights(points)
    band = BAND + NOISES * plane.deviation
    # A high block seen from the side shows at least a third of its points at its top.
    top = float(np.percentile(heights, 85.0))
    for _ in range(3):
        top = float(np.median(heights[np.abs(heights - top) <= band]))
    on_top = int((np.abs(heights - top) <= band).sum())
    face = _face(view, members, plane, top, band) if on_top >= LEAST_POINTS else None
    if face is not None and face.sides.min() < LEAST_SIDE:
        face = None
    return _Group(colour, members, points.mean(axis=0), plane, top, on_top, face)


def _axes(plane: Plane) -> FloatArray:
    """Return (3, 2) two directions in a plane, the first one nearest to x of the base."""
    first = np.array([1.0, 0.0, 0.0]) - plane.normal[0] * plane.normal
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(plane.normal, first)])


def _face(
    view: _View, members: NDArray[np.bool_], plane: Plane, top: float, band: float
) -> Rectangle | None:
    """Return the top face of a group of points.

    Each pixel around it shows a point of the plane of the top, where the face is or is not.
    """
    rows, columns = np.nonzero(members)
    part = (
        slice(max(0, rows.min() - BORDER), rows.max() + BORDER + 1),
        slice(max(0, columns.min() - BORDER), columns.max() + BORDER + 1),
    )
    down = view.directions[part] @ plane.normal
    reach = (plane.offset + top - plane.normal @ view.eye) / np.where(down < 0.0, down, -1e-9)
    depth, measured = view.depth[part], plane.heights(view.points[part])
    inside = members[part] & (np.abs(measured - top) <= band)
    # What is nearer than the top hides whether the top is there.
    known = np.isfinite(depth) & (inside | (depth > reach - 2.0 * band)) & (down < 0.0)
    spot = view.eye + reach[..., None] * view.directions[part]
    level = (spot[known] @ _axes(plane)).reshape(-1, 2)
    distance = float(np.median(reach[inside]))
    ray = np.median(view.directions[part][inside], axis=0)
    slope = float(-ray @ plane.normal)
    spacing = view.pixel * distance / sqrt(max(slope / float(np.linalg.norm(ray)), 0.1))
    # Points of a side that are less than a band below the top count to it.
    across = ray @ _axes(plane) / slope
    below = members[part] & (measured < top - band)
    sides = view.points[part][below] @ _axes(plane)
    noise = max(LEAST_NOISE, plane.deviation * float(np.linalg.norm(across)))
    return fit_rectangle(EdgeEvidence(level, inside[known], spacing, -band * across, sides, noise))


def _block(group: _Group, groups: list[_Group], base_from_link: FloatArray, stamp: float) -> Block:
    plane, face, axes = group.plane, group.face, _axes(group.plane)
    assert face is not None
    height = group.top - _carried(group, face, groups)
    along = axes @ np.array([np.cos(face.angle), np.sin(face.angle)])
    place = np.eye(4)
    place[:3, :3] = np.column_stack([along, np.cross(plane.normal, along), plane.normal])
    middle = plane.offset + group.top - height / 2.0
    place[:3, 3] = axes @ face.centre + middle * plane.normal
    pose = inverse(base_from_link) @ place
    pose, size = _ordered(pose, np.array([*face.sides, height]))
    turn = (inverse(base_from_link)[:3, :3] @ axes)[:2]
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = turn @ face.covariance[:2, :2] @ turn.T + MODEL_ERROR**2 * np.eye(2)
    covariance[:2, 3] = covariance[3, :2] = turn @ face.covariance[:2, 2]
    covariance[3, 3] = face.covariance[2, 2]
    noise = plane.deviation**2 * (1.0 / group.on_top + 1.0 / plane.count)
    covariance[2, 2] = noise + MODEL_ERROR**2
    return Block(cast("Colour", OBJECT_COLOURS[group.colour]), pose, size, covariance, stamp)


def _carried(group: _Group, face: Rectangle, groups: list[_Group]) -> float:
    """Return the height above the plane at which a block stands: on another one, or 0."""
    axes, found = _axes(group.plane), 0.0
    for other in groups:
        reached = other.top
        if other is group or other.colour == group.colour or reached > group.top - LEAST_HEIGHT:
            continue
        under = face.contains((other.middle @ axes)[None], UNDER)[0]
        if other.face is not None:
            centre = (axes @ face.centre) @ _axes(other.plane)
            under |= other.face.contains(centre[None])[0]
        if under:
            found = max(found, reached)
    return found


def _ordered(pose: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return pose and size with x along the longer side; a box looks the same turned by 180 deg."""
    yaw = on_floor(pose).heading
    if abs(size[0] - size[1]) < EQUAL_SIDES:
        quarters = -round(yaw / (pi / 2))
    else:
        quarters = int(size[1] > size[0])
        quarters += 2 * round(-(yaw + quarters * pi / 2) / pi)
    turned = pose.copy()
    for _ in range(quarters % 4):
        turned[:3, 0], turned[:3, 1] = turned[:3, 1].copy(), -turned[:3, 0]
    return turned, size if quarters % 2 == 0 else size[[1, 0, 2]]
