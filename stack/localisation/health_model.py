"""Health: the calibrated probability that the pose is within 0.3 m and 10 degrees of the true one.

A product of three probabilities: that the estimate is the right one of its rivals; that scans and
filter belong to a right pose, by a logistic model; and that the error stays within 0.3 m, from the
stated deviation. The last one counts along corridors, where scans fit and say nothing of the place.

The weights of the logistic model were fitted by `python -m tests.benchmarks.localisation fit` on
generated flats, offices and warehouses with unmapped furniture, people, pushes and kidnaps (8640
samples), before the third factor was added. `python -m tests.benchmarks localisation` states the
calibration error of the product in other worlds.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, exp, log, sqrt

import numpy as np

from stack.localisation.health import FitScale, ScanView
from stack.types import FloatArray

RIGHT_DISTANCE, RIGHT_ANGLE = 0.3, float(np.radians(10.0))
"""Metres, radians; errors up to which a pose is right."""

_WIDE = 1.0
"""Largest value of the feature of the deviation, reached at 0.08 m. Particles that spread this far
may have lost the pose; whether they spread farther depends on the view, as along a corridor."""


@dataclass(frozen=True, slots=True)
class HealthFeatures:
    """What the probability follows from.

    Attributes:
        now: comparison of the newest scan with the map.
        median: medians over HEALTH_WINDOW.
        scale: fits at true poses of the map.
        deviation: standard deviation of the estimate's own particles, metres.
        confirmed: in [0, 1]: share of the distance after which a found pose is trusted.
        share: probability of the estimate among all hypotheses.
    """

    now: ScanView
    median: ScanView
    scale: FitScale
    deviation: float
    confirmed: float
    share: float = 1.0

    @property
    def within(self) -> float:
        """Probability that an error with the stated deviation is at most RIGHT_DISTANCE."""
        return erf(RIGHT_DISTANCE / (sqrt(2.0) * max(self.deviation, 1e-3)))

    def row(self) -> FloatArray:
        """Return the features of the logistic model: (n,)."""
        z = _clipped(self.scale.relative(self.median.fit), -4.0, 2.0)
        newest = _clipped(self.scale.relative(self.now.fit), -4.0, 2.0)
        return np.array([
            1.0,
            min(z, 0.0),
            max(z, 0.0),
            min(newest, 0.0),
            min(self.median.long, 0.5),
            min(self.median.short, 0.7),
            _clipped(log(max(self.deviation, 1e-3) / 0.03), -1.0, _WIDE),
            1.0 - self.confirmed,
            (1.0 - self.confirmed) * min(z, 0.0),
        ])  # fmt: skip


WEIGHTS: FloatArray = np.array([0.139, -0.480, 3.149, 2.754, -6.008, 5.952, -2.115, -0.220, 1.503])
"""Weights of `HealthFeatures.row`."""


def health(features: HealthFeatures) -> float:
    """Return the probability in [0, 1] that the pose is right."""
    logit = _clipped(float(WEIGHTS @ features.row()), -30.0, 30.0)
    return features.share * features.within / (1.0 + exp(-logit))


def _clipped(value: float, least: float, most: float) -> float:
    """Return the value limited to [least, most]; `np.clip` of a single number takes 10 us."""
    return min(max(value, least), most)
