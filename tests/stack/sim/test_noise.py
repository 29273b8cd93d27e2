"""The streams of measurements are those of NumPy's SeedSequence."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.sim.sensors.noise import MeasurementStreams
from stack.streams import stream

NUMBERS = st.integers(0, 2**100)


@settings(deadline=None)  # the first call compiles the kernel
@given(NUMBERS, st.text(max_size=20), NUMBERS)
def test_each_measurement_has_the_stream_of_its_step(seed, name, step):
    """Seeds and steps of one to four words of 32 bits."""
    ours, numpys = MeasurementStreams(seed, name).at(step), stream(seed, name, step)
    assert ours.bit_generator.state == numpys.bit_generator.state
    assert ours.normal(0.0, 1.0, 3).tolist() == numpys.normal(0.0, 1.0, 3).tolist()


def test_a_stream_does_not_depend_on_those_taken_before():
    streams = MeasurementStreams(7, "lidar")
    first = streams.at(500).random()
    streams.at(25).random(9)
    assert streams.at(500).random() == first == stream(7, "lidar", 500).random()


def test_a_negative_step_is_refused():
    with pytest.raises(ValueError, match="-1 is negative"):
        MeasurementStreams(1, "lidar").at(-1)
