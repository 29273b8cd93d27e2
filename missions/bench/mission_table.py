"""Benchmark of missions over seeds: its runs and its table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import mean, median
from typing import Any

from missions.bench.mission_runs import MISSION_WORK, QUIET, MissionEntry, MissionRun, conditions
from missions.bench.resumable import TableOptions, fill, record_settings
from missions.bench.runs import CRASHED
from missions.execution.prepare import prepare
from missions.execution.resources import mission_files
from stack.errors import InputError

TIME_LIMIT = 7200.0
"""Simulated seconds; the longest of the shipped missions takes about two minutes."""

FAILED = "failed"


def mission_entries(
    names: Sequence[str], seeds: int, robot: str | None = None
) -> list[MissionEntry]:
    """Return the runs of every mission and seed.

    Args:
        names: names or paths of missions; empty for all shipped ones.
        seeds: runs per mission.
        robot: replaces the robot of the missions.

    Raises:
        InputError: two missions have the same name.
    """
    chosen = names or [file.stem for file in mission_files()]
    stems = [Path(name).stem for name in chosen]
    for stem in stems:
        if stems.count(stem) > 1:
            raise InputError(f"{stem} is given {stems.count(stem)} times; use unique mission names")
    return [
        MissionEntry(name, TIME_LIMIT, replace(QUIET, seed=seed, robot=robot))
        for name in chosen
        for seed in range(seeds)
    ]


def measured(
    entries: Sequence[MissionEntry], options: TableOptions, log: Callable[[str], None]
) -> list[MissionRun]:
    """Make the runs that are missing in the table; return all, in the order of the entries.

    Raises:
        InputError: a mission has errors, or the folder has results of other settings.
    """
    first = {entry.key[0]: entry for entry in reversed(entries)}
    record_settings(options.out, {
        name: conditions(entry, prepare(entry.mission, entry.options))
        for name, entry in first.items()
    })  # fmt: skip
    return fill(entries, options, MISSION_WORK, log)


def rows_of(runs: Sequence[MissionRun]) -> list[dict[str, Any]]:
    """Return one row per mission: successes, medians of time and distance, sums, worst values."""
    names = dict.fromkeys(run.mission for run in runs)
    return [_row(name, [run for run in runs if run.mission == name]) for name in names]


def table_lines(runs: Sequence[MissionRun]) -> Iterator[str]:
    """Yield the table, then a line per failure."""
    rows = rows_of(runs)
    columns = [name for name in rows[0] if name != FAILED]
    cells = [columns, *([_text(row[name]) for name in columns] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for line in cells:
        padded = (f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
        yield "  ".join(padded).rstrip()
    for run in runs:
        if not run.success:
            yield f"  {run.mission} seed {run.seed}: {run.status}: {run.cause}"


def _row(name: str, runs: Sequence[MissionRun]) -> dict[str, Any]:
    driven = [run for run in runs if run.status != CRASHED] or runs
    return {
        "mission": name,
        "success": f"{sum(run.success for run in runs)}/{len(runs)}",
        "collisions": sum(run.collisions for run in driven),
        "pushed into": sum(run.pushed_into for run in driven),
        "time s": median(run.time for run in driven),
        "distance m": median(run.driven for run in driven),
        "clearance m": min(run.clearance for run in driven),
        "error mean m": mean(run.localisation_error[0] for run in driven),
        "error max m": max(run.localisation_error[1] for run in driven),
        "recoveries": sum(run.recoveries for run in driven),
        "x real time": median(run.real_time_factor for run in driven),
        FAILED: "; ".join(f"{run.seed}: {run.cause}" for run in runs if not run.success),
    }


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 0.1 else f"{value:.2f}"
    return str(value)
