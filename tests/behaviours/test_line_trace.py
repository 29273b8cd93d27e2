"""Tracing of painted lines: curves, gaps, junctions, end marks."""

from dataclasses import replace
from math import cos, pi, radians, sin

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviours._line.strand import Strand, beginning
from behaviours._line.trace import LineEnd, Sector, trace_line
from stack.sim.worlds.polylines import rounded
from tests.behaviours.line_robot import distances, painted

CHOICES = {
    "left": lambda turns: int(np.argmax(turns)),
    "right": lambda turns: int(np.argmin(turns)),
    "straight": lambda turns: int(np.argmin(np.abs(turns))),
}


def line(*points):
    return np.array(points, dtype=float)


STRAIGHT = line([-2.0, 0.0], [1.4, 0.0])


def trace(lines, start=(-1.0, 0.0), heading=0.0, gap=0.5, choose="straight", passed=None):
    return trace_line(
        lines, np.array(start), heading, Sector(1.0, 0.8),
        lambda corner, turns, tips: CHOICES[choose](turns), width=0.05, gap=gap, passed=passed,
    )  # fmt: skip


def test_a_straight_line_is_traced_to_its_end():
    found = trace(painted(STRAIGHT))
    assert found.end is LineEnd.CLOSED
    assert found.points[0] == pytest.approx([-1.0, 0.0], abs=0.04)
    # Its paint ends in a half circle of 2.5 cm at x = 1.4.
    assert found.points[-1] == pytest.approx([1.4, 0.0], abs=0.03)
    assert np.abs(found.points[:, 1]).max() < 0.01


@settings(deadline=None, max_examples=25)
@given(st.floats(0.4, 1.5), st.floats(-1.2, 1.2), st.floats(-pi, pi))
def test_the_trace_of_a_bend_keeps_to_its_middle(radius, bend, turn):
    corner = rounded(line([-1.2, 0.0], [0.0, 0.0], [np.cos(bend), np.sin(bend)]), radius)
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    bent = corner @ rotation
    found = trace(painted(bent), bent[0], turn)
    assert found.end is LineEnd.CLOSED
    assert distances(found.points[:-1], (bent,)).max() < 0.015
    assert found.points[-1] == pytest.approx(bent[-1], abs=0.05)


def test_a_line_that_leaves_what_was_seen_is_open():
    found = trace(painted(STRAIGHT, seen=0.5))
    assert found.end is LineEnd.OPEN and found.points[-1, 0] == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(("gap", "end"), [(0.5, 1.5), (0.2, -0.2)])
def test_a_gap_is_bridged_up_to_its_length(gap, end):
    parts = line([-2.0, 0.0], [-0.2, 0.0]), line([0.1, 0.0], [1.5, 0.0])
    assert trace(painted(*parts), gap=gap).points[-1, 0] == pytest.approx(end, abs=0.03)


def test_a_line_across_is_not_the_other_side_of_a_gap():
    parts = line([-2.0, 0.0], [-0.2, 0.0]), line([0.1, -1.0], [0.1, 1.0])
    found = trace(painted(*parts))
    assert found.end is LineEnd.CLOSED and found.points[-1, 0] == pytest.approx(-0.2, abs=0.03)


@pytest.mark.parametrize(
    ("choose", "end"), [("left", (0.7, 0.7)), ("straight", (1.5, 0.0)), ("right", (0.0, -1.0))]
)
def test_the_chosen_branch_is_followed(choose, end):
    branches = line([0.0, 0.0], [0.7, 0.7]), line([0.0, 0.0], [0.0, -1.0])
    found = trace(painted(line([-2.0, 0.0], [1.5, 0.0]), *branches), choose=choose)
    assert found.points[-1] == pytest.approx(end, abs=0.05)
    assert found.junctions[0] == pytest.approx((0.0, 0.0), abs=0.12)


def test_a_stub_is_no_branch():
    stub = line([0.0, 0.0], [0.0, 0.15])
    found = trace(painted(STRAIGHT, stub), choose="left")
    assert len(found.junctions) == 0 and found.points[-1, 0] == pytest.approx(1.4, abs=0.03)


def test_a_branch_with_a_gap_begins_before_the_gap():
    """20 cm of it are seen, then 60 cm are not: its beginning ends 26 cm from the junction."""
    seen, behind = Strand(), Strand()
    for x in np.arange(0.0, 0.21, 0.02):
        seen.add(np.array([x, 0.0]), 0.05)
    for x in np.arange(0.8, 1.5, 0.02):
        behind.add(np.array([x, 0.3]), 0.05)
    seen.branches = [behind]
    # the way across the gap leads from (0.2, 0) to (0.8, 0.3), a slope of 1 to 2
    assert beginning(seen) == pytest.approx(
        np.array([[0.06, 0.0], [0.2 + 0.06 * 0.894, 0.06 * 0.447]]), abs=0.002
    )


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.8, pi / 2])
@pytest.mark.parametrize("half", [0.1, 0.15, 0.2])
def test_a_short_bar_across_is_the_end_mark(turn, half):
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    way = line([-1.5, 0.0], [0.8, 0.0]) @ rotation
    bar = line([0.8, -half], [0.8, half]) @ rotation
    found = trace(painted(way, bar), way[0], turn)
    assert found.end is LineEnd.MARK
    assert found.points[-1] == pytest.approx(way[-1], abs=0.05)


def test_a_long_bar_is_a_junction():
    bar = line([0.5, -0.8], [0.5, 0.8])
    found = trace(painted(line([-1.5, 0.0], [0.5, 0.0]), bar), choose="right")
    assert found.end is LineEnd.CLOSED and found.points[-1] == pytest.approx([0.5, -0.8], abs=0.05)


def test_a_line_ahead_is_found_and_one_behind_is_not():
    lines = painted(line([0.0, 0.3], [2.0, 0.3]))
    assert trace(lines, (-0.7, 0.0)).points[0] == pytest.approx([0.0, 0.3], abs=0.05)
    assert trace(lines, (-0.7, 0.0), pi) is None


def test_a_line_that_was_followed_is_not_found_again():
    lines = painted(STRAIGHT)
    assert trace(lines, passed=STRAIGHT[:1] + np.linspace(0, 4, 200)[:, None] * [1.0, 0.0]) is None


def ragged(lines, seed):
    """Flip a quarter of the cells at the edges of the paint."""
    paint, around = lines.marked.astype(np.uint8), np.ones((3, 3), np.uint8)
    edge = cv2.dilate(paint, around) != cv2.erode(paint, around)
    flipped = edge & (np.random.default_rng(seed).random(paint.shape) < 0.25)
    return replace(lines, marked=lines.marked ^ flipped)


def turned(points, angle):
    return line(*points) @ [[cos(angle), sin(angle)], [-sin(angle), cos(angle)]]


@pytest.mark.parametrize("seed", range(12))
def test_ragged_paint_has_the_same_mark_and_junction(seed):
    # Flipped cells split the front; such stubs are neither branches nor arms.
    turn, fork = 0.5 * seed, radians(30.0 + 3.0 * seed)
    way = turned([(-1.2, 0.0), (0.8, 0.0)], turn)
    bar = turned([(0.8, -0.15), (0.8, 0.15)], turn)
    marked = trace(ragged(painted(way, bar, size=3.6), seed), way[0], turn)
    assert marked.end is LineEnd.MARK and len(marked.junctions) == 0
    assert marked.points[-1] == pytest.approx(way[-1], abs=0.06)
    branch = turned([(-0.4, 0.0), (cos(fork) - 0.4, sin(fork))], turn)
    lines = ragged(painted(way, branch, size=3.6), seed)
    for choose, end in (("straight", way[-1]), ("left", branch[-1])):
        found = trace(lines, way[0], turn, choose=choose)
        assert len(found.junctions) == 1 and found.points[-1] == pytest.approx(end, abs=0.08)


def test_a_bar_at_the_edge_of_what_was_seen_is_the_end_mark():
    # Both arms of the mark are seen for 10 cm; one of them leaves what was seen.
    lines = painted(line([-1.5, 0.0], [0.8, 0.0]), line([0.8, -0.15], [0.8, 0.15]))
    seen = lines.seen.copy()
    seen[: round(2.4 / lines.cell)] = False  # y < -0.1
    found = trace(replace(lines, marked=lines.marked & seen, seen=seen), (-1.5, 0.0))
    assert found.end is LineEnd.MARK and found.points[-1] == pytest.approx((0.8, 0.0), abs=0.05)


def test_a_line_goes_on_beyond_floor_that_no_picture_showed():
    # Behind a sharp turn 40 cm of the branch stay below the pictures.
    lines = painted(STRAIGHT)
    seen = lines.seen.copy()
    seen[:, round(2.5 / lines.cell) : round(2.9 / lines.cell)] = False  # 0 < x < 0.4
    found = trace(replace(lines, marked=lines.marked & seen, seen=seen), gap=0.2)
    assert found.end is LineEnd.CLOSED and found.points[-1] == pytest.approx([1.4, 0.0], abs=0.03)
