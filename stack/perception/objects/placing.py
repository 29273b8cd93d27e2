"""Where the objects in a picture are: distances from depth pictures, range sensors or the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.perception.coloured_objects import Patch, placed, size_of
from stack.perception.depth.cloud import rays, used_pixels
from stack.perception.depth.obstacles import projected
from stack.perception.objects.heads import Box
from stack.types import CameraModel, DepthImage, Detection, FloatArray, Image, Pose2D

INSET = 0.2
"""Share of a box at each side in which depth points may belong to things beside the object."""

ABOVE_FLOOR = 0.05
"""Metres; lower depth points may be of the floor."""

LEAST_POINTS = 8
"""Depth points in a box that give its distance."""

NEAR_SHARE, ALIKE = 25, 0.15
"""Per cent of the points in a box that may be nearer than the object, and metres from that distance
within which points belong to it: a chair is full of holes."""

DEPTH_DEVIATION = 0.05
"""Metres; of a distance from a depth picture."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What other sensors measured about when a picture was taken, base frame at its stamp.

    Attributes:
        ranges: (n, 2) points of the range sensors, metres.
        depth: (m, 3) points of the depth cameras, metres.
    """

    ranges: FloatArray
    depth: FloatArray


def depth_points(image: DepthImage) -> FloatArray:
    """Return (n, 3) the points of the used pixels of a depth picture, base frame, metres."""
    depth = used_pixels(image)
    good = np.isfinite(depth) & (depth > 0.0)
    directions = rays(image.camera)[good]
    points: FloatArray = depth[good, None].astype(np.float64) * directions + image.camera.position
    return points


def detection_of(
    box: Box, label: str, image: Image, around: Surroundings, base: Pose2D
) -> Detection | None:
    """Return the object in a box with its place; None if nothing tells how far away it is.

    Args:
        box: in the picture.
        label: of the object.
        image: the picture.
        around: distances that other sensors measured.
        base: at the picture's stamp, map frame.
    """
    camera = image.camera
    left, top, right, bottom = (round(value) for value in box.corners)
    outline = (left, top, max(right, left + 1), max(bottom, top + 1))
    place = _placed_by_depth(box, camera, around.depth)
    if place is None:
        column = None if bottom >= camera.height - 1 else (left + right) / 2
        place = placed(Patch(outline, column), camera, around.ranges)
    if place is None:
        return None
    point, distance, deviation = place
    width, height = size_of(box.corners, camera, distance)
    x, y = base.transform(point[None])[0].tolist()
    return Detection(label, image.stamp, (x, y), deviation, width, height, outline, box.score)


def _placed_by_depth(
    box: Box, camera: CameraModel, points: FloatArray
) -> tuple[FloatArray, float, float] | None:
    """Return point (2,) in the base frame, distance from the camera and its deviation, metres."""
    if not len(points):
        return None
    left, top, right, bottom = box.corners
    across, down = INSET * (right - left), INSET * (bottom - top)
    rows, columns, depth = projected(camera, points)
    inside = (columns >= left + across) & (columns <= right - across) & (depth > 0.0)
    inside &= (rows >= top + down) & (rows <= bottom - down) & (points[:, 2] > ABOVE_FLOOR)
    if np.count_nonzero(inside) < LEAST_POINTS:
        return None
    found = points[inside, :2]
    distances = np.hypot(*(found - np.array(camera.position[:2])).T)
    alike = np.abs(distances - np.percentile(distances, NEAR_SHARE)) <= ALIKE
    point: FloatArray = found[alike].mean(axis=0)
    return point, float(distances[alike].mean()), DEPTH_DEVIATION
