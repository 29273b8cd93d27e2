# mypy: allow-untyped-defs
"""Compiled loops of the time law along a path (timing.py)."""

import numpy as np
from numba import f8

from stack.kernel_cache import njit

BISECTIONS = 50
TINY = 1e-9  # tangents below: the joint stands in this part


@njit(cache=True, nogil=True)
def bounds_of(x, tangent, curvature, acceleration):
    """Lowest and highest path acceleration at the squared path speed x; low > high: none.

    tangent, curvature and acceleration are (n,): |tangent u + curvature x| <= acceleration.
    """
    low, high = -np.inf, np.inf
    for i in range(len(tangent)):
        if abs(tangent[i]) < TINY:
            if abs(curvature[i]) * x > acceleration[i]:
                return 1.0, 0.0
            continue
        first = (-acceleration[i] - curvature[i] * x) / tangent[i]
        second = (acceleration[i] - curvature[i] * x) / tangent[i]
        low = max(low, min(first, second))
        high = min(high, max(first, second))
    return low, high


@njit(cache=True, nogil=True)
def time_law(steps, tangents, curvatures, velocity, acceleration):
    """Fastest squared path speeds (k + 1,) on a grid, from rest to rest.

    steps (k,): lengths between the grid's points. tangents (k + 1, n), curvatures (k, n): first
    and second derivative of the joints by the path's length, the second one in each part.
    velocity, acceleration (n,): limits.
    """
    count = len(steps)
    fastest = np.empty(count + 1)
    for k in range(count + 1):
        x = np.inf
        for i in range(tangents.shape[1]):
            if abs(tangents[k, i]) > TINY:
                x = min(x, (velocity[i] / tangents[k, i]) ** 2)
        fastest[k] = x
    fastest[count] = 0.0
    # Backwards: the highest speed from which the following one can still be reached.
    for k in range(count - 1, -1, -1):
        low, high = 0.0, fastest[k]
        if not _reaches(high, k, fastest[k + 1], steps, tangents, curvatures, acceleration):
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                if _reaches(middle, k, fastest[k + 1], steps, tangents, curvatures, acceleration):
                    low = middle
                else:
                    high = middle
            fastest[k] = low
    # Forwards: accelerate as much as is possible.
    fastest[0] = 0.0
    for k in range(count):
        x = fastest[k]
        low, high = bounds_of(x, tangents[k], curvatures[k], acceleration)
        reached = min(fastest[k + 1], max(x + 2.0 * steps[k] * high, 0.0))
        fastest[k + 1] = reached
    return fastest


@njit(cache=True, nogil=True)
def _reaches(x, k, following, steps, tangents, curvatures, acceleration):
    """Whether some acceleration leads from the squared speed x at k to at most the following."""
    low, high = bounds_of(x, tangents[k], curvatures[k], acceleration)
    if low > high:
        return False
    least = x + 2.0 * steps[k] * low
    most = x + 2.0 * steps[k] * high
    if least > following or most < 0.0:
        return False
    # At its end the part turns with another speed: the same acceleration must be possible there.
    end = min(following, most)
    low, high = bounds_of(end, tangents[k + 1], curvatures[k], acceleration)
    return low <= high and (end - x) / (2.0 * steps[k]) >= low - 1e-9


TIME_LAW = ((time_law, (f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1])),)
"""Entry point, with the types that `time_path` calls it with."""
