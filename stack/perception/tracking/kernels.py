"""Compiled fit of circles to the returns of a scan."""

from __future__ import annotations

from math import hypot, sqrt

import numpy as np
from numba import f8, i8

from stack.kernel_cache import njit
from stack.types import FloatArray


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


TRACKING = ((fit_circle, (f8[:, ::1], i8, f8)),)
"""Entry point, with the types that the tracker calls it with."""
