"""The bench of docking: its worlds, its table, and one real run."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, radians

import pytest

from missions.bench.bench import Options
from stack.sim.worlds.world_file import read_world
from tests.benchmarks.benches.docking import (
    DOCKING,
    FACE,
    FARTHEST,
    NEAREST,
    DockingRow,
    entries_of,
    table_of,
    world_text,
)
from tests.benchmarks.robot_entry import RobotEntry

ROW = DockingRow(
    "scout", 0, status="passed", cause="", error=0.002, turn=0.01, contacts=0, time=14.0,
    wall_seconds=1.0,
)  # fmt: skip


@pytest.mark.parametrize("seed", range(8))
def test_a_start_is_in_front_of_the_dock_and_clear(seed, tmp_path):
    text, guess = world_text(seed)
    file = tmp_path / "world.yaml"
    file.write_text(text, "utf-8")
    world = read_world(file)
    away = world.start.relative_to(FACE)
    assert NEAREST - 0.01 <= hypot(away.x, away.y) <= FARTHEST + 0.01 and away.x > 0.0
    assert 0.0 < guess.distance_to(world.start) < 0.8
    for box in world.boxes[:2]:
        assert box.pose.distance_to(world.start) > 1.0 and abs(box.pose.y) > 0.9
    assert world_text(seed)[0] == text


def test_the_table_counts_exact_runs_apart():
    rows = [ROW, replace(ROW, seed=1, turn=radians(2.0)), replace(ROW, seed=2, status="failed")]
    (row,) = table_of(rows)
    assert (row["charging"], row["exact"]) == ("2/3", "1/3")
    assert row["largest turn"] == "2.0 deg"
    assert len(DOCKING.report(rows)) == 3  # heads, the robot, a failure


def test_a_crash_is_a_row(tmp_path):
    row = DockingRow.crashed(RobotEntry("scout", 5, Options(tmp_path)).key, "out of memory")
    assert (row.key, row.success) == (("scout", 5), False)


def test_a_run_docks_exactly(tmp_path):
    (entry,) = entries_of(Options(tmp_path, robots=("scout",)))
    row = DOCKING.row(entry, tmp_path)
    assert row.success and row.contacts == 0, row.cause
    assert row.error < 0.01 and row.turn < radians(1.5)
