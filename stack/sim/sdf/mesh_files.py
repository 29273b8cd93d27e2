"""Triangles of the mesh files of Gazebo models, read by trimesh."""

from __future__ import annotations

from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np

from stack.documents.files import MESH_BYTES, read_bytes
from stack.errors import InputError
from stack.types import FloatArray

MAX_FACES = 500_000
FORMATS = ("stl", "obj", "dae", "ply", "off", "glb")


def read_triangles(file: Path) -> FloatArray:
    """Read the triangles (n, 3, 3) of a mesh: triangle, corner, coordinate; metres.

    The unit of a Collada file (`<unit meter="0.01">`) is applied and its `<up_axis>` is not, as in
    Gazebo. The other formats have no unit: their numbers are metres.

    Raises:
        InputError: the file cannot be read, is not a mesh, or is too large.
    """
    kind = file.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InputError(f"{file.name} is not a mesh of a known kind: {', '.join(FORMATS)}")
    try:
        raw = read_bytes(file, MESH_BYTES)
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from None
    return _triangles(raw, file.name, kind)


@lru_cache(maxsize=64)
def _triangles(raw: bytes, name: str, kind: str) -> FloatArray:
    """Parse equal contents once: the models of a world often share their meshes."""
    import trimesh

    if b"<!DOCTYPE" in raw:
        raise InputError(f"{name} has a document type, which is not supported")
    try:
        # Without its path: textures and other files that it names are not read.
        scene = trimesh.load_scene(BytesIO(raw), file_type=kind)
        metres = trimesh.units.unit_conversion(scene.units or "m", "m") if kind == "dae" else 1.0
        triangles = np.asarray(scene.to_mesh().triangles, dtype=np.float64) * metres
    except Exception as error:  # trimesh's readers may raise any exception on a damaged file
        sentence = f"{name} is not a readable {kind} mesh ({type(error).__name__})"
        raise InputError(sentence) from None
    if not triangles.size or not np.isfinite(triangles).all():
        raise InputError(f"{name} has no faces")
    if len(triangles) > MAX_FACES:
        count = len(triangles)
        raise InputError(f"{name} has {count} faces; at most {MAX_FACES} are supported")
    return triangles
