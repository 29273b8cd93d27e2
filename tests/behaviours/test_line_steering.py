"""Speed along corners."""

from math import sqrt

import numpy as np
import pytest

from behaviours._line.steering import CORNER_BRAKING, CURVE_SPEED, CentreLine
from stack.types import Pose2D

STEPS = np.arange(0.0, 2.0, 0.02)[:, None]
CORNER = np.concatenate([STEPS * [1.0, 0.0], [2.0, 0.0] + STEPS * [0.0, 1.0]])


def limit(x, y=0.0):
    line = CentreLine(CORNER)
    for along in np.arange(0.0, x + 1e-6, 0.1):
        line.advance(Pose2D(float(along), 0.0))
    line.advance(Pose2D(x, y))
    return line.speed_limit()


def test_it_brakes_before_a_corner_over_the_braking_distance():
    # v^2 = v_corner^2 + 2 a d; the turn is spread over the 10 cm that the line is smoothed over
    # and the 10 cm over which its curvature is measured, so it begins 10 cm before the corner.
    assert limit(1.7) == pytest.approx(sqrt(CURVE_SPEED**2 + 2.0 * CORNER_BRAKING * 0.2), abs=0.06)
    assert limit(1.9) == pytest.approx(CURVE_SPEED, abs=0.06)
    assert limit(1.0) > 10.0


def test_it_stays_slow_until_the_corner_is_behind():
    # BEHIND is 12 cm: up to there the robot still turns.
    assert limit(2.0, 0.04) == pytest.approx(CURVE_SPEED, abs=0.02)
    assert limit(2.0, 0.3) > 10.0
