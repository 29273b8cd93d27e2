"""Compiled loops of map rendering. Grids are (rows, columns) with row 0 at the smallest y."""

from __future__ import annotations

from math import cos, floor, sin
from typing import Any

import numpy as np
from numba import f4, f8, i2, i8

from stack.kernel_cache import njit
from stack.types import FloatArray

ODDS_LIMIT = 10_000
"""Bound of the log-odds of a cell, in thousandths; below the limit of int16."""


@njit(cache=True, nogil=True)
def insert_scan(
    odds: Any,
    origin_x: float,
    origin_y: float,
    resolution: float,
    sensor: FloatArray,
    angles: FloatArray,
    ranges: Any,
    longest: float,
    without_return: float,
    hit: int,
    miss: int,
) -> None:
    """Add a scan to the log-odds of the cells, in thousandths.

    Each cell counts once for a beam: those before its end as free, that of its end as occupied
    (S. Thrun et al., Probabilistic Robotics, chapter 9). Beams without return (inf) clear the
    first `without_return` metres if the beams beside them have none either: a single one was lost.
    Longer ones than `longest` clear up to there.
    """
    rows, columns = odds.shape
    for i in range(ranges.size):
        distance, is_hit = ranges[i], True
        if np.isnan(distance):
            continue
        if np.isinf(distance):
            if np.isfinite(ranges[i - 1]) or np.isfinite(ranges[(i + 1) % ranges.size]):
                continue
            distance, is_hit = without_return, False
        if distance > longest:
            distance, is_hit = longest, False
        c, s = cos(sensor[2] + angles[i]), sin(sensor[2] + angles[i])
        u, v = (sensor[0] - origin_x) / resolution, (sensor[1] - origin_y) / resolution
        end_u, end_v = u + c * distance / resolution, v + s * distance / resolution
        column, row = floor(u), floor(v)
        end_column, end_row = floor(end_u), floor(end_v)
        step_u, step_v = (1 if c > 0.0 else -1), (1 if s > 0.0 else -1)
        per_u = 1.0 / abs(c) if c != 0.0 else 1e30
        per_v = 1.0 / abs(s) if s != 0.0 else 1e30
        next_u = ((column + (1 if c > 0.0 else 0)) - u) * (per_u if c > 0.0 else -per_u)
        next_v = ((row + (1 if s > 0.0 else 0)) - v) * (per_v if s > 0.0 else -per_v)
        for _ in range(abs(end_column - column) + abs(end_row - row)):
            if 0 <= row < rows and 0 <= column < columns:
                odds[row, column] = max(-ODDS_LIMIT, odds[row, column] - miss)
            if next_u < next_v:
                column += step_u
                next_u += per_u
            else:
                row += step_v
                next_v += per_v
        if is_hit and 0 <= end_row < rows and 0 <= end_column < columns:
            odds[end_row, end_column] = min(ODDS_LIMIT, odds[end_row, end_column] + hit)


_floats = f8[::1]
ENTRY_POINTS = ((insert_scan, (i2[:, ::1], f8, f8, f8, _floats, _floats, f4[::1], f8, f8, i8, i8)),)
"""Kernels of map rendering, with the types of their arguments."""
