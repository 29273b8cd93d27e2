"""Numba kernel of the seen ground."""

from __future__ import annotations

from math import atan2, floor, hypot, pi

from numba import f8

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def mark_seen(
    stamps: FloatArray, left: float, bottom: float, cell: float,
    x: float, y: float, heading: float,
    angles: FloatArray, ranges: FloatArray, range_max: float, stamp: float,
) -> None:  # fmt: skip
    """Stamp the cells that a range sensor sees as a whole.

    Every beam that crosses a cell must pass through it or end in it: an obstacle in front of a part
    of the cell hides it. The circle around a cell stands for the cell. The corners of the grid,
    outside its inscribed circle, are left out.

    Args:
        stamps: (rows, columns) seconds, changed in place; row 0 is the lowest y.
        left: x of the grid's left edge, metres.
        bottom: y of its lower edge.
        cell: side of a cell.
        x: of the sensor, in the frame of the grid.
        y: likewise.
        heading: likewise, radians.
        angles: (n,) bearings of the beams in the sensor frame, rising, radians.
        ranges: (n,) metres; +inf: no return; NaN: invalid.
        range_max: metres.
        stamp: of the measurement, seconds.
    """
    count = angles.size
    half, first, width = 0.7072 * cell, angles[0], angles[-1] - angles[0]
    spacing = width / (count - 1)
    rows, columns = stamps.shape
    for row in range(rows):
        dy = bottom + (row + 0.5) * cell - y
        up = 2.0 * (row + 0.5) / rows - 1.0
        for column in range(columns):
            along = 2.0 * (column + 0.5) / columns - 1.0
            if up * up + along * along > 1.0:
                continue
            dx = left + (column + 0.5) * cell - x
            away = hypot(dx, dy)
            if away <= half or away - half > range_max:
                continue
            bearing = atan2(dy, dx) - heading - first
            bearing -= 2.0 * pi * floor(bearing / (2.0 * pi))
            spread = half / away
            low, high = bearing - spread + first, bearing + spread + first
            if low < first or high > first + width:
                continue
            beam = min(count - 1, int((bearing - spread) / spacing))
            while beam > 0 and angles[beam] > low:
                beam -= 1
            while beam + 1 < count and angles[beam + 1] <= low:
                beam += 1
            seen = ranges[beam] >= away - half
            while seen and beam + 1 < count and angles[beam] < high:
                beam += 1
                seen = ranges[beam] >= away - half
            if seen:
                stamps[row, column] = stamp


MARK_SEEN = ((mark_seen, (f8[:, ::1], *6 * (f8,), f8[::1], f8[::1], f8, f8)),)
"""Entry point, with the types that the seen ground calls it with."""
