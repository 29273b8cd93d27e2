"""Triangles of the visual shapes of a PyBullet client, as its software renderer draws them."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from stack.errors import BodyError
from stack.types import FloatArray

SPHERE, BOX, CYLINDER, MESH, CAPSULE = 2, 3, 4, 5, 7
"""PyBullet's numbers of the kinds of shapes."""

MESHES = (".obj", ".stl")
"""Endings of mesh files."""

SIDES = 32
"""Of a round shape."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A visual shape of a link.

    Attributes:
        link: -1: the base.
        position: of the shape's frame in the link's, metres.
        orientation: quaternion x, y, z, w.
        colour: red, green, blue, each 0 to 1.
        positions: (3 n, 3) corners of n triangles, anticlockwise seen from outside, metres.
        normals: (3 n, 3) of the corners.
        texels: (3 n, 2) texture coordinates; 0 without a texture.
    """

    link: int
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    colour: tuple[float, float, float]
    positions: FloatArray
    normals: FloatArray
    texels: FloatArray


def shape_of(data: tuple[Any, ...]) -> Shape:
    """Return a shape from an item of PyBullet's `getVisualShapeData`.

    Raises:
        BodyError: it is a plane, its mesh cannot be read, or is of a format whose units and axes
            readers take differently.
    """
    _, link, kind, size, file, position, orientation, colour = data[:8]
    positions, normals, texels = _triangles(kind, size, file.decode())
    return Shape(link, position, orientation, colour[:3], positions, normals, texels)


def _triangles(
    kind: int, size: tuple[float, ...], file: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    if kind == MESH:
        return _mesh(FilePath(file), np.array(size))
    if kind == BOX:
        return _flat(_box(np.array(size) / 2.0))
    if kind == SPHERE:
        return _round(_lathe(*_arc(size[0], 0.0)))
    if kind == CYLINDER:
        half, radius = size[0] / 2, size[1]
        return _round(_lathe([0.0, radius, radius, 0.0], [-half, -half, half, half]))
    if kind == CAPSULE:
        return _round(_lathe(*_arc(size[1], size[0] / 2)))
    raise BodyError(f"a visual shape of PyBullet's kind {kind} cannot be drawn by OpenGL")


def _mesh(file: FilePath, scale: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    import trimesh

    if file.suffix.lower() not in MESHES:
        raise BodyError(
            f"the mesh {file.name} cannot be drawn by OpenGL; only {' and '.join(MESHES)} can"
        )
    try:
        mesh: Any = trimesh.load(file, process=False, force="mesh", maintain_order=True)
        faces = np.asarray(mesh.faces)
        corners = np.asarray(mesh.vertices, dtype=np.float64)[faces] * scale
    except Exception as error:  # a reader for each format raises its own
        raise BodyError(f"the mesh {file.name} cannot be read: {error!s:.200}") from None
    positions, normals, texels = _flat(corners)
    visual = mesh.visual
    if isinstance(visual, trimesh.visual.TextureVisuals) and visual.uv is not None:
        texels = np.asarray(visual.uv, dtype=np.float64)[faces].reshape(-1, 2)
    return positions, normals, texels


def _flat(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return triangles (n, 3, 3) with the normals of their planes."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    flat = corners.reshape(-1, 3)
    return flat, np.repeat(normals, 3, axis=0), np.zeros((len(flat), 2))


def _round(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return triangles (n, 3, 3) whose normals point away from the middle, as in TinyRenderer."""
    flat = corners.reshape(-1, 3)
    normals = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    return flat, normals, np.zeros((len(flat), 2))


def _box(half: FloatArray) -> FloatArray:
    """Return the triangles (12, 3, 3) of a box with half sides (3,)."""
    quads = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = np.zeros((4, 3))
            quad[:, axis] = side
            quad[:, u], quad[:, v] = [-side, side, side, -side], [-1.0, -1.0, 1.0, 1.0]
            quads += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    return np.array(quads) * half


def _arc(radius: float, straight: float) -> tuple[list[float], list[float]]:
    """Return radii and heights of a half circle whose halves are `straight` off the middle."""
    angles = np.linspace(-pi / 2, pi / 2, SIDES // 2 + 1)
    heights = radius * np.sin(angles) + np.where(angles < 0.0, -straight, straight)
    return (radius * np.cos(angles)).tolist(), heights.tolist()


def _lathe(radii: list[float], heights: list[float]) -> FloatArray:
    """Return the triangles (n, 3, 3) of an outline turned round the z axis, from below to above."""
    angles = 2.0 * pi * np.arange(SIDES + 1) / SIDES
    circle = np.column_stack([np.sin(angles), np.cos(angles)])[::-1]
    found = []
    for low in range(len(radii) - 1):
        rings = [
            np.column_stack([radii[n] * circle, np.full(SIDES + 1, heights[n])])
            for n in (low, low + 1)
        ]
        for n in range(SIDES):
            a, b, c, d = rings[0][n], rings[0][n + 1], rings[1][n + 1], rings[1][n]
            if radii[low] > 1e-9:  # otherwise a and b are the same point
                found.append((a, b, c))
            if radii[low + 1] > 1e-9:
                found.append((a, c, d))
    return np.array(found)
