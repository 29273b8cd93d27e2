"""A run that crashes or hangs is a row of its table; the other runs are made all the same."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from time import process_time

import pytest

from missions.bench.bench import PASSED, Bench, Options, Row
from missions.bench.goal_runs import Case, Entry, Rules, Setup
from missions.bench.processes import ProcessEnded, results
from missions.bench.run_table import fill
from missions.bench.trial import run_trial
from missions.execution.resources import WORLDS
from missions.inspection.component_scaffold import new_component
from missions.sweeps.design import RunDescription
from missions.sweeps.sweep import Sweep
from missions.sweeps.worker import RunMaker, SweepInputs
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world


@dataclass(frozen=True)
class Division:
    """An entry: 12 is divided by its number."""

    by: int

    label = "division"

    @property
    def key(self):
        return "12", self.by


@dataclass(frozen=True)
class Quotient(Row):
    dividend: str
    by: int
    status: str
    cause: str
    text: str = ""
    wall_seconds: float = 0.0


def divide(entry: Division, picture: Path) -> Quotient:
    if entry.by == 7:
        raise InputError("no sevens")
    if entry.by == 9:
        os.kill(os.getpid(), signal.SIGKILL)
    if entry.by == 11:
        os._exit(3)
    if entry.by == 13:
        signal.pause()
    return Quotient(*entry.key, PASSED, "", str(12 // entry.by))


def nothing(_):
    return []


BENCH = Bench(Quotient, nothing, divide, nothing, nothing)


def filled(numbers, options):
    return fill(BENCH, [Division(by) for by in numbers], options, lambda _: None)


def test_a_crash_is_a_row_with_file_and_line(tmp_path, capsys):
    rows = filled((3, 0, 4), Options(tmp_path))
    assert [row.text for row in rows][::2] == ["4", "3"]
    assert rows[1].cause.startswith(
        "ZeroDivisionError: integer division or modulo by zero (test_cra"
    )
    stored = [json.loads(line) for line in (tmp_path / "runs.jsonl").read_text().splitlines()]
    assert [row["by"] for row in stored] == [3, 0, 4]
    assert "the run ('12', 0) crashed\nTraceback" in capsys.readouterr().err


def test_wrong_input_ends_the_table(tmp_path):
    with pytest.raises(InputError, match="no sevens"):
        filled((3, 7, 4), Options(tmp_path))


def test_a_row_without_one_of_its_figures_is_no_row_of_the_table(tmp_path):
    filled((3,), Options(tmp_path))
    table = tmp_path / "runs.jsonl"
    table.write_text(table.read_text("utf-8").replace('"text": "4", ', ""), "utf-8")
    with pytest.raises(InputError, match=r"not a row of this table: missing: text"):
        filled((3,), Options(tmp_path))


@pytest.fixture
def faulty(tmp_path):
    """A mission whose estimator raises an exception in the first step."""
    file, _ = new_component("estimator", "faulty", tmp_path / "plugins")
    text = file.read_text()
    at = text.index("    def update(")
    at = text.index('"""', text.index('"""', at) + 3) + 3
    file.write_text(f"{text[:at]}\n        raise KeyError('inside')\n{text[at:]}")
    mission = tmp_path / "faulty.yaml"
    mission.write_text(
        "mission: faulty\nrobot: scout\nworld: small_room\nplugins: [./plugins]\n"
        "localisation: faulty\nplaces: {goal: [5, 1, 0]}\nrun: {navigate_to_pose: $goal}\n"
    )
    return mission


def test_a_failing_plugin_has_a_row(faulty, tmp_path):
    case = Case("room", read_world(WORLDS / "small_room.yaml"))
    row = run_trial(Entry(Setup(str(faulty), Rules(0.3, 60.0)), case, 0), tmp_path / "a.png")
    assert row.status == "gave_up" and "KeyError: 'inside' (faulty.py:" in row.cause
    make = RunMaker(SweepInputs(Sweep(str(faulty), 1, "random", keep="none"), tmp_path / "runs"))
    run = make(RunDescription(0, 0))
    assert run.outcome == "crashed" and "KeyError: 'inside' (faulty.py:" in run.reason


def test_a_crash_outside_the_loop_is_a_row_too(faulty, tmp_path, monkeypatch, capsys):
    def broken(*_):
        raise RuntimeError("no figures")

    monkeypatch.setattr("missions.sweeps.worker._shortest", broken)
    sweep = Sweep(str(faulty), 1, "random")
    make = RunMaker(SweepInputs(sweep, tmp_path / "runs", measures_driving=True))
    run = make(RunDescription(0, 3))
    assert (run.outcome, run.seed, run.is_success) == ("crashed", 3, False)
    assert run.reason.startswith("RuntimeError: no figures")
    assert "crashed\nTraceback" in capsys.readouterr().err


def test_an_entry_is_taken_after_the_results_so_far():
    """Each entry of these follows from the result before."""
    seen: list[float] = []

    def entries():
        yield 0.0
        while len(seen) < 4:
            yield seen[-1] - 0.001

    for _, result in results(starting, entries(), 1, 9):
        seen.append(result)
    assert seen == pytest.approx([0.0, -0.001, -0.002, -0.003])


def test_a_process_that_dies_loses_only_its_own_run(tmp_path):
    rows = filled((1, 9, 2, 11, 3, 4), Options(tmp_path, jobs=2))
    assert [row.text or row.cause for row in rows] == [
        "12", "the process was ended by SIGKILL", "6", "the process ended with exit code 3",
        "4", "3",
    ]  # fmt: skip


def test_a_process_that_hangs_is_ended_and_reported(tmp_path, monkeypatch):
    """With a bound of no time at all, so that the test does not depend on the machine."""
    monkeypatch.setattr("missions.bench.processes.LONGEST_RUN", 0.0)
    rows = filled((13, 13, 13, 1), Options(tmp_path, jobs=2))
    assert {row.cause for row in rows} == {"hung: no progress for 0 s"}
    assert not any(process.is_alive() for process in multiprocessing.active_children())


def starting(alive):
    """Entries are seconds that a run computes; those above 0 are alive meanwhile."""

    def make(seconds):
        began = process_time()
        while process_time() - began < abs(seconds):
            if seconds > 0.0:
                alive()
        return seconds

    return make


@pytest.mark.slow
def test_a_run_that_makes_progress_does_not_hang_however_long_it_takes():
    made = dict(results(starting, (5.0, -5.0), 2, 9, silence=3.0))
    assert made[5.0] == 5.0
    assert made[-5.0] == ProcessEnded("hung: no progress for 3 s", hung=True)


def test_time_in_which_the_command_was_suspended_does_not_count(monkeypatch):
    """Each look at the clock finds it seven minutes later; the process starts meanwhile."""
    minutes = count(step=420.0)
    monkeypatch.setattr("missions.bench.processes.POLL_PERIOD", 0.05)
    monkeypatch.setattr("missions.bench.processes.perf_counter", lambda: next(minutes))
    assert list(results(starting, (0.0,), 1, 9, silence=300.0)) == [(0.0, 0.0)]


def test_wrong_input_ends_a_table_that_several_processes_fill(tmp_path):
    with pytest.raises(InputError, match="no sevens"):
        filled((1, 7, 2), Options(tmp_path, jobs=2))


def test_a_run_that_hangs_in_the_command_itself_ends_it_with_a_traceback():
    script = (
        "import signal, missions.bench.processes as p\n"
        "p.LONGEST_RUN = 0.1\n"
        "with p.bounded(): signal.pause()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 1 and "Timeout" in done.stderr and "line 3" in done.stderr
