"""The benches of `treepilot bench`, with the figures of the documentation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from missions.bench.bench import Bench, Rows
from missions.bench.course_bench import COURSE_BENCH
from missions.bench.flats import entries_of, table_of
from missions.bench.people_runs import MODELS, settings_of
from missions.execution.fit.faults import SUITE
from missions.sweeps.mission_table import measured as measured_missions
from missions.sweeps.mission_table import table_of as table_of_missions
from missions.sweeps.runner import ExecutionSettings
from missions.sweeps.suite import (
    Suite,
    SuiteOptions,
    cells_of,
    fault_list,
    plan_suite,
    run_suite,
)
from missions.sweeps.sweep import FAULTS
from tests.benchmarks.benchmark import Benchmark, Given, table
from tests.benchmarks.judged import JudgedRow, impossible, run_judged
from tests.benchmarks.layouts import NONE, Layout
from tests.benchmarks.setups import with_choices

FIRST_SEED = 10040
"""First seed of the flats and meetings that are not used for development."""

OFF: dict[str, str | int] = {"recording": "off"}


def course_table(given: Given) -> Rows:
    """Return a row for each robot and passage."""
    options = given.options("courses", range(given["trials"]), robots=("scout", "jackal"))
    return with_choices(table(COURSE_BENCH, options), COURSE_BENCH.entries(options))


def mission_table(given: Given) -> Rows:
    """Return a row for each shipped mission, without the speed: the processes share the cores."""
    runs = measured_missions(given.options("missions", range(given["seeds"])))
    rows = table_of_missions(runs)
    return [{name: row[name] for name in row if name != "x real time"} for row in rows]


def fault_table(given: Given) -> Rows:
    """Return a row for each shipped mission that drives, with each fault that fits it."""
    options = given.options("faults")
    suite = plan_suite(options.names, fault_list(SUITE), SuiteOptions())
    run_suite(suite, options.out, ExecutionSettings(options.jobs), lambda _: None)
    return suite_rows(suite, options.out)


def suite_rows(suite: Suite, out: Path) -> Rows:
    """Return the rows of a suite whose runs are in a folder, and one of their sums."""
    cells = cells_of(suite, out)
    rows: Rows = []
    for one in suite.sweeps:
        runs = [row for fault in suite.faults for row in cells[one.name, fault].rows]
        ended = [
            f"`{row.settings[FAULTS]}`: {row.code or row.outcome}"
            for row in runs if not row.is_success
        ]  # fmt: skip
        rows.append({
            "mission": f"`{one.name}`", "successes": sum(row.is_success for row in runs),
            "runs": len(runs), "collisions": sum(bool(row.collisions) for row in runs),
            "ended": ", ".join(ended) or NONE,
        })  # fmt: skip
    sums = {name: sum(row[name] for row in rows) for name in ("successes", "runs", "collisions")}
    return [*rows, {"mission": "all", **sums, "ended": ""}]


def judged_table(runs: Sequence[JudgedRow]) -> Rows:
    """Return the table of `treepilot bench flats` with the number of impossible runs."""
    return [
        {**row, "impossible": impossible([
            run for run in runs
            if run.people == row["people"] and row["robot"] in (run.robot, "all")
        ])}
        for row in table_of(runs)
    ]  # fmt: skip


JUDGED_FLATS = Bench(JudgedRow, entries_of, run_judged, settings_of, judged_table)


def flat_table(given: Given) -> Rows:
    """Return a row for each robot and kind of people, with seeds held out."""
    return table(JUDGED_FLATS, given.options(
        "flats", given.seeds(FIRST_SEED, given["worlds"]),
        robots=("scout", "jackal", "glide", "buggy"), people=MODELS,
    ))  # fmt: skip


BENCHMARKS = {
    "courses": Benchmark(
        "Narrow passages, default parameters", course_table, ("trials",), OFF, Layout(
    {
        "robot": "{robot}", "course": "`{course}`", "passed": "{success}",
        "median time": "{time s:.1f} s", "driven / shortest": "{driven / shortest:.2f}",
        "least clearance": "{clearance cm:.1f} cm",
    },
    failed="{robot}, `{course}`",
),
    ),
    "missions": Benchmark("Missions over seeds", mission_table, ("seeds",), OFF, Layout(
    {
        "mission": "{mission}", "success": "{success}", "contacts": "{collisions}",
        "pushed into": "{pushed into}", "median time": "{time s:.1f} s",
        "median distance": "{distance m:.1f} m", "least clearance": "{clearance m:.2f} m",
        "mean pose error": "{error mean m:.3f} m", "largest": "{error max m:.2f} m",
        "recoveries": "{recoveries}",
    },
    failed="{mission}",
)),
    "faults": Benchmark(
        "Shipped missions with each fault", fault_table, (), {**OFF, "first seed": 0, "seeds": 1},
        Layout({
    "mission": "{mission}", "with faults": "{successes} of {runs}",
    "without success": "{ended}", "collisions": "{collisions}",
}),
    ),
    "flats": Benchmark(
        "Random flats with people", flat_table, ("worlds",), {**OFF, "first seed": FIRST_SEED},
        Layout({
    "people": "{people}", "robot": "{robot}", "all four goals": "{all goals}",
    "95 %": "{95 % interval}", "goals": "{goals}", "false": "{false}",
    "drove into": "{drove into}", "struck moving": "{struck moving}",
    "struck standing": "{struck standing}", "things": "{things}", "time": "{time}",
    "way": "{way}", "standoffs": "{standoffs}", "within 0.45 m": "{intimate}",
    "least distance": "{least distance}",
}, added={"nobody could pass": "{impossible}"}),
    ),
}  # fmt: skip
