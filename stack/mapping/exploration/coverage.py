"""Lanes that cover an area: boustrophedon cellular decomposition.

The area is cut into parallel lines, a lane apart. Runs of passable cells on successive lines form a
cell as long as one run follows one; where a run splits or two merge, new cells begin. The cells are
driven one after another, the nearest entry first, their lanes in turns forward and back. Source: H.
Choset, P. Pignon, "Coverage path planning: the boustrophedon cellular decomposition", FSR 1997.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from stack.geometry.polygons import points_inside
from stack.mapping.exploration.frontiers import passable_cells
from stack.types import OCCUPIED, CoveragePlan, FloatArray, OccupancyGrid, Pose2D, wrap_angle


@dataclass
class _Run:
    """A part of a line: from and to along it, and the distance of the line, metres."""

    start: float
    end: float
    offset: float


def coverage_plan(  # noqa: PLR0913 - an area, its limits, and what drives over it
    grid: OccupancyGrid, pose: Pose2D, radius: float, spacing: float,
    corners: FloatArray | None = None, zones: Mapping[str, NDArray[np.bool_]] | None = None,
) -> CoveragePlan:  # fmt: skip
    """Return lanes that cover an area.

    Args:
        grid: the map.
        pose: of the robot, map frame.
        radius: clearance of the robot's centre from obstacles, metres.
        spacing: distance of two lanes, metres.
        corners: (n, 2) of a polygon, map frame; None: the room that contains the robot. Rooms are
            parts of the free space that meet in passages (stack.mapping.passages).
        zones: cells (rows, columns) that the robot must not enter, by name; they count as walls.
    """
    whole = grid
    for cells in (zones or {}).values():
        grid = replace(grid, cells=np.where(cells, OCCUPIED, grid.cells).astype(np.int8))
    area = _room(grid, pose) if corners is None else _inside(grid, corners)
    meant = area if corners is not None or not zones else _room(whole, pose)
    in_area = tuple(name for name, cells in (zones or {}).items() if (cells & meant).any())
    passable = passable_cells(grid, radius).astype(bool)
    driven = area & passable
    goals = np.argwhere(area & grid.free).astype(np.float64)
    points = np.column_stack([goals[:, 1], goals[:, 0]]) + 0.5
    points = points * grid.resolution + grid.origin
    if not driven.any():
        return CoveragePlan((), points, grid.resolution, in_area)
    angle = _direction(driven)
    runs = _runs(grid, driven, angle, spacing)
    lanes = _ordered(_cells(runs), pose, angle)
    return CoveragePlan(tuple(lanes), points, grid.resolution, in_area)


def _room(grid: OccupancyGrid, pose: Pose2D) -> NDArray[np.bool_]:
    """Return the cells of the room that contains a pose; the nearest room from a passage."""
    from stack.mapping.passages import clearance_of, rooms_of

    rooms = rooms_of(grid, clearance_of(grid))
    row, column = grid.cell_at(pose.x, pose.y)
    if grid.contains(row, column) and rooms[row, column]:
        found: NDArray[np.bool_] = rooms == rooms[row, column]
        return found
    cells = np.argwhere(rooms > 0)
    if not cells.size:
        return grid.free
    nearest = cells[np.argmin(np.hypot(*(cells - (row, column)).T))]
    return np.asarray(rooms == rooms[nearest[0], nearest[1]])


def _inside(grid: OccupancyGrid, corners: FloatArray) -> NDArray[np.bool_]:
    """Return the cells whose centres are in a polygon."""
    rows, columns = np.indices(grid.cells.shape)
    centres = np.column_stack([columns.ravel(), rows.ravel()]) + 0.5
    points: FloatArray = centres * grid.resolution + np.array(grid.origin)
    inside = points_inside(points, corners)
    return inside.reshape(grid.cells.shape)


def _direction(mask: NDArray[np.bool_]) -> float:
    """Return the direction of the longer side of the smallest rectangle around a mask, radians."""
    import cv2

    cells = np.argwhere(mask)[:, ::-1].astype(np.float32)
    (_, _), (width, height), degrees = cv2.minAreaRect(cells)
    return float(np.radians(degrees if width >= height else degrees + 90.0))


def _runs(
    grid: OccupancyGrid, mask: NDArray[np.bool_], angle: float, spacing: float
) -> list[list[_Run]]:
    """Return the runs of each line; positions along and across it are in a turned frame, metres."""
    c, s = cos(angle), sin(angle)
    cells = np.argwhere(mask)
    x = (cells[:, 1] + 0.5) * grid.resolution + grid.origin[0]
    y = (cells[:, 0] + 0.5) * grid.resolution + grid.origin[1]
    along, across = c * x + s * y, -s * x + c * y
    low, high = float(across.min()), float(across.max())
    count = max(1, int(np.ceil((high - low) / spacing)) + 1)
    offsets = np.linspace(low, high, count) if count > 1 else np.array([0.5 * (low + high)])
    step = 0.5 * grid.resolution
    # A quarter of a cell away from the edges of cells, when lines run along the grid.
    t = np.arange(float(along.min()) - 1.5 * step, float(along.max()) + 2.0 * step, step)
    lines = []
    for offset in offsets.tolist():
        columns = ((c * t - s * offset - grid.origin[0]) // grid.resolution).astype(int)
        rows = ((s * t + c * offset - grid.origin[1]) // grid.resolution).astype(int)
        inside = (rows >= 0) & (columns >= 0) & (rows < mask.shape[0]) & (columns < mask.shape[1])
        on = np.zeros(t.size + 2, np.int8)
        on[1:-1][inside] = mask[rows[inside], columns[inside]]
        change = np.diff(on)
        starts, ends = np.nonzero(change == 1)[0], np.nonzero(change == -1)[0] - 1
        lines.append([
            _Run(float(t[a]), float(t[b]), offset) for a, b in zip(starts, ends, strict=True)
        ])  # fmt: skip
    return lines


def _cells(lines: list[list[_Run]]) -> list[list[_Run]]:
    """Join runs of successive lines into cells."""
    cells: list[list[_Run]] = []
    before: list[tuple[_Run, int]] = []
    for line in lines:
        overlaps = [[k for k, (one, _) in enumerate(before) if _overlap(one, run)] for run in line]
        now: list[tuple[_Run, int]] = []
        for run, touching in zip(line, overlaps, strict=True):
            alone = len(touching) == 1 and sum(touching[0] in other for other in overlaps) == 1
            number = before[touching[0]][1] if alone else len(cells)
            if not alone:
                cells.append([])
            cells[number].append(run)
            now.append((run, number))
        before = now
    return cells


def _overlap(one: _Run, other: _Run) -> bool:
    return one.start <= other.end and other.start <= one.end


def _ordered(cells: list[list[_Run]], pose: Pose2D, angle: float) -> list[tuple[Pose2D, Pose2D]]:
    """Return the lanes, cell by cell, each from the nearest of its four entries."""
    c, s = cos(angle), sin(angle)
    left = list(cells)
    lanes: list[tuple[Pose2D, Pose2D]] = []
    x, y = pose.x, pose.y

    def point(run: _Run, t: float) -> tuple[float, float]:
        return c * t - s * run.offset, s * t + c * run.offset

    while left:
        entries = []
        for number, cell in enumerate(left):
            for last, run in ((False, cell[0]), (True, cell[-1])):
                for far, t in ((False, run.start), (True, run.end)):
                    px, py = point(run, t)
                    entries.append((hypot(px - x, py - y), number, last, far))
        _, number, last, far = min(entries)
        cell = left.pop(number)
        for run in reversed(cell) if last else cell:
            ends = (run.end, run.start) if far else (run.start, run.end)
            heading = angle + (np.pi if far else 0.0)
            first, second = (Pose2D(*point(run, t), wrap_angle(heading)) for t in ends)
            if run.end - run.start > 0.0 or not lanes:
                lanes.append((first, second))
            far = not far
            x, y = second.x, second.y
    return lanes
