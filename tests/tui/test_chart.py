"""Scale and curve of a chart by hand."""

import numpy as np
import pytest

from tui.drawing import palette
from tui.panes.chart import Chart, _tick, draw_curve, fitting_span, sample


def curve(shares, rows=1):
    columns = (len(shares) + 1) // 2
    glyphs = np.full((rows, columns), 0x2800, dtype=np.uint32)
    colours = np.zeros((rows, columns), dtype=np.uint32)
    draw_curve(glyphs, colours, np.array(shares), palette.PATH)
    return ["".join(map(chr, row)) for row in glyphs]


def test_the_top_dot_is_one_and_the_bottom_dot_is_nought():
    assert curve([1.0, 1.0]) == ["⠉"]
    assert curve([0.0, 0.0]) == ["⣀"]


def test_a_step_is_joined_by_a_vertical_piece():
    # Down from the first dot column's top to the second one's bottom: dots 1, then 5, 6 and 8.
    assert curve([1.0, 0.0]) == ["⢱"]
    assert curve([1.0, 0.0], rows=2)[1] == "⢸"


def test_unknown_values_leave_a_gap_and_large_ones_stay_inside():
    assert curve([np.nan, 5.0]) == ["⠈"]


def test_samples_end_at_the_newest_and_are_unknown_before_the_first():
    times = np.array([100.0, 130.0])
    levels = sample(times, np.array([1.0, 4.0]), 4, 60.0)
    # Columns are 15 s apart: at 90, 105, 120 and 135 s. Values rise by 0.1 per second.
    assert np.isnan(levels[0])
    assert levels[1:].tolist() == [1.5, 3.0, 4.0]


@pytest.mark.parametrize(
    ("seconds", "most", "span"),
    [(0.0, 60.0, 10.0), (10.0, 60.0, 10.0), (10.1, 60.0, 30.0), (59.0, 60.0, 60.0),
     (61.0, 60.0, 60.0), (90.0, 600.0, 120.0), (5.0, 10.0, 10.0), (700.0, 600.0, 600.0)],
)  # fmt: skip
def test_the_scale_of_time_fits_a_short_run(seconds, most, span):
    assert fitting_span(seconds, most) == span


def test_the_title_of_a_chart_tells_its_time():
    chart = Chart("Speed", "m/s", {"wheels": palette.PATH, "true": palette.PERSON}, 0.0, 0.2)
    assert "10 s" in str(chart.border_title)


def test_a_curve_does_not_flicker_between_two_columns():
    """The older dots are the same 0.4 s later: sampled at the same times."""
    times = np.arange(0.0, 120.2, 0.2)
    values = np.sin(times)
    early = sample(times[:-2], values[:-2], 60, 60.0)
    assert np.array_equal(sample(times, values, 60, 60.0)[:-2], early[:-2])


def test_a_second_sample_of_one_time_is_ignored():
    chart = Chart("Speed", "m/s", {"wheels": palette.PATH, "true": palette.PERSON}, 0.0, 0.2)
    chart.add(1.0, wheels=0.5)
    chart.add(1.0, wheels=0.9)
    assert "wheels 0.50" in str(chart.border_subtitle)
    assert "true" not in str(chart.border_subtitle)  # a robot without a simulation has none


def test_a_label_of_nought_has_no_sign():
    assert _tick(2, 3, -0.003, 0.5) == " 0.00 ┤"
    assert _tick(2, 3, -0.3, 0.5) == "-0.30 ┤"
