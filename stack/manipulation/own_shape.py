"""The robot's own shape: which measured points are on it.

Each shape of the URDF counts as its convex hull, or as the box around it if it has no corners.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.manipulation.model import ArmModel
from stack.types import FloatArray


class OwnShape:
    """Shapes of all links as planes (k, 4) in their own frames: inside is n p + d <= 0."""

    def __init__(self, model: ArmModel) -> None:
        self._model = model
        self._shapes = [_planes(item.geometry) for item in model.geometry.geometryObjects]
        self._data = model.model.createData()
        self._results = model.geometry.createData()
        self._base = np.linalg.inv(model.base)

    def covers(
        self, points: FloatArray, positions: FloatArray, width: float | None, margin: float
    ) -> NDArray[np.bool_]:
        """Return (m,) which points are in a link or nearer to it than a margin.

        Args:
            points: (m, 3) in `base_link`, metres.
            positions: (n,) of the arm's joints.
            width: between the fingers, metres; None: open.
            margin: metres.
        """
        model = self._model
        q = model.configuration(positions, width)
        model.pin.updateGeometryPlacements(
            model.model, self._data, model.geometry, self._results, q
        )
        covered = np.zeros(len(points), bool)
        for planes, placement in zip(self._shapes, self._results.oMg, strict=True):
            pose = self._base @ placement.homogeneous
            left = np.flatnonzero(~covered)
            local = (points[left] - pose[:3, 3]) @ pose[:3, :3]
            box = planes[:6]  # of the box around the shape: most points are outside
            near = (local @ box[:, :3].T + box[:, 3]).max(axis=1, initial=-np.inf) < margin
            left, local = left[near], local[near]
            inside = (local @ planes[:, :3].T + planes[:, 3]).max(axis=1, initial=-np.inf) < margin
            covered[left[inside]] = True
        return covered


def _planes(shape: Any) -> FloatArray:
    """Return the planes of a shape; the first six are those of the box around it."""
    import coal

    shape.computeLocalAABB()
    low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
    planes = []
    for axis, sign in product(range(3), (1.0, -1.0)):
        normal = np.zeros(3)
        normal[axis] = sign
        planes.append([*normal, -(high[axis] if sign > 0.0 else -low[axis])])
    if not isinstance(shape, coal.ConvexBase):
        return np.array(planes)
    corners = np.array(shape.points())
    middle = corners.mean(axis=0)
    for number in range(shape.num_polygons):
        triangle = shape.polygons(number)
        first, second, third = (corners[triangle[corner]] for corner in range(3))
        normal = np.cross(second - first, third - first)
        length = float(np.linalg.norm(normal))
        if length < 1e-12:
            continue
        normal /= length if normal @ (first - middle) > 0.0 else -length
        planes.append([*normal, -float(normal @ first)])
    return np.array(planes)
