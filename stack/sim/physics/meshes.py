"""Triangles of the static parts of a world, by colour, and their files.

Triangles are arrays (n, 3, 3) of triangle, corner and coordinate, metres, anticlockwise seen from
outside. They share no corners, so that every face is flat-shaded. All parts are upright prisms. A
wall is a row of slabs with a round pillar at every inner corner, which fills joints of any angle. A
cylinder is a prism with many sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from hashlib import sha256
from itertools import pairwise
from math import cos, pi, sin
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.sim.worlds.world import Box, Colour, Cylinder, Drop, FloorLine, Wall, World
from stack.types import FloatArray, Pose2D

Bounds = tuple[float, float, float, float]
Solid = Wall | Box | Cylinder
Key = TypeVar("Key", str, Colour)

CYLINDER_SIDES = 32
"""The sides lie at most radius x (1 - cos(pi / 32)) = 0.5 % of the radius inside the circle."""

PILLAR_SIDES = 12


PAINT_HEIGHT = 0.0005
"""Metres of paint above the floor, enough for the renderers to tell which is on top. Seen from a
camera of height h, paint seems farther away by its own height over h, in parts of its distance."""

STAND_OFF = 0.002
"""Distance between a board and its wall, metres; prevents z-fighting in the renderer."""

LEVEL = 0.7
"""Vertical part of the normal of a face from which on it counts as level."""

LEAST_MITRE = 0.35
"""Cosine of half the turn at a corner, below which its outer point is cut off."""


def obj_text(corners: FloatArray) -> str:
    """Return triangles as a Wavefront OBJ text."""
    vertices = corners.reshape(-1, 3).tolist()
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"f {n} {n + 1} {n + 2}" for n in range(1, len(vertices), 3)]
    return "\n".join(lines) + "\n"


def tiled_obj_text(corners: FloatArray, side: float) -> str:
    """Return triangles as a Wavefront OBJ text with texture coordinates.

    A square image repeats every `side` metres: on upright faces along the wall and from the
    floor up, on level ones along x and y.
    """
    vertices = corners.reshape(-1, 3).tolist()
    edges = np.diff(corners, axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    across = np.column_stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))])
    level = np.abs(normals[:, 2]) > LEVEL
    across[level] = (1.0, 0.0, 0.0)
    up = np.where(level[:, None], (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    tiles = np.stack([np.einsum("nij,nj->ni", corners, axis) for axis in (across, up)], axis=2)
    tiles /= side
    tiles -= np.floor(tiles.min(axis=1, keepdims=True))  # the renderer repeats upwards only
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in tiles.reshape(-1, 2).tolist()]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals.tolist()]
    lines += [
        f"f {n}/{n}/{face} {n + 1}/{n + 1}/{face} {n + 2}/{n + 2}/{face}"
        for face, n in enumerate(range(1, len(vertices), 3), start=1)
    ]
    return "\n".join(lines) + "\n"


def board_obj_text(
    position: tuple[float, float, float], heading: float, size: tuple[float, float]
) -> str:
    """Return an upright rectangle that a picture covers as a Wavefront OBJ text.

    Args:
        position: of its centre, metres; it is drawn STAND_OFF in front of that.
        heading: that it faces, radians.
        size: width and height, metres.
    """
    forward = np.array([cos(heading), sin(heading), 0.0])
    right = np.array([-sin(heading), cos(heading), 0.0])  # as seen from in front of the board
    up = np.array([0.0, 0.0, 1.0])
    half = size[0] / 2.0, size[1] / 2.0
    middle = np.array(position) + STAND_OFF * forward
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = [middle + half[0] * u * right + half[1] * v * up for u, v in signs]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners]
    lines += [f"vt {(u + 1) / 2:.1f} {(v + 1) / 2:.1f}" for u, v in signs]
    lines += ["vn {:.6f} {:.6f} {:.6f}".format(*forward)]
    lines += ["f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]
    return "\n".join(lines) + "\n"


def file_name(content: str | bytes, ending: str) -> str:
    """Return a file name from a hash of the content; PyBullet caches meshes by file name."""
    raw = content.encode() if isinstance(content, str) else content
    return f"{sha256(raw).hexdigest()[:24]}.{ending}"


def static_meshes(world: World) -> dict[Colour, FloatArray]:
    """Return the triangles of walls, boxes and cylinders by colour, in order of appearance."""
    return _grouped(world, lambda solid: solid.colour)


def plain_meshes(world: World) -> dict[Colour, FloatArray]:
    """Return those that are neither of glass nor have a texture, by colour."""

    def key_of(solid: Solid) -> Colour | None:
        return None if _is_glass(solid) or _texture_of(solid) else solid.colour

    return _grouped(world, key_of)


def glass_meshes(world: World) -> dict[Colour, FloatArray]:
    """Return those of glass, by colour."""
    return _grouped(world, lambda solid: solid.colour if _is_glass(solid) else None)


def textured_meshes(world: World) -> dict[str, FloatArray]:
    """Return those with a texture, by its name."""
    return _grouped(world, lambda solid: None if _is_glass(solid) else _texture_of(solid))


def _grouped(world: World, key_of: Callable[[Solid], Key | None]) -> dict[Key, FloatArray]:
    """Return the triangles of the solids by a key, without those that have none."""
    parts: dict[Key, list[FloatArray]] = {}
    solids: tuple[Solid, ...] = (*world.walls, *world.boxes, *world.cylinders)
    for solid in solids:
        key = key_of(solid)
        if key is not None:
            parts.setdefault(key, []).extend(_prisms(solid))
    return {key: np.concatenate(found) for key, found in parts.items() if found}


def _is_glass(solid: Solid) -> bool:
    return isinstance(solid, Wall) and solid.glass


def _texture_of(solid: Solid) -> str | None:
    return None if isinstance(solid, Cylinder) or solid.texture == "plain" else solid.texture


def floor(bounds: Bounds, drops: Sequence[Drop]) -> FloatArray:
    """Return the floor at height 0 within x_min, y_min, x_max, y_max, with its drops cut out."""
    x_min, y_min, x_max, y_max = bounds
    xs = sorted({x_min, x_max, *(x for d in drops for x in d.bounds[::2] if x_min < x < x_max)})
    ys = sorted({y_min, y_max, *(y for d in drops for y in d.bounds[1::2] if y_min < y < y_max)})
    quads = [
        _quad((left, low, 0.0), (right, low, 0.0), (right, high, 0.0), (left, high, 0.0))
        for low, high in pairwise(ys)
        for left, right in pairwise(xs)
        if not any(d.contains(np.array([[(left + right) / 2, (low + high) / 2]])) for d in drops)
    ]
    return np.concatenate(quads)


def painted(line: FloorLine) -> FloatArray:
    """Return a painted line: a ribbon just above the floor, with mitred corners."""
    points = np.asarray(line.points, dtype=np.float64)
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    before, after = np.vstack([along[:1], along]), np.vstack([along, along[-1:]])
    if len(points) > 3 and np.allclose(points[0], points[-1]):
        before[0], after[-1] = along[-1], along[0]
    middle = before + after
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    cosine = np.maximum((middle * after).sum(axis=1, keepdims=True), LEAST_MITRE)
    offset = line.width / 2.0 * np.column_stack([-middle[:, 1], middle[:, 0]]) / cosine
    height = np.full(len(points), PAINT_HEIGHT)
    left, right = (np.column_stack([points + side * offset, height]) for side in (1, -1))
    quads = [_quad(right[n], right[n + 1], left[n + 1], left[n]) for n in range(len(points) - 1)]
    return np.concatenate(quads)


def pits(drops: Sequence[Drop]) -> list[FloatArray]:
    """Return the bottom and the sides of every drop, seen from above."""
    found = []
    for drop in drops:
        x_min, y_min, x_max, y_max = drop.bounds
        corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
        low, high = ([(x, y, z) for x, y in corners] for z in (-drop.depth, 0.0))
        quads = [_quad(*low)]
        quads += [_quad(low[n], high[n], high[n - 1], low[n - 1]) for n in range(4)]
        found.append(np.concatenate(quads))
    return found


def _quad(*corners: tuple[float, float, float] | FloatArray) -> FloatArray:
    """Return the two triangles (2, 3, 3) of a quadrilateral with these four corners."""
    a, b, c, d = (np.array(corner) for corner in corners)
    return np.array([[a, b, c], [a, c, d]])


def box_outline(pose: Pose2D, length: float, width: float) -> FloatArray:
    """Return the corners (4, 2) of a rectangle centred on a pose, anticlockwise."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (length / 2.0, width / 2.0)
    return pose.transform(half)


def box_prism(pose: Pose2D, size: tuple[float, float, float], elevation: float = 0.0) -> FloatArray:
    """Return the triangles (12, 3, 3) of an upright box above a pose, at an elevation."""
    outline = box_outline(pose, size[0], size[1])
    return _prism(outline, elevation + size[2], elevation)


def slab(start: FloatArray, end: FloatArray) -> tuple[Pose2D, float]:
    """Return the centre pose of an upright slab from `start` to `end`, and its length, metres."""
    along = end - start
    middle = (start + end) / 2.0
    heading = float(np.arctan2(along[1], along[0]))
    return Pose2D(float(middle[0]), float(middle[1]), heading), float(np.hypot(*along))


def wall_slabs(wall: Wall) -> list[tuple[Pose2D, float]]:
    """Return pose and length of each slab of a wall, in order; repeated corners are skipped."""
    slabs = [slab(start, end) for start, end in pairwise(np.asarray(wall.points, dtype=float))]
    return [(pose, length) for pose, length in slabs if length > 0.0]


def wall_pillars(wall: Wall) -> FloatArray:
    """Return the points (n, 2) where slabs meet; of a closed wall also its first point."""
    points = np.asarray(wall.points, dtype=np.float64)
    closed = len(points) > 2 and bool(np.allclose(points[0], points[-1]))
    return points[1:] if closed else points[1:-1]


def _prisms(solid: Solid) -> Iterator[FloatArray]:
    """Yield the triangles of the prisms that a solid consists of."""
    if isinstance(solid, Box):
        yield box_prism(solid.pose, solid.size, solid.elevation)
    elif isinstance(solid, Cylinder):
        outline = _circle(solid.x, solid.y, solid.radius, CYLINDER_SIDES)
        yield _prism(outline, solid.height)
    else:
        for pose, length in wall_slabs(solid):
            yield box_prism(pose, (length, solid.thickness, solid.height))
        for x, y in wall_pillars(solid).tolist():
            yield _prism(_circle(x, y, solid.thickness / 2.0, PILLAR_SIDES), solid.height)


def _circle(x: float, y: float, radius: float, sides: int) -> FloatArray:
    angles = [2.0 * pi * n / sides for n in range(sides)]
    return np.array([[x + radius * cos(a), y + radius * sin(a)] for a in angles])


def _prism(outline: FloatArray, height: float, bottom: float = 0.0) -> FloatArray:
    """Return the triangles (4n - 4, 3, 3) of the upright prism on a convex outline (n, 2).

    The outline must be anticlockwise.
    """
    n = len(outline)
    low = np.column_stack([outline, np.full(n, bottom)])
    high = np.column_stack([outline, np.full(n, height)])
    following: NDArray[np.intp] = np.roll(np.arange(n), -1)
    fan = np.arange(1, n - 1)
    tops = np.stack([high[np.zeros_like(fan)], high[fan], high[fan + 1]], axis=1)
    bottoms = np.stack([low[np.zeros_like(fan)], low[fan + 1], low[fan]], axis=1)
    lower = np.stack([low, low[following], high[following]], axis=1)
    upper = np.stack([low, high[following], high], axis=1)
    triangles: FloatArray = np.concatenate([lower, upper, tops, bottoms])
    return triangles
