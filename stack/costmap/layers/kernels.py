# mypy: allow-untyped-defs
"""Compiled loops of layers that read no ranges: the map and people's predicted motion.

Grids are (rows, columns), row 0 at the smallest y. A box is (first row, last row + 1, first column,
last column + 1).
"""

import numpy as np
from numba import f8, i8, u1

from stack.kernel_cache import njit

INSCRIBED, LETHAL, UNKNOWN = 253, 254, 255


@njit(cache=True, nogil=True)
def paint_map(cells, costs, top, bottom, left, right):
    """Paint a map's costs over the cells of a box where they are unknown or the map is lethal."""
    for row in range(top, bottom):
        target, source = cells[row - top], costs[row, left:right]
        for column in range(right - left):
            value, ours = target[column], source[column]
            target[column] = ours if value == UNKNOWN or ours == LETHAL else value


@njit(cache=True, nogil=True)
def raise_along_motion(
    cells, left_x, low_y, resolution, start_x, start_y, speed_x, speed_y, horizon, radius, reach,
    cost, fade, spread,
):  # fmt: skip
    """Raise the cost of known cells along a predicted straight motion; see SocialLayer.

    The outer corner of cell (0, 0) is (left_x, low_y).
    """
    per_squared = 1.0 / max(speed_x * speed_x + speed_y * speed_y, 1e-12)
    slope = fade / max(horizon, 1e-12)
    outer = (radius + reach) * (radius + reach)
    for row in range(cells.shape[0]):
        y = low_y + (row + 0.5) * resolution - start_y
        for column in range(cells.shape[1]):
            value = cells[row, column]
            if value >= INSCRIBED:
                continue
            x = left_x + (column + 0.5) * resolution - start_x
            time = min(max((x * speed_x + y * speed_y) * per_squared, 0.0), horizon)
            ahead, aside = x - speed_x * time, y - speed_y * time
            away = ahead * ahead + aside * aside
            if away > outer:
                continue
            share = max(np.sqrt(away) - radius, 0.0) / spread
            raised = cost * (1.0 - slope * time) * np.exp(-0.5 * share * share)
            cells[row, column] = max(value, int(raised + 1e-9))


MAP = ((paint_map, (u1[:, ::1], u1[:, ::1], i8, i8, i8, i8)),)
SOCIAL = (
    (raise_along_motion, (u1[:, ::1], *13 * (f8,))),
    (raise_along_motion, (u1[:, :], *13 * (f8,))),
)
