"""Where the shapes of a URDF are: points on their surfaces, in the base frame."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from robots.urdf.model import RobotModel, origin_of
from stack.documents.xml_file import Element
from stack.types import FloatArray

SIDES = 24
"""Points on a circle."""


def points_of(
    model: RobotModel, link: str, tag: str, *, meshes: bool, at: FloatArray | None = None
) -> FloatArray:
    """Points (n, 3) on the shapes of a link, in the root's frame.

    Args:
        model: of the robot.
        link: its name.
        tag: collision or visual.
        meshes: whether mesh files are read, which takes time; their shapes are skipped otherwise.
        at: pose (4, 4) of the link in the root's frame; None: with all joints at 0.
    """
    place = model.poses[link] if at is None else at
    found = []
    for part in model.links[link].all(tag):
        geometry = part.first("geometry")
        shape = None if geometry is None or not geometry.children else geometry.children[0]
        points = None if shape is None else _points(shape, meshes)
        if points is not None and len(points):
            pose = place @ origin_of(part)
            found.append(points @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(found) if found else np.empty((0, 3))


def shapes_of(link: Element) -> Iterator[str]:
    """The kinds of the collision shapes of a link that are not meshes."""
    for part in link.all("collision"):
        geometry = part.first("geometry")
        kinds = [] if geometry is None else [shape.tag for shape in geometry.children]
        yield from (kind for kind in kinds if kind != "mesh")


def radii_of(link: Element) -> Iterator[tuple[str, float]]:
    """The round collision shapes of a link: (sphere or cylinder, radius)."""
    for part in link.all("collision"):
        for kind in ("sphere", "cylinder"):
            shape = part.first("geometry", kind)
            if shape is not None:
                yield kind, float(shape.attributes["radius"])


def _points(shape: Element, meshes: bool) -> FloatArray | None:
    if shape.tag == "mesh":
        return _mesh(shape) if meshes else None
    if shape.tag == "box":
        half = [float(word) / 2 for word in shape.attributes["size"].split()]
        return np.array(list(product((-1.0, 1.0), repeat=3))) * half
    radius = float(shape.attributes["radius"])
    angles = np.linspace(0.0, 2.0 * pi, SIDES, endpoint=False)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(SIDES)])
    if shape.tag == "sphere":
        return np.concatenate([circle, circle[:, [2, 0, 1]], circle[:, [1, 2, 0]]])
    half_length = float(shape.attributes["length"]) / 2
    if shape.tag == "capsule":
        half_length += radius
    return np.concatenate(
        [circle + np.array([0.0, 0.0, end]) for end in (-half_length, half_length)]
    )


def _mesh(shape: Element) -> FloatArray | None:
    """The vertices of a mesh; None if it cannot be read."""
    path = Path(shape.attributes["filename"])
    try:
        points = _vertices_of_obj(path) if path.suffix.lower() == ".obj" else _vertices(path)
    except Exception:  # a reader for each format raises its own
        return None
    scale = [float(word) for word in shape.attributes.get("scale", "1 1 1").split()]
    return points * scale


def _vertices_of_obj(path: Path) -> FloatArray:
    """The vertices of an OBJ file: the lines that begin with v."""
    lines = path.read_text("utf-8", "replace").splitlines()
    rows = [line.split()[1:4] for line in lines if line.startswith("v ")]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _vertices(path: Path) -> FloatArray:
    import trimesh  # costs half a second

    mesh: Any = trimesh.load(path, force="mesh", process=False)
    return np.asarray(mesh.vertices, dtype=np.float64)
