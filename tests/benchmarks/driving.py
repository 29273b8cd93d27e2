"""Driving quality: narrow passages, BARN and moving cylinders, as `treepilot bench` drives them."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import mean, median

from missions.bench.barn import barn_entries
from missions.bench.barn_score import K_BEFORE, K_SINCE_2024, RULES, score_of
from missions.bench.course_bench import CourseOptions, course_entries
from missions.bench.dyna_bench import dyna_entries, dyna_setups
from missions.bench.people.flats import MODELS
from missions.bench.people.scenes import scene_names
from missions.bench.people.table import (
    flat_entries,
    measured,
    rows_of,
    scene_entries,
    scene_rows,
)
from missions.bench.perception.docking_runs import docking_entries
from missions.bench.perception.docking_runs import measured as docking_runs
from missions.bench.perception.docking_runs import rows_of as docking_rows
from missions.bench.perception.follow_runs import follow_entries
from missions.bench.perception.follow_runs import measured as follow_runs
from missions.bench.perception.follow_runs import rows_of as follow_rows
from missions.bench.perception.line_runs import line_entries
from missions.bench.perception.line_runs import measured as line_runs
from missions.bench.perception.line_runs import rows_of as line_rows
from missions.bench.runs import Entry, Setup, TrialRow
from missions.bench.table import TableOptions, fill_table
from missions.execution.prepare import RunOptions
from missions.execution.resources import MISSIONS
from tests.benchmarks.table import Rows

FLATS_HELD_OUT = 10040
"""First seed of the flats that are not used for development."""
LINES_HELD_OUT = 9000
"""First seed of the lines, docks and guides that are not used for development."""
FLAT_ROBOTS = ("scout", "jackal", "glide", "buggy")
FAILURES = ("contact", "struck", "timeout", "gave_up")


def course_table(trials: int, options: TableOptions) -> Rows:
    """A row for each robot and passage."""
    entries = course_entries(CourseOptions(options.out / "worlds", trials=trials))
    groups: dict[tuple[str, str, str], list[TrialRow]] = {}
    for entry, run in _driven(entries, options):
        key = (entry.setup.options.robot or "", controller_of(entry), run.world)
        groups.setdefault(key, []).append(run)
    return [
        {"robot": robot, "controller": controller, "course": course, **_row(runs)}
        for (robot, controller, course), runs in groups.items()
    ]


DYNA_TRIALS = 3


def dyna_table(worlds: int, controllers: Sequence[str], options: TableOptions) -> Rows:
    """A row for each controller."""
    entries = dyna_entries(dyna_setups(controllers), worlds, DYNA_TRIALS, options.out / "worlds")
    return _by_controller(_driven(entries, options))


def flat_table(worlds: int, options: TableOptions) -> Rows:
    """A row for each robot and kind of people, in worlds that were not used for development."""
    seeds = range(FLATS_HELD_OUT, FLATS_HELD_OUT + worlds)
    entries = flat_entries(FLAT_ROBOTS, MODELS, seeds, options.out / "worlds", {})
    rows = measured(entries, options, lambda line: print(line, file=sys.stderr))
    return [dict(row) for row in rows_of(rows)]


def people_table(seeds: int, options: TableOptions) -> Rows:
    """A row for each group of scenes and kind of people, with seeds not used for development."""
    held_out = range(FLATS_HELD_OUT, FLATS_HELD_OUT + seeds)
    entries = scene_entries(
        scene_names((), ()), ("scout",), ("none", "social_force", "unaware"), held_out,
        options.out / "worlds", {},
    )  # fmt: skip
    rows = measured(entries, options, lambda line: print(line, file=sys.stderr))
    return [dict(row) for row in scene_rows(rows)]


def line_table(worlds: int, options: TableOptions) -> Rows:
    """A row for each light, on courses that were not used for development."""
    seeds = range(LINES_HELD_OUT, LINES_HELD_OUT + worlds)
    entries = line_entries(("scout",), seeds, options.out / "worlds", 0.4, {})
    rows = line_runs(entries, options, lambda line: print(line, file=sys.stderr))
    return [dict(row) for row in line_rows(rows)]


def docking_table(starts: int, options: TableOptions) -> Rows:
    """A row for each robot, from starts that were not used for development."""
    seeds = range(LINES_HELD_OUT, LINES_HELD_OUT + starts)
    entries = docking_entries(("scout", "jackal"), seeds, options.out / "worlds", {})
    rows = docking_runs(entries, options, lambda line: print(line, file=sys.stderr))
    return [dict(row) for row in docking_rows(rows)]


def follow_table(seeds: int, options: TableOptions) -> Rows:
    """A row for the robot, with seeds that were not used for development."""
    entries = follow_entries(("scout",), range(LINES_HELD_OUT, LINES_HELD_OUT + seeds), {})
    rows = follow_runs(entries, options, lambda line: print(line, file=sys.stderr))
    return [dict(row) for row in follow_rows(rows)]


def barn_table(worlds: Path, options: TableOptions) -> Rows:
    """A row for the mission as it is, and one with SLAM; one trial in each world."""
    mission = str(MISSIONS / "bench" / "barn.yaml")
    slam = RunOptions(parameters={"localisation.use": "slam"})
    setups = [Setup(mission, RULES), Setup(mission, RULES, slam)]
    return _by_controller(_driven(barn_entries(worlds, setups, 1), options))


def controller_of(entry: Entry) -> str:
    """The controller that drives, also where it is the mission's."""
    plan, _ = entry.setup.plan(entry.case, entry.trial)
    return plan.choices["controller"].name


def localisation_of(entry: Entry) -> str:
    """The estimator of the pose on the map."""
    plan, _ = entry.setup.plan(entry.case, entry.trial)
    return plan.choices["localisation"].name


def _driven(entries: list[Entry], options: TableOptions) -> list[tuple[Entry, TrialRow]]:
    runs = fill_table(entries, options, lambda line: print(line, file=sys.stderr))
    return list(zip(entries, runs, strict=True))


def _by_controller(driven: Sequence[tuple[Entry, TrialRow]]) -> Rows:
    rows = []
    for setup in dict.fromkeys(run.setup for _, run in driven):
        runs = [run for _, run in driven if run.setup == setup]
        first = next(entry for entry, _ in driven if entry.setup.label == setup)
        rows.append({
            "controller": controller_of(first), "localisation": localisation_of(first),
            "worlds": len({run.world for run in runs}),
            "success %": 100 * mean(run.success for run in runs),
            "score k=2": mean(score_of(run, K_SINCE_2024) for run in runs),
            "score k=4": mean(score_of(run, K_BEFORE) for run in runs),
            **_row(runs),
        })  # fmt: skip
    return rows


def _row(runs: Sequence[TrialRow]) -> dict[str, object]:
    """Successes, medians over them, their least clearance, and what became of the others."""
    good = [run for run in runs if run.success]
    count = Counter(run.status for run in runs)
    return {
        "success": f"{len(good)}/{len(runs)}",
        "time s": median(run.time for run in good) if good else None,
        "driven / shortest": (
            median(run.driven / run.path_length for run in good) if good else None
        ),
        "clearance cm": min((100 * run.clearance for run in good), default=None),
        **{status: count[status] for status in FAILURES},
        **_impossible(runs),
        "failed": "; ".join(
            f"{_which(run)}: {run.status}: {run.cause}" for run in runs if not run.success
        ),
    }


def _impossible(runs: Sequence[TrialRow]) -> dict[str, object]:
    """How many runs nobody could have passed, where the oracle can tell."""
    judged = [run for run in runs if run.possible is not None]
    return {"impossible": sum(not run.possible for run in judged)} if judged else {}


def _which(run: TrialRow) -> str:
    return f"world {run.world}" if run.world.isdecimal() else f"trial {run.trial}"
