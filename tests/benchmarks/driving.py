"""Driving health: narrow passages and a field of moving cylinders, a small share of the benches.

`treepilot bench courses` and `treepilot bench dyna` measure all of it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from missions.bench.course_bench import CourseOptions, course_entries
from missions.bench.dyna_bench import dyna_entries, dyna_setups
from missions.bench.reporting import short
from missions.bench.runs import Entry, Run
from missions.bench.table import TableOptions, fill_table
from tests.benchmarks.table import Rows


def course_table(trials: int, jobs: int) -> Rows:
    """A row for each passage and robot."""
    with tempfile.TemporaryDirectory() as folder:
        options = CourseOptions(Path(folder) / "worlds", trials=trials)
        runs = _filled(course_entries(options), Path(folder), jobs)
    keys = dict.fromkeys((run.setup, run.world) for run in runs)
    return [
        {"course": world, **_row(setup, [run for run in runs if (run.setup, run.world) == key])}
        for key in keys
        for setup, world in [key]
    ]


def dyna_table(worlds: int, jobs: int) -> Rows:
    """A row for each controller."""
    with tempfile.TemporaryDirectory() as folder:
        setups = dyna_setups(("pure_pursuit", "mppi", "dwb"))
        runs = _filled(dyna_entries(setups, worlds, 1, Path(folder) / "worlds"), Path(folder), jobs)
    rows = []
    for setup in dict.fromkeys(run.setup for run in runs):
        own = [run for run in runs if run.setup == setup]
        kinds = {"drove into": "contact", "was struck": "struck", "late": "timeout"}
        count = {word: sum(run.status == kind for run in own) for word, kind in kinds.items()}
        rows.append({**_row(setup, own), **count})
    return rows


def _filled(entries: list[Entry], out: Path, jobs: int) -> list[Run]:
    return fill_table(entries, TableOptions(out, jobs), lambda line: None)


def _row(setup: str, runs: Sequence[Run]) -> dict[str, object]:
    good = [run for run in runs if run.success]
    return {
        "setup": short(setup),
        "passed": f"{len(good)}/{len(runs)}",
        "time s": median(run.time for run in good) if good else None,
        "way / shortest": median(run.driven / run.path_length for run in good) if good else None,
        "clearance m": min((run.clearance for run in good), default=None),
    }
