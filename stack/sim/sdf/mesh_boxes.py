"""Meshes as upright boxes on the ground: the part that a robot can touch, column by column.

A mesh is drawn into a grid of columns along its walls. A column is an obstacle where a surface lies
between the ground and the headroom, or where it is inside a closed mesh; it is as high as the
surface. Equal neighbours are merged to boxes, as wide as the surface inside them: a mesh of boxes
that are parallel to each other becomes the same boxes.
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.sim.sdf import kernels
from stack.sim.worlds.rectangles import merged_cells
from stack.sim.worlds.world import Box
from stack.types import FloatArray, Pose2D

SingleArray = NDArray[np.float32]

CELL = 0.02
"""Side of a column, metres."""

MAX_COLUMNS = 4_000_000
"""Of a mesh: 200 MB. Columns of large meshes are wider."""

MAX_WORK = 50_000_000
"""Columns in the bounding rectangles of all triangles of a mesh: a few seconds. With more, columns
are wider."""

MAX_BOXES = 3000
"""Of a mesh; with more its columns become wider."""

STEP = 0.05
"""Metres; neighbours whose heights differ by less may become one box."""

THINNEST = 0.01
"""Metres: thickness of a surface without volume."""

ROOM = 1.0
"""Metres around the start that are inside a closed mesh if it is a room."""

UPRIGHT_FACE = 0.3
"""Vertical part of the normal of a face up to which it counts as a wall."""


def boxes_of(
    triangles: FloatArray, low: float, high: float, name: str, inside: tuple[float, float]
) -> list[Box]:
    """Return the boxes that cover a mesh between two heights.

    Args:
        triangles: (n, 3, 3) metres above the ground, world frame.
        low: height up to which a robot drives over a surface.
        high: height from which a robot passes below a surface.
        name: for messages.
        inside: (x, y) where the robot starts: a closed mesh around it is a room, not a block.
    """
    touched = triangles[triangles[:, :, 2].max(axis=1) > low]
    if not len(touched) or float(touched[:, :, 2].min()) >= high:
        return []
    turn = Pose2D(0.0, 0.0, wall_heading(touched))
    near = turn.inverse().transform(touched[:, :, :2].reshape(-1, 2))
    frame = turn.compose(Pose2D(*near.min(axis=0).tolist()))
    length, width = np.ptp(near, axis=0).tolist()
    local = triangles.copy()
    local[:, :, :2] = (
        frame.inverse().transform(triangles[:, :, :2].reshape(-1, 2)).reshape(-1, 3, 2)
    )
    start = frame.inverse().transform(np.array([inside]))[0]
    work = float(np.ptp(local[:, :, :2], axis=1).prod(axis=1).sum())
    cell = max(CELL, sqrt(length * width / MAX_COLUMNS), (length + width) / MAX_COLUMNS)
    cell = max(cell, sqrt(work / MAX_WORK))
    while True:
        found = _merged(*_columns(local, low, high, cell, (length, width), start))
        if len(found) <= MAX_BOXES:
            break
        cell *= 2.0
    return [
        Box(frame.compose(Pose2D((x0 + x1) / 2, (y0 + y1) / 2)), (x1 - x0, y1 - y0, top), name=name)
        for x0, y0, x1, y1, top in found
    ]


def wall_heading(triangles: FloatArray) -> float:
    """Return the heading of most walls of a mesh (n, 3, 3), up to quarter turns, radians."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normals, axis=1)
    walls = normals[(np.abs(normals[:, 2]) <= UPRIGHT_FACE * area) & (area > 0.0)]
    across = walls[:, 0] + 1j * walls[:, 1]
    size = np.abs(across)
    sum_of_walls = complex(((across / np.maximum(size, 1e-12)) ** 4 * size).sum())
    if abs(sum_of_walls) < 1e-9:
        return 0.0
    heading = float(np.angle(sum_of_walls)) / 4.0
    return 0.0 if abs(heading) < 1e-9 else heading


def _columns(  # noqa: PLR0913 - one call from one place
    triangles: FloatArray, low: float, high: float, cell: float, size: tuple[float, float],
    start: FloatArray,
) -> tuple[SingleArray, SingleArray]:  # fmt: skip
    """Return the height of each column (rows, columns), 0 where it is free, and its surface.

    The surface is (rows, columns, 4): least x and y, greatest x and y.
    """
    columns, rows = (max(1, ceil(side / cell - kernels.EDGE)) for side in size)
    tops: SingleArray = np.full((rows, columns), -np.inf, np.float32)
    spans = _no_spans(rows, columns)
    kernels.cover(triangles, low, high, cell, tops, spans)
    peaks = np.full((rows, columns), -np.inf, np.float32)
    kernels.cover(triangles, high, np.inf, cell, peaks, _no_spans(rows, columns))
    reaches = tops >= np.float32(high)
    tops[reaches] = peaks[reaches]
    above, below = np.zeros((2, rows, columns), np.int16)
    kernels.wind(triangles, high, cell, above, below)
    solid = (above > 0) & (below < 0)
    if not _is_room(solid, start, cell):
        inner = solid & ~np.isfinite(tops)
        lower, left = (index * cell for index in np.nonzero(inner))
        spans[inner] = np.column_stack([left, lower, left + cell, lower + cell])
        tops[solid] = peaks[solid]
    tops[~np.isfinite(tops)] = 0.0
    return tops, spans


def _is_room(solid: NDArray[np.bool_], start: FloatArray, cell: float) -> bool:
    """Tell whether a start is in the middle of a closed mesh: its faces are the walls of a room."""
    reach = round(ROOM / cell)
    row, column = np.floor(start[::-1] / cell).astype(int).tolist()
    if min(row, column) < reach:
        return False
    around = solid[row - reach : row + reach + 1, column - reach : column + reach + 1]
    return around.shape == (2 * reach + 1,) * 2 and bool(around.all())


def _no_spans(rows: int, columns: int) -> SingleArray:
    spans: SingleArray = np.full((rows, columns, 4), np.inf, np.float32)
    spans[:, :, 2:] = -np.inf
    return spans


def _merged(tops: SingleArray, spans: SingleArray) -> list[tuple[float, ...]]:
    """Merge columns into boxes: least x and y, greatest x and y, height, of each."""
    levels: NDArray[np.int32] = np.ceil(tops / STEP - kernels.EDGE).astype(np.int32)
    found: list[tuple[float, ...]] = []
    for level in np.unique(levels[levels > 0]).tolist():
        for top, bottom, left, right in merged_cells(levels == level):
            span = spans[top:bottom, left:right].reshape(-1, 4)
            x0, y0 = span[:, :2].min(axis=0).astype(float).tolist()
            x1, y1 = span[:, 2:].max(axis=0).astype(float).tolist()
            x_more, y_more = max(0.0, THINNEST - x1 + x0) / 2, max(0.0, THINNEST - y1 + y0) / 2
            height = float(tops[top:bottom, left:right].max())
            found.append((x0 - x_more, y0 - y_more, x1 + x_more, y1 + y_more, height))
            if len(found) > MAX_BOXES:
                return found
    return found
