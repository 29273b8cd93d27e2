"""Triangles of the visual shapes of a PyBullet client, as its software renderer draws them."""

from __future__ import annotations

from dataclasses import dataclass
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
    from trimesh import creation

    if kind == BOX:
        return _flat(creation.box(size).triangles)
    if kind == SPHERE:
        return _round(creation.uv_sphere(size[0], count=(SIDES, SIDES)).triangles)
    if kind == CYLINDER:
        return _round(creation.cylinder(size[1], size[0], sections=SIDES).triangles)
    if kind == CAPSULE:
        return _round(creation.capsule(size[0], size[1], count=(SIDES, SIDES)).triangles)
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
