"""Map rendering: what beams mark, clear and leave alone."""

import numpy as np
import pytest

from stack.mapping.slam.rendering.kernels import insert_scan

SENSOR = np.array([2.025, 2.025, 0.0])


def drawn(ranges: list[float]) -> np.ndarray:
    """Log-odds of 4 x 4 m, 5 cm cells, after beams 5 degrees apart along x."""
    odds = np.zeros((80, 80), np.int16)
    angles = np.radians(5.0) * (np.arange(len(ranges)) - len(ranges) // 2)
    insert_scan(
        odds, 0.0, 0.0, 0.05, SENSOR, angles, np.array(ranges, np.float32), 8.0, 1.0, 850, 400
    )
    return odds


def test_a_beam_clears_the_way_to_its_end_and_marks_it():
    odds = drawn([1.0])
    assert (odds[40, 40:60] == -400).all() and odds[40, 60] == 850
    assert np.count_nonzero(odds) == 21


@pytest.mark.parametrize(
    ("ranges", "clears"),
    [([1.0, np.inf, 1.0], False), ([np.inf] * 5, True), ([1.0, np.nan, 1.0], False)],
)
def test_beams_without_return_clear_only_in_company(ranges, clears):
    """A single lost return drew lines of free cells through walls."""
    assert (drawn(ranges)[40, 50] < 0) == clears
