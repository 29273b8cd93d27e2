"""Compiled loops over the beams of a scan: lost beams, returns on the map, clusters, circles."""

from __future__ import annotations

from math import cos, hypot, isfinite, pi, sin, sqrt

import numpy as np
from numba import b1, f4, f8, i8, njit
from numpy.typing import NDArray

from stack.types import FloatArray


@njit(cache=True, nogil=True)
def bridge(ranges: NDArray[np.float32], jump: float) -> NDArray[np.float32]:
    """Replace single lost beams by the mean of their neighbours; see `bridged`.

    Args:
        ranges: (n,) metres; inf or nan: no return.
        jump: largest difference of the neighbours, metres.

    Returns:
        (n,) metres.
    """
    found, largest = ranges.copy(), np.float32(jump)
    for beam in range(ranges.size):
        if not isfinite(ranges[beam]):
            before, after = ranges[beam - 1], ranges[(beam + 1) % ranges.size]
            if abs(before - after) <= largest:  # inf - inf and nan compare as false
                found[beam] = np.float32(0.5) * (before + after)
    return found


@njit(cache=True, nogil=True)
def end_in_cells(
    ranges: FloatArray, angles: FloatArray, counts: NDArray[np.bool_],
    x: float, y: float, heading: float, resolution: float, cells: NDArray[np.bool_],
) -> NDArray[np.bool_]:  # fmt: skip
    """Whether beams end in cells of a grid; not those that do not count.

    Args:
        ranges: (n,) metres.
        angles: (n,) beam directions, sensor frame, radians.
        counts: (n,) beams to look at; their ranges are finite.
        x: of the sensor from the left edge of the grid, metres.
        y: of the sensor from its lower edge, metres.
        heading: of the sensor, frame of the grid, radians.
        resolution: side of a cell, metres.
        cells: (rows, columns); row 0 is the lowest y.

    Returns:
        (n,) flags.
    """
    found = np.zeros(ranges.size, np.bool_)
    rows, columns = cells.shape
    for beam in range(ranges.size):
        if counts[beam]:
            angle = angles[beam] + heading
            # rounding towards zero puts what is up to a cell outside into the border: harmless
            column = int((ranges[beam] * cos(angle) + x) / resolution)
            row = int((ranges[beam] * sin(angle) + y) / resolution)
            if 0 <= row < rows and 0 <= column < columns:
                found[beam] = cells[row, column]
    return found


@njit(cache=True, nogil=True)
def linked_runs(
    ranges: FloatArray, increment: float, jump: float, valid: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Find the runs of neighbouring returns; see `clusters`.

    Args:
        ranges: (n,) metres.
        increment: radians from beam to beam.
        jump: metres.
        valid: (n,) beams to use.

    Returns:
        (k, 2) first, last + 1 of each run; beam indices are modulo n.
    """
    n = ranges.size
    runs, count, first = np.empty((n, 2), np.int64), 0, 0
    links_round = (
        n * abs(increment) >= 2.0 * pi - 1.5 * abs(increment)
        and valid[n - 1] and valid[0] and _are_near(ranges[n - 1], ranges[0], increment, jump)
    )  # fmt: skip
    was_linked = links_round
    for beam in range(n):
        if not valid[beam]:
            was_linked = False
            continue
        if not was_linked:
            first = beam
        if beam == n - 1:
            was_linked = links_round
        else:
            was_linked = valid[beam + 1] and _are_near(
                ranges[beam], ranges[beam + 1], increment, jump
            )
        if not was_linked:
            runs[count, 0], runs[count, 1] = first, beam + 1
            count += 1
    if links_round and count > 0:  # the run that ends first began last
        end = runs[0, 1] + n
        for number in range(count - 1):
            runs[number] = runs[number + 1]
        runs[count - 1, 0], runs[count - 1, 1] = first, end
    return runs[:count].copy()


@njit(cache=True, nogil=True)
def _are_near(one: float, other: float, increment: float, jump: float) -> bool:
    """Whether two returns, an angle apart, are at most a jump distance apart."""
    return one * one + other * other - (2.0 * cos(increment)) * one * other <= jump * jump


@njit(cache=True, nogil=True)
def end_at_discs(
    ranges: FloatArray, angles: FloatArray, x: float, y: float, heading: float, discs: FloatArray
) -> NDArray[np.bool_]:
    """Whether beams end in discs.

    Args:
        ranges: (n,) metres; inf or nan: no return.
        angles: (n,) beam directions, sensor frame, radians.
        x: of the sensor, frame of the discs, metres.
        y: of the sensor, likewise.
        heading: of the sensor, likewise, radians.
        discs: (k, 3) x, y, radius, metres.

    Returns:
        (n,) flags.
    """
    found = np.zeros(ranges.size, np.bool_)
    for beam in range(ranges.size):
        if isfinite(ranges[beam]) and ranges[beam] > 0.0:
            angle = angles[beam] + heading
            end_x, end_y = x + ranges[beam] * cos(angle), y + ranges[beam] * sin(angle)
            for number in range(discs.shape[0]):
                centre_x, centre_y, radius = discs[number]
                if hypot(end_x - centre_x, end_y - centre_y) <= radius:
                    found[beam] = True
                    break
    return found


@njit(cache=True, nogil=True)
def fit_circle(points: FloatArray, iterations: int, least_noise: float) -> FloatArray:
    """Fit a circle to points: Gauss-Newton on the distances, from Kåsa's algebraic fit.

    Args:
        points: (n, 2) metres, n above 3.
        iterations: of Gauss-Newton.
        least_noise: standard deviation of a point if the fit leaves less, metres.

    Returns:
        (6,) x, y and radius of the circle, root mean square of the distances from it, standard
        deviations of the radius and of the centre in its least certain direction, all in metres;
        nan: the points are on a line.
    """
    n = points.shape[0]
    mx, my = points[:, 0].sum() / n, points[:, 1].sum() / n
    xx, xy, yy, xs, ys = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        x, y = points[i, 0] - mx, points[i, 1] - my
        square = x * x + y * y
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        xs, ys = xs + x * square, ys + y * square
    found = np.full(6, np.nan)
    determinant = xx * yy - xy * xy
    if determinant <= 0.0:
        return found
    cx = 0.5 * (yy * xs - xy * ys) / determinant
    cy = 0.5 * (xx * ys - xy * xs) / determinant
    radius = sqrt((xx + yy) / n + cx * cx + cy * cy)
    for iteration in range(iterations + 1):
        # Normal equations of the slopes (-ux, -uy, -1) of the distances, u the unit vector out.
        aa, ab, bb, a, b = 0.0, 0.0, 0.0, 0.0, 0.0
        ae, be, e, ee = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dx, dy = points[i, 0] - mx - cx, points[i, 1] - my - cy
            away = max(hypot(dx, dy), 1e-6)
            ux, uy, error = dx / away, dy / away, away - radius
            aa, ab, bb, a, b = aa + ux * ux, ab + ux * uy, bb + uy * uy, a + ux, b + uy
            ae, be, e, ee = ae + ux * error, be + uy * error, e + error, ee + error * error
        # Cofactors of the symmetric matrix ((aa, ab, a), (ab, bb, b), (a, b, n)).
        c00, c01, c02 = bb * n - b * b, a * b - ab * n, ab * b - a * bb
        c11, c12, c22 = aa * n - a * a, ab * a - aa * b, aa * bb - ab * ab
        determinant = aa * c00 + ab * c01 + a * c02
        if determinant <= 0.0:
            return found
        if iteration < iterations:
            cx += (c00 * ae + c01 * be + c02 * e) / determinant
            cy += (c01 * ae + c11 * be + c12 * e) / determinant
            radius += (c02 * ae + c12 * be + c22 * e) / determinant
    noise = sqrt(ee / (n - 3))
    unit = max(2.0 * noise, least_noise) ** 2 / determinant
    largest = 0.5 * (c00 + c11) + hypot(0.5 * (c00 - c11), c01)
    found[:] = (mx + cx, my + cy, radius, noise, sqrt(c22 * unit), sqrt(largest * unit))
    return found


TRACKING = (
    (bridge, (f4[::1], f8)),
    (end_in_cells, (f8[::1], f8[::1], b1[::1], f8, f8, f8, f8, b1[:, ::1])),
    (linked_runs, (f8[::1], f8, f8, b1[::1])),
    (end_at_discs, (f8[::1], f8[::1], f8, f8, f8, f8[:, ::1])),
    (fit_circle, (f8[:, ::1], i8, f8)),
)
"""Entry points, with the types that the tracker calls them with."""
