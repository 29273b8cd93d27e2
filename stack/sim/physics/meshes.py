"""Triangle meshes of the static parts of a world, one mesh per colour.

All parts are upright prisms. A wall is a row of slabs with a round pillar at every inner corner,
which fills joints of any angle. A cylinder is a prism with many sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import pairwise
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from stack.sim.worlds.world import Colour, Cylinder, Drop, FloorLine, Wall, World
from stack.types import FloatArray, Pose2D

Bounds = tuple[float, float, float, float]

CYLINDER_SIDES = 32
"""The sides lie at most radius x (1 - cos(pi / 32)) = 0.5 % of the radius inside the circle."""

PILLAR_SIDES = 12


PAINT_HEIGHT = 0.0005
"""Metres of paint above the floor, enough for the renderers to tell which is on top. Seen from a
camera of height h, paint seems farther away by its own height over h, in parts of its distance."""

LEVEL = 0.7
"""Vertical part of the normal of a face from which on it counts as level."""

LEAST_MITRE = 0.35
"""Cosine of half the turn at a corner, below which its outer point is cut off."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles without shared corners, so that every face is flat-shaded.

    Attributes:
        corners: (n, 3, 3) metres: triangle, corner, coordinate; anticlockwise seen from outside.
    """

    corners: FloatArray

    def obj(self) -> str:
        """Return the mesh as a Wavefront OBJ text."""
        vertices = self.corners.reshape(-1, 3).tolist()
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
        lines += [f"f {n} {n + 1} {n + 2}" for n in range(1, len(vertices), 3)]
        return "\n".join(lines) + "\n"

    def tiled_obj(self, side: float) -> str:
        """Return the mesh as a Wavefront OBJ text with texture coordinates.

        A square image repeats every `side` metres: on upright faces along the wall and from the
        floor up, on level ones along x and y.
        """
        vertices = self.corners.reshape(-1, 3).tolist()
        edges = np.diff(self.corners, axis=1)
        normals = np.cross(edges[:, 0], edges[:, 1])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        across = np.column_stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))])
        level = np.abs(normals[:, 2]) > LEVEL
        across[level] = (1.0, 0.0, 0.0)
        up = np.where(level[:, None], (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        tiles = np.stack([
            np.einsum("nij,nj->ni", self.corners, across), np.einsum("nij,nj->ni", self.corners, up)
        ], axis=2) / side  # fmt: skip
        tiles -= np.floor(tiles.min(axis=1, keepdims=True))  # the renderer repeats upwards only
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in tiles.reshape(-1, 2).tolist()]
        lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals.tolist()]
        lines += [
            f"f {n}/{n}/{face} {n + 1}/{n + 1}/{face} {n + 2}/{n + 2}/{face}"
            for face, n in enumerate(range(1, len(vertices), 3), start=1)
        ]
        return "\n".join(lines) + "\n"


def file_name(content: str | bytes, ending: str) -> str:
    """Return a file name from a hash of the content; PyBullet caches meshes by file name."""
    raw = content.encode() if isinstance(content, str) else content
    return f"{sha256(raw).hexdigest()[:24]}.{ending}"


def static_meshes(world: World, *, glass: bool = True, textured: bool = True) -> dict[Colour, Mesh]:
    """Return the static meshes of a world by colour, in order of first appearance.

    Args:
        world: with walls, boxes and cylinders.
        glass: whether walls of glass are contained.
        textured: whether walls and boxes with a texture are contained.
    """
    parts: dict[Colour, list[FloatArray]] = {}
    for wall in world.walls:
        if (wall.glass and not glass) or (wall.texture != "plain" and not textured):
            continue
        parts.setdefault(wall.colour, []).extend(_wall(wall))
    for box in world.boxes:
        if box.texture != "plain" and not textured:
            continue
        parts.setdefault(box.colour, []).append(box_prism(box.pose, box.size, box.elevation))
    for cylinder in world.cylinders:
        parts.setdefault(cylinder.colour, []).append(_cylinder(cylinder))
    return {colour: Mesh(np.concatenate(corners)) for colour, corners in parts.items() if corners}


def glass_meshes(world: World) -> dict[Colour, Mesh]:
    """Return the meshes of the walls of glass by colour, in order of first appearance."""
    panes = tuple(wall for wall in world.walls if wall.glass)
    return static_meshes(replace(world, walls=panes, boxes=(), cylinders=()))


def textured_meshes(world: World) -> dict[str, Mesh]:
    """Return the meshes of the walls and boxes with a texture, by its name."""
    parts: dict[str, list[FloatArray]] = {}
    for wall in world.walls:
        if wall.texture != "plain" and not wall.glass:
            parts.setdefault(wall.texture, []).extend(_wall(wall))
    for box in world.boxes:
        if box.texture != "plain":
            parts.setdefault(box.texture, []).append(box_prism(box.pose, box.size, box.elevation))
    return {texture: Mesh(np.concatenate(corners)) for texture, corners in parts.items()}


def floor(bounds: Bounds, drops: Sequence[Drop]) -> Mesh:
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
    return Mesh(np.concatenate(quads))


def painted(line: FloorLine) -> Mesh:
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
    return Mesh(np.concatenate(quads))


def pits(drops: Sequence[Drop]) -> list[Mesh]:
    """Return the bottom and the sides of every drop, seen from above."""
    found = []
    for drop in drops:
        x_min, y_min, x_max, y_max = drop.bounds
        corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
        low, high = ([(x, y, z) for x, y in corners] for z in (-drop.depth, 0.0))
        quads = [_quad(*low)]
        quads += [_quad(low[n], high[n], high[n - 1], low[n - 1]) for n in range(4)]
        found.append(Mesh(np.concatenate(quads)))
    return found


def _quad(*corners: tuple[float, float, float] | FloatArray) -> FloatArray:
    """Return the two triangles (2, 3, 3) of a quadrilateral with these four corners."""
    a, b, c, d = (np.array(corner) for corner in corners)
    return np.array([[a, b, c], [a, c, d]])


def merged(meshes: dict[Colour, Mesh]) -> Mesh:
    """Return all meshes joined into one."""
    return Mesh(np.concatenate([mesh.corners for mesh in meshes.values()]))


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


def _wall(wall: Wall) -> Iterator[FloatArray]:
    for pose, length in wall_slabs(wall):
        yield box_prism(pose, (length, wall.thickness, wall.height))
    for x, y in wall_pillars(wall).tolist():
        yield _prism(_circle(x, y, wall.thickness / 2.0, PILLAR_SIDES), wall.height)


def _cylinder(cylinder: Cylinder) -> FloatArray:
    outline = _circle(cylinder.x, cylinder.y, cylinder.radius, CYLINDER_SIDES)
    return _prism(outline, cylinder.height)


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
