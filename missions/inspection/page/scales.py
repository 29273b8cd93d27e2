"""Round numbers for the scales of a report."""

from __future__ import annotations

from math import ceil

import numpy as np


def time_steps(end: float) -> list[float]:
    """About six round times from 0 to the end of a run, seconds."""
    step = round_step(end / 6)
    return [number * step for number in range(ceil(end / step) + 1) if number * step <= end + 1e-9]


def round_step(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(step, 1e-3)))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= step - 1e-9))
