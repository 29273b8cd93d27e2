"""Mesh files as upright boxes: convex parts, each with the smallest rectangle round it.

The decomposition is V-HACD's (K. Mamou, 2016), which PyBullet brings; its voxels make parts a few
centimetres larger than the mesh, never smaller. Files are read by trimesh.
"""

from __future__ import annotations

import tempfile
from functools import lru_cache
from math import radians
from pathlib import Path

import numpy as np

from stack.errors import InputError
from stack.sim.physics.bullet import load, stdout_as_stderr
from stack.types import FloatArray

VOXELS = 100_000
CONCAVITY = 0.001
MAX_BYTES, MAX_FACES = 50_000_000, 500_000


@lru_cache(maxsize=64)
def convex_parts(file: Path) -> tuple[FloatArray, ...]:
    """The corners (n, 3) of convex parts that together cover a mesh, in its own frame and unit.

    Raises:
        InputError: the file cannot be read, is no mesh, or is too large.
    """
    vertices, faces = _surface(file)
    with tempfile.TemporaryDirectory() as folder:
        whole, parts = Path(folder) / "whole.obj", Path(folder) / "parts.obj"
        whole.write_text(_as_obj(vertices, faces), "ascii")
        with stdout_as_stderr():
            load().vhacd(
                str(whole), str(parts), str(Path(folder) / "log"),
                resolution=VOXELS, concavity=CONCAVITY,
            )  # fmt: skip
        found = _parts_of(parts.read_text("ascii"))
    if not found:
        raise InputError(f"{file.name} has no volume")
    return tuple(found)


def rectangle_round(points: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Heading, middle (2,) and size (2,) of the smallest rectangle round points (n, 2)."""
    import cv2

    # OpenCV works in single precision: near the origin it loses nothing that matters.
    offset = points.mean(axis=0)
    middle, size, angle = cv2.minAreaRect((points - offset).astype(np.float32))
    return radians(angle), np.asarray(middle, dtype=np.float64) + offset, np.asarray(size)


def _surface(file: Path) -> tuple[FloatArray, FloatArray]:
    import trimesh

    try:
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"{file.name} has more than {MAX_BYTES} bytes")
        mesh = trimesh.load_mesh(file)
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from None
    except InputError:
        raise
    except Exception as error:  # a reader of foreign files may raise anything
        raise InputError(f"{file.name} is no mesh that can be read: {error}") from None
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    faces = np.asarray(getattr(mesh, "faces", ()))
    if not len(faces) or not np.isfinite(mesh.vertices).all():
        raise InputError(f"{file.name} has no faces")
    if len(faces) > MAX_FACES:
        raise InputError(f"{file.name} has {len(faces)} faces, at most {MAX_FACES} are read")
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
