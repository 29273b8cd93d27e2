"""Position of a circle of known radius from returns on a part of it.

Where something hides a side of an object, the middle of what is seen is not its centre; with the
radius known, the curvature of the visible arc still gives the centre, well along the line of sight
and less well across it. Maximum a posteriori estimate by Gauss-Newton with Huber's weights (P. J.
Huber, "Robust Estimation of a Location Parameter", Annals of Mathematical Statistics 35(1), 1964).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

LEAST_POINTS = 4
SURFACE_NOISE = 0.05
"""Standard deviation of the centre in a direction that the arc determines, metres."""

POINT_NOISE = 0.03
"""Metres: noise of a return, and by how much bodies are not round."""

LARGEST_NOISE = 1.0
"""Standard deviation of the centre in a direction that the arc does not determine, metres."""

EDGE = 0.15
"""Metres by which the view goes on behind the edge of an object."""

ITERATIONS = 4
ON_SURFACE = 0.6
"""Share of the returns that must end on the fitted surface."""


def surface_fit(
    points: FloatArray, centre: FloatArray, radius: float, covariance: FloatArray,
    sensor: FloatArray,
) -> tuple[FloatArray, FloatArray] | None:  # fmt: skip
    """Fit the centre of a circle to returns on its visible side.

    Args:
        points: (n, 2) metres.
        centre: (2,) expected.
        radius: metres.
        covariance: (2, 2) of the expected centre, m².
        sensor: (2,) position.

    Returns:
        The measured centre (2,) and its covariance (2, 2), without the expectation: large across
        the line of sight if the arc is short. None if the points do not fit.
    """
    visible = (points - centre) @ (sensor - centre) > 0.0
    points = points[visible]
    if len(points) < LEAST_POINTS:
        return None
    prior, position = np.linalg.inv(covariance), centre.copy()
    for _ in range(ITERATIONS):
        information, pull = _information(points, position, radius)
        position += np.linalg.solve(prior + information, prior @ (centre - position) + pull)
    errors = np.hypot(*(points - position).T) - radius
    if (np.abs(errors) <= 3.0 * POINT_NOISE).mean() < ON_SURFACE:
        return None
    information, pull = _information(points, position, radius)
    noise = np.asarray(np.linalg.inv(information + np.eye(2) / LARGEST_NOISE**2), np.float64)
    return position + noise @ pull, noise


def has_edge(ranges: NDArray[np.float32], beams: NDArray[np.intp]) -> bool:
    """Return whether the view goes on behind one side of some beams' returns.

    Args:
        ranges: (n,) of the scan, metres; +inf: no return, nan: not known.
        beams: (k,) increasing.
    """
    first, last, n = int(beams[0]), int(beams[-1]), ranges.size
    beside = [(first, first - 1), (first, first - 2), (last, last + 1), (last, last + 2)]
    return any(
        0 <= other < n and bool(ranges[other] > ranges[edge] + EDGE) for edge, other in beside
    )


def _information(
    points: FloatArray, centre: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return the information (2, 2) of the arc and its gradient (2,) at a centre.

    The information is 1 / SURFACE_NOISE² in the direction that the arc determines best, however
    many returns there are: their errors are not independent.
    """
    off = points - centre
    away = np.maximum(np.hypot(off[:, 0], off[:, 1]), 1e-6)
    normal, errors = off / away[:, None], away - radius
    weights = np.minimum(1.0, POINT_NOISE / np.maximum(np.abs(errors), 1e-9))
    scatter = (normal * weights[:, None]).T @ normal
    scale = 1.0 / (max(float(np.linalg.eigvalsh(scatter)[-1]), 1e-9) * SURFACE_NOISE**2)
    return scale * scatter, scale * normal.T @ (weights * errors)
