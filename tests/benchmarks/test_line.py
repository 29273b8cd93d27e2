"""The bench of line following: its courses, its table, and one real run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.sim.worlds.world_file import read_world
from tests.benchmarks.benches.line import LIGHTS, LINE, LineEntry, LineRow, entries_of, table_of
from tests.benchmarks.benchmark import MoreOptions
from tests.benchmarks.line_courses import APART, GAPS, MAIN, cross_track, make_course

ROW = LineRow(
    "scout", "dim", 0, status="passed", cause="", rms=0.01, largest=0.05, speed=0.35,
    crossed=True, junction=True, time=40.0, wall_seconds=6.0,
)  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
def test_a_course_has_a_gap_a_junction_and_an_end_mark_on_its_route(seed, tmp_path):
    course = make_course(seed)
    length = np.linalg.norm(np.diff(course.route, axis=0), axis=1).sum()
    assert GAPS[0] <= np.ptp(course.gap) <= GAPS[1]
    assert 1.0 < course.gap[0] < length - 0.3 and 1.0 < course.junction < length - 0.3
    assert course.branch in (MAIN, "left", "right")
    before, after, _, bar = course.lines
    # The paint ends within a point of the line, 5 cm, of the gap.
    assert np.linalg.norm(after[0] - before[-1]) == pytest.approx(np.ptp(course.gap), abs=0.1)
    assert bar.mean(axis=0) == pytest.approx(course.route[-1], abs=1e-3)
    file = tmp_path / "world.yaml"
    file.write_text(course.text(0.3), "utf-8")
    world = read_world(file)
    assert world.light == 0.3 and len(world.lines) == 4
    assert not world.warnings
    far = [np.linalg.norm(course.route - point, axis=1).min() for point in world.walls[0].points]
    assert min(far) > APART


def test_a_seed_is_always_the_same_course():
    first, again = make_course(3), make_course(3)
    assert first.text(1.0) == again.text(1.0) and first.text(1.0) != make_course(4).text(1.0)


@given(st.floats(0.0, 4.0), st.floats(-0.5, 0.5))
def test_the_distance_from_a_straight_route(along, aside):
    route = np.array([[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]])
    away, travelled = cross_track(route, np.array([[along, aside]]))
    assert away[0] == pytest.approx(abs(aside)) and travelled[0] == pytest.approx(along)


def test_the_table_counts_what_was_handled():
    failed = replace(ROW, seed=1, status="failed", cause="lost", junction=False, rms=0.03)
    (row,) = table_of([ROW, failed])
    assert (row["passed"], row["gaps"], row["junctions"]) == ("1/2", "2/2", "1/2")
    assert (row["RMS"], row["worst RMS"]) == ("2.0 cm", "3.0 cm")
    lines = LINE.report([ROW, failed])
    assert lines[1].startswith("scout  dim") and "seed 1: failed: lost" in lines[2]


def test_a_crash_is_a_row(tmp_path):
    entry = LineEntry("scout", "dim", 5, MoreOptions(tmp_path))
    row = LineRow.crashed(entry.key, "out of memory")
    assert (row.key, row.success, row.cause) == (entry.key, False, "out of memory")


def test_a_run_follows_its_line_in_the_dark(tmp_path):
    entries = entries_of(MoreOptions(tmp_path, robots=("scout",)))
    assert [entry.light for entry in entries] == list(LIGHTS)
    row = LINE.row(entries[0], tmp_path)
    assert row.success and row.crossed and row.junction, row.cause
    assert row.rms < 0.03 and 0.3 < row.speed < 0.41
