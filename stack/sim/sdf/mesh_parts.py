"""Mesh files as convex parts, and the smallest rectangle around points.

The decomposition is V-HACD (K. Mamou, 2016), which is part of PyBullet. Its voxels make the parts
a few centimetres larger than the mesh, never smaller. trimesh reads the files.
"""

from __future__ import annotations

import tempfile
from functools import lru_cache
from io import BytesIO
from math import radians
from pathlib import Path

import numpy as np

from stack.documents.files import MESH_BYTES, read_bytes
from stack.errors import InputError
from stack.sim.physics.bullet import load, stdout_as_stderr
from stack.types import FloatArray

VOXELS = 100_000
CONCAVITY = 0.001
MAX_FACES = 500_000
FORMATS = ("stl", "obj", "dae", "ply", "off", "glb")


@lru_cache(maxsize=64)
def convex_parts(file: Path) -> tuple[FloatArray, ...]:
    """Decompose a mesh into convex parts: the corners (n, 3) of each, in the mesh's frame and unit.

    Raises:
        InputError: the file cannot be read, is not a mesh, or is too large.
    """
    vertices, faces = _surface(file)
    with tempfile.TemporaryDirectory() as folder:
        mesh, parts = Path(folder) / "mesh.obj", Path(folder) / "parts.obj"
        mesh.write_text(_as_obj(vertices, faces), "ascii")
        with stdout_as_stderr():
            load().vhacd(
                str(mesh), str(parts), str(Path(folder) / "log"),
                resolution=VOXELS, concavity=CONCAVITY,
            )  # fmt: skip
        found = _parts_of(parts.read_text("ascii"))
    if not found:
        raise InputError(f"{file.name} has no volume")
    return tuple(found)


def smallest_rectangle(points: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Heading, centre (2,) and size (2,) of the smallest rectangle around points (n, 2)."""
    import cv2

    # OpenCV computes in single precision: near the origin its rounding errors are negligible.
    offset = points.mean(axis=0)
    middle, size, angle = cv2.minAreaRect((points - offset).astype(np.float32))
    return radians(angle), np.asarray(middle, dtype=np.float64) + offset, np.asarray(size)


def _surface(file: Path) -> tuple[FloatArray, FloatArray]:
    import trimesh

    kind = file.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InputError(f"{file.name} is not a mesh of a known kind: {', '.join(FORMATS)}")
    try:
        raw = read_bytes(file, MESH_BYTES)
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from None
    if b"<!DOCTYPE" in raw:
        raise InputError(f"{file.name} has a document type, which is not supported")
    try:
        # Without its path: textures and other files that it names are not read.
        mesh = trimesh.load_mesh(BytesIO(raw), file_type=kind)
    except Exception as error:  # trimesh's readers may raise any exception on a damaged file
        sentence = f"{file.name} is not a readable {kind} mesh ({type(error).__name__})"
        raise InputError(sentence) from None
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    faces = np.asarray(mesh.faces if isinstance(mesh, trimesh.Trimesh) else ())
    if not len(faces) or not np.isfinite(mesh.vertices).all():
        raise InputError(f"{file.name} has no faces")
    if len(faces) > MAX_FACES:
        raise InputError(f"{file.name} has {len(faces)} faces; at most {MAX_FACES} are supported")
    return np.asarray(mesh.vertices, dtype=np.float64), faces


def _as_obj(vertices: FloatArray, faces: FloatArray) -> str:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    return "\n".join(lines) + "\n"


def _parts_of(text: str) -> list[FloatArray]:
    parts: list[list[list[float]]] = []
    for line in text.splitlines():
        if line.startswith("o "):
            parts.append([])
        elif line.startswith("v ") and parts:
            parts[-1].append([float(word) for word in line.split()[1:4]])
    return [np.array(part) for part in parts if len(part) >= 4]
