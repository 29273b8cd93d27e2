"""Weights of the Savitzky-Golay filter."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from stack.types import FloatArray


@lru_cache(maxsize=4)
def savitzky_golay_weights(half: int, order: int) -> FloatArray:
    """Return (2 half + 1,) weights: the value at the centre of a least-squares polynomial.

    A. Savitzky, M. J. E. Golay, "Smoothing and Differentiation of Data by Simplified Least Squares
    Procedures", Analytical Chemistry 36, 1964.
    """
    powers = np.vander(np.arange(-half, half + 1), order + 1, increasing=True)
    weights: FloatArray = np.linalg.pinv(powers)[0]
    return weights
