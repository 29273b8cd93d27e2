"""Kernels that draw triangles into a grid of columns."""

from __future__ import annotations

from math import floor

import numpy as np

from stack.kernel_cache import njit

EDGE = 1e-3
"""Part of a cell by which a surface may overlap the next cell without covering it: files in
single precision are that inexact."""

MIDDLE_X, MIDDLE_Y = 0.5037, 0.4961
"""Point of a cell, in parts of it, that stands for its column. It is not the middle because the
edges of triangles often pass through that of a whole row of cells."""


@njit(cache=True, nogil=True)
def cover(triangles, low, high, cell, tops, spans):  # type: ignore[no-untyped-def]
    """Mark the columns that surfaces between two heights touch.

    Args:
        triangles: (n, 3, 3) metres, in the frame of the grid, whose origin is its corner.
        low: height, metres.
        high: height, metres.
        cell: side of a cell, metres.
        tops: (rows, columns) highest point in each column, metres; raised in place.
        spans: (rows, columns, 4) least x and y, greatest x and y of the surface in each column;
            extended in place.
    """
    whole, band = np.empty((10, 3)), np.empty((10, 3))
    row_part, part, spare = np.empty((10, 3)), np.empty((10, 3)), np.empty((10, 3))
    rows, columns = tops.shape
    for triangle in range(len(triangles)):
        for corner in range(3):
            for axis in range(3):
                whole[corner, axis] = triangles[triangle, corner, axis]
        count = _between(whole, 3, 2, low, high, band, spare)
        if count == 0:
            continue
        first, last = _cells(band, count, 1, cell, rows)
        for row in range(first, last + 1):
            inside = _between(band, count, 1, row * cell, (row + 1) * cell, row_part, spare)
            if inside == 0:
                continue
            left, right = _cells(row_part, inside, 0, cell, columns)
            for column in range(left, right + 1):
                x = column * cell
                found = _between(row_part, inside, 0, x, x + cell, part, spare)
                for corner in range(found):
                    tops[row, column] = max(tops[row, column], part[corner, 2])
                    for axis in range(2):
                        at = part[corner, axis]
                        spans[row, column, axis] = min(spans[row, column, axis], at)
                        spans[row, column, axis + 2] = max(spans[row, column, axis + 2], at)


@njit(cache=True, nogil=True)
def wind(triangles, height, cell, above, below):  # type: ignore[no-untyped-def]
    """Count the faces above and below a height in each column: up +1, down -1.

    Args:
        triangles: as for `cover`; anticlockwise seen from outside.
        height: metres.
        cell: side of a cell, metres.
        above: (rows, columns) sum of the faces above; changed in place.
        below: likewise.
    """
    rows, columns = above.shape
    for triangle in range(len(triangles)):
        corners = triangles[triangle]
        ax, ay, az = corners[0, 0], corners[0, 1], corners[0, 2]
        bx, by, bz = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
        cx, cy, cz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
        area = bx * cy - by * cx
        if abs(area) < 1e-9 * cell * cell:
            continue
        sign = 1 if area > 0.0 else -1
        first, last = _cells(corners, 3, 1, cell, rows)
        left, right = _cells(corners, 3, 0, cell, columns)
        for row in range(first, last + 1):
            y = (row + MIDDLE_Y) * cell - ay
            for column in range(left, right + 1):
                x = (column + MIDDLE_X) * cell - ax
                v, w = (x * cy - y * cx) / area, (bx * y - by * x) / area
                if v < 0.0 or w < 0.0 or v + w > 1.0:
                    continue
                if az + v * bz + w * cz > height:
                    above[row, column] += sign
                else:
                    below[row, column] += sign


@njit(cache=True, nogil=True)
def _cells(points, count, axis, cell, cells):  # type: ignore[no-untyped-def]
    """Return the first and last cell that points cover along an axis, at least one."""
    least = greatest = points[0, axis]
    for n in range(1, count):
        least, greatest = min(least, points[n, axis]), max(greatest, points[n, axis])
    first = floor(least / cell + EDGE)
    last = max(first, floor(greatest / cell - EDGE))
    return max(0, min(first, cells - 1)), min(last, cells - 1)


@njit(cache=True, nogil=True)
def _between(points, count, axis, low, high, kept, spare):  # type: ignore[no-untyped-def]
    """Clip a convex polygon to low <= coordinate <= high into `kept`; returns its corners."""
    least = greatest = points[0, axis]
    for n in range(1, count):
        least, greatest = min(least, points[n, axis]), max(greatest, points[n, axis])
    if greatest < low or least > high:
        return 0
    if least >= low and greatest <= high:
        for n in range(count):
            for other in range(3):
                kept[n, other] = points[n, other]
        return count
    count = _clip(points, count, axis, low, 1.0, spare)
    return _clip(spare, count, axis, high, -1.0, kept)


@njit(cache=True, nogil=True)
def _clip(points, count, axis, bound, sign, kept):  # type: ignore[no-untyped-def]
    """Clip a convex polygon at a plane (I. Sutherland, G. Hodgman, 1974)."""
    found = 0
    for n in range(count):
        after = (n + 1) % count
        here, there = sign * (points[n, axis] - bound), sign * (points[after, axis] - bound)
        if here >= 0.0:
            for other in range(3):
                kept[found, other] = points[n, other]
            found += 1
        if here > 0.0 > there or here < 0.0 < there:
            share = here / (here - there)
            for other in range(3):
                kept[found, other] = points[n, other]
                kept[found, other] += share * (points[after, other] - points[n, other])
            kept[found, axis] = bound
            found += 1
    return found
