"""`treepilot bench missions`: a sweep over missions and seeds, and its table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import mean, median
from typing import Any

from missions.bench.bench import CAUSES, Options, Rows, table_lines
from missions.execution.resources import mission_files
from missions.sweeps.checking import checked
from missions.sweeps.design import GRID
from missions.sweeps.factors import listed
from missions.sweeps.row import CRASHED, HUNG, KILLED, SweepRow
from missions.sweeps.runner import ExecutionSettings, Follow, run_sweep
from missions.sweeps.sweep import MISSION, Sweep
from missions.sweeps.sweep_file import EMPTY
from missions.sweeps.table import SweepFolder

TIME_LIMIT = 7200.0
"""Simulated seconds; the longest of the shipped missions takes about two minutes."""

WAITING = ("44_ground_station",)
"""Shipped missions that wait for hours for somebody to command them: not run without a name."""


def sweep_of(options: Options) -> Sweep:
    """Return the sweep over missions and seeds: each mission meets the same seeds.

    Raises:
        InputError: a mission is given twice.
    """
    shipped = (file.stem for file in mission_files() if file.stem not in WAITING)
    factor = listed(MISSION, options.names or tuple(shipped))
    (robot,) = options.robots or (None,)
    return Sweep(
        factor.values[0], len(factor.values) * len(options.seeds), GRID, (factor,),
        options.seeds.start, parameters=dict(options.parameters), robot=robot,
        time_limit=TIME_LIMIT,
    )  # fmt: skip


def measured(
    options: Options, follow: Follow = lambda _: None, check: Callable[[], None] = lambda: None
) -> list[SweepRow]:
    """Make the runs that the folder lacks; return all rows.

    Args:
        options: of the bench.
        follow: gets all rows so far.
        check: called at times; raises KeyboardInterrupt to end the bench.

    Raises:
        InputError: a mission or an option has errors, or the folder has another sweep.
    """
    ready = checked(sweep_of(options), EMPTY.refusal)
    execution = ExecutionSettings(options.jobs, check=check)
    return run_sweep(ready, SweepFolder(options.out), execution, follow)


def table_of(rows: Sequence[SweepRow]) -> Rows:
    """Return one row per mission: successes, medians of time and distance, sums, worst values."""
    names = dict.fromkeys(row.settings[MISSION] for row in rows)
    return [
        _table_row(Path(name).stem, [row for row in rows if row.settings[MISSION] == name])
        for name in names
    ]


def report_lines(rows: Sequence[SweepRow]) -> list[str]:
    """Return the table as lines, and a line per run that failed."""
    failures = [
        f"  {Path(row.settings[MISSION]).stem} seed {row.seed}: {row.outcome}: {row.reason}"
        for row in rows if not row.is_success
    ]  # fmt: skip
    return table_lines(table_of(rows)) + failures


def _table_row(name: str, rows: Sequence[SweepRow]) -> dict[str, Any]:
    over = [row for row in rows if row.outcome not in (CRASHED, HUNG, KILLED)] or rows
    errors = [row.error_mean or 0.0 for row in over]
    return {
        "mission": name,
        "success": f"{sum(row.is_success for row in rows)}/{len(rows)}",
        "collisions": sum(row.collisions or 0 for row in over),
        "pushed into": sum(row.pushed_into or 0 for row in over),
        "time s": median(row.seconds or 0.0 for row in over),
        "distance m": median(row.distance or 0.0 for row in over),
        "clearance m": min(1.0 if row.clearance is None else row.clearance for row in over),
        "error mean m": mean(errors),
        "error max m": max(row.error_max or 0.0 for row in over),
        "recoveries": sum(row.recoveries or 0 for row in over),
        "x real time": median(row.real_time_factor or 0.0 for row in over),
        CAUSES: "; ".join(f"{row.seed}: {row.reason}" for row in rows if not row.is_success),
    }
