"""Brown-Conrady distortion of a lens.

A ray (x, y, 1) of the optical frame has the radius r² = x² + y² and is seen where

    x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
    column = fx x_d + cx,   row = fy y_d + cy

(D. C. Brown, "Close-Range Camera Calibration", Photogrammetric Engineering 37, 1971; the order of
the coefficients is OpenCV's). The model holds up to the radius at which x_d no longer grows with r;
farther rays would be seen at pixels that belong to others.
"""

from __future__ import annotations

from functools import lru_cache
from math import inf

import numpy as np

from stack.types.geometry import FloatArray

DISTORTION = ("k1", "k2", "p1", "p2", "k3")
"""Names of the distortion coefficients, in OpenCV's order."""

_TABLE, _NEWTON_STEPS, _CONVERGED = 256, 12, 1e-10
"""Radii in the table of first guesses; steps and residual of Newton's method."""


@lru_cache(maxsize=16)
def _limit(distortion: tuple[float, ...]) -> float:
    """Return r² at which the radial distortion x_d(r) stops growing; inf: nowhere."""
    k1, k2, _, _, k3 = distortion
    slope = np.array([7.0 * k3, 5.0 * k2, 3.0 * k1, 1.0])
    roots = np.roots(np.where(np.abs(slope) < 1e-12, 0.0, slope))
    real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0)]
    return float(real.min()) if real.size else inf


def _radial(squares: FloatArray, distortion: tuple[float, ...]) -> FloatArray:
    k1, k2, _, _, k3 = distortion
    return 1.0 + squares * (k1 + squares * (k2 + squares * k3))


def distorted(rays: FloatArray, distortion: tuple[float, ...]) -> FloatArray:
    """Return distorted points (n, 2) of rays (n, 2) at depth 1; NaN beyond the limit."""
    _, _, p1, p2, _ = distortion
    x, y = rays.T
    squares = x * x + y * y
    scale = np.where(squares < _limit(distortion), _radial(squares, distortion), np.nan)
    return np.column_stack(
        [
            x * scale + 2.0 * p1 * x * y + p2 * (squares + 2.0 * x * x),
            y * scale + p1 * (squares + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    )


def undistorted(seen: FloatArray, distortion: tuple[float, ...]) -> FloatArray:
    """Invert `distorted` by Newton's method; NaN where there is no solution within the limit."""
    rays = _first_guess(seen, distortion)
    for _ in range(_NEWTON_STEPS):
        residual = seen - distorted(rays, distortion)
        if not np.nanmax(np.abs(residual), initial=0.0) > _CONVERGED:
            break
        rays = rays + _newton_step(rays, residual, distortion)
    residual = np.abs(seen - distorted(rays, distortion)).max(axis=1, initial=0.0)
    return np.where((residual < 1e3 * _CONVERGED)[:, None], rays, np.nan)


def _first_guess(seen: FloatArray, distortion: tuple[float, ...]) -> FloatArray:
    """Return rays (n, 2) whose radius is that of the radial distortion alone."""
    radii = np.hypot(seen[:, 0], seen[:, 1])
    farthest, end, limit = np.nanmax(radii, initial=0.0), 1.0, _limit(distortion) ** 0.5
    while end < limit and end * _radial(np.array(end * end), distortion) < farthest:
        end *= 2.0
    table = np.linspace(0.0, min(end, limit), _TABLE)
    found = np.interp(radii, table * _radial(table * table, distortion), table)
    scale: FloatArray = np.divide(found, radii, out=np.ones_like(radii), where=radii > 0.0)
    guess: FloatArray = (seen.T * scale).T * (1.0 - 1e-9)
    return guess


def _newton_step(
    rays: FloatArray, residual: FloatArray, distortion: tuple[float, ...]
) -> FloatArray:
    """Solve the 2 x 2 system of each ray: Jacobian of `distorted` times step is the residual."""
    k1, k2, p1, p2, k3 = distortion
    x, y = rays.T
    squares = x * x + y * y
    scale, slope = _radial(squares, distortion), k1 + squares * (2.0 * k2 + 3.0 * squares * k3)
    xx = scale + 2.0 * slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    yy = scale + 2.0 * slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    xy = 2.0 * slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    determinant = xx * yy - xy * xy
    determinant[np.abs(determinant) < 1e-12] = np.nan
    u, v = residual.T
    step: FloatArray = np.column_stack([yy * u - xy * v, xx * v - xy * u]) / determinant[:, None]
    return step
