"""Systematic misses are told from random ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.perception.calibration_watch import CalibrationWatch, f_tail

OFF = np.array([0.012, -0.02, 0.0])


def watched(offset, count, seed=1, deviation=0.002):
    random, watch = np.random.default_rng(seed), CalibrationWatch()
    for _ in range(count):
        expected = random.uniform(-0.5, 0.5, 3)
        watch.add(expected, expected + offset + random.normal(0.0, deviation, 3))
    return watch


@pytest.mark.parametrize(
    ("value", "above", "below", "tail"),
    # Tables of the F distribution.
    [(9.780, 3, 6, 0.01), (5.953, 3, 12, 0.01), (4.757, 3, 6, 0.05), (4.126, 3, 60, 0.01)],
)
def test_the_tail_of_f_is_that_of_tables(value, above, below, tail):
    assert f_tail(value, above, below) == pytest.approx(tail, rel=0.1)


def test_three_equal_misses_are_reported_with_size_and_direction():
    found = watched(OFF, 3).offset
    assert found.count == 3 and found.chance < 0.003
    # Standard deviation of a mean of three: 2 mm / sqrt(3) = 1.2 mm.
    assert found.offset == pytest.approx(OFF, abs=0.004)
    assert found.distance == pytest.approx(0.0233, abs=0.004)
    assert found.deviation == pytest.approx(0.0012, abs=0.0008)


def test_two_misses_are_not_enough():
    assert watched(OFF, 2, deviation=0.0).offset is None


def test_misses_without_any_spread_are_reported():
    found = watched(OFF, 3, deviation=0.0).offset
    assert str(found) == (
        "things are 2.3 cm beside where the camera shows them (1.2 cm forward, 2.0 cm right; mean "
        "of 3, towards -59 deg): calibrate the camera's mount"
    )


def test_an_offset_that_harms_no_grasp_is_not_reported():
    assert watched([0.002, 0.0, 0.0], 20, deviation=0.0003).offset is None


def test_misses_to_all_sides_are_rarely_reported():
    """After any of 20 misses, as they come, of 1 cm: 0.3 % each, 2 % in all."""
    reported = 0
    for seed in range(300):
        random, watch = np.random.default_rng(seed), CalibrationWatch()
        for _ in range(20):
            watch.add(np.zeros(3), random.normal(0.0, 0.01, 3))
            if watch.offset is not None:
                reported += 1
                break
    assert reported <= 12


def test_a_knock_is_noticed_and_a_calibration_forgets():
    watch = watched(np.zeros(3), 10)
    random = np.random.default_rng(2)
    for _ in range(20):
        watch.add(np.zeros(3), OFF + random.normal(0.0, 0.002, 3))
    assert watch.offset.offset == pytest.approx(OFF, abs=0.003)
    watch.clear()
    assert watch.offset is None


@given(st.integers(0, 1000), st.floats(-3.1, 3.1))
def test_the_report_turns_with_the_frame(seed, angle):
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    random, plain, turned = np.random.default_rng(seed), CalibrationWatch(), CalibrationWatch()
    for miss in OFF + random.normal(0.0, 0.002, (4, 3)):
        plain.add(np.zeros(3), miss)
        turned.add(np.zeros(3), turn @ miss)
    assert turned.offset.offset == pytest.approx(turn @ plain.offset.offset)
    assert turned.offset.chance == pytest.approx(plain.offset.chance)
