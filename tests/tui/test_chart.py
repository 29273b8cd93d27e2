"""Scale and curve of a chart by hand."""

import numpy as np

from tui import palette
from tui.chart import SPAN, Chart, draw_curve, sample


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
    levels = sample(times, np.array([1.0, 4.0]), 4)  # at 85, 100, 115 and 130 s
    assert np.isnan(levels[0]) and SPAN == 60.0
    assert levels[1:].tolist() == [1.0, 2.5, 4.0]


def test_a_second_sample_of_one_time_is_ignored():
    chart = Chart("Speed", "m/s", {"real": palette.PATH}, 0.0, 0.2)
    chart.add(1.0, real=0.5)
    chart.add(1.0, real=0.9)
    assert "0.50" in str(chart.border_subtitle)
