"""BARN: unknown narrow worlds, scored as in the BARN Challenge (ICRA 2022 to 2025).

D. Perille, A. Truong, X. Xiao, P. Stone, "Benchmarking Metric Ground Navigation", SSRR 2020.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import mean

from missions.bench.bench import Bench, Rows, groups
from missions.bench.course_bench import figures
from missions.bench.goal_runs import Case, Entry, Rules, Setup, TrialRow, with_controller
from missions.bench.trial import run_trial, settings_of
from missions.execution.prepare import RunOptions
from stack.errors import InputError
from tests.benchmarks.barn_worlds import find_worlds
from tests.benchmarks.benchmark import FILES, Benchmark, Given, MoreOptions, table
from tests.benchmarks.layouts import Layout
from tests.benchmarks.setups import with_choices

MISSION = FILES / "barn.yaml"
RULES = Rules(goal_radius=1.0, time_limit=100.0)

SPEED = 2.0
"""Speed that defines the optimal time of a path, m/s."""

K_SINCE_2024, K_BEFORE = 2.0, 4.0
"""Factor k of the score since 2024, and before."""

SLAM = {"localisation.use": "slam"}


def score(success: bool, seconds: float, path_length: float, k: float) -> float:
    """Return success · OT / clip(AT, k·OT, 8·OT) with OT = path length / 2 m/s; at most 1 / k.

    Args:
        success: whether the goal was reached in time without a contact.
        seconds: actual time AT, on the run's clock.
        path_length: length of the optimal path, metres.
        k: multiple of the optimal time up to which the score is highest.
    """
    if not success:
        return 0.0
    optimal = path_length / SPEED
    return optimal / min(max(seconds, k * optimal), 8.0 * optimal)


def score_of(run: TrialRow, k: float) -> float:
    """Return the score of a run."""
    return score(run.success, run.time, run.path_length, k)


def entries_of(options: MoreOptions) -> list[Entry]:
    """Return the runs of every controller, trial and world.

    Raises:
        InputError: there are no worlds, or a name is unknown.
    """
    mission = options.mission or str(MISSION)
    arguments = dict(options.arguments)
    setups = [
        Setup(mission, RULES, RunOptions(
            arguments=arguments, parameters=with_controller(name, options.parameters)
        ))
        for name in options.controllers or (None,)
    ]  # fmt: skip
    (worlds,) = options.files
    cases = _selected(find_worlds(worlds), options.names)
    return [
        Entry(setup, case, trial) for setup in setups for trial in options.seeds for case in cases
    ]


def _selected(cases: list[Case], only: tuple[str, ...]) -> list[Case]:
    unknown = [name for name in only if name not in {case.name for case in cases}]
    if unknown:
        raise InputError(f"--only: no world {unknown[0]!r} among the {len(cases)} worlds")
    return [case for case in cases if not only or case.name in only]


def table_of(runs: Sequence[TrialRow]) -> Rows:
    """Return a row for each setup."""
    return [
        {
            "setup": setup, "worlds": len({run.world for run in group.rows}),
            "success %": 100 * mean(run.success for run in group.rows),
            "score k=2": mean(score_of(run, K_SINCE_2024) for run in group.rows),
            "score k=4": mean(score_of(run, K_BEFORE) for run in group.rows),
            **figures(group.rows),
        }
        for setup, group in groups(runs, lambda run: run.setup).items()
    ]  # fmt: skip


BARN = Bench(TrialRow, entries_of, run_trial, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for the mission as it is, and one with SLAM."""
    seeds = range(given.repeats or 1)
    chosen = given.options("barn", seeds, files=(given.barn,) if given.barn else ())
    both = [chosen] if chosen.parameters else [chosen, replace(chosen, parameters=SLAM)]
    return [
        row for options in both for row in with_choices(table(BARN, options), entries_of(options))
    ]


LAYOUT = Layout(
    {
        "controller": "{controller}", "localisation": "{localisation}", "worlds": "{worlds}",
        "success": "{success %:.1f} %",
        "score, k = 2": "{score k=2:.3f}", "score, k = 4": "{score k=4:.3f}",
        "median time": "{time s:.1f} s", "least clearance": "{clearance cm:.1f} cm",
    },
    failed="{controller}",
)  # fmt: skip
BENCHMARKS = {
    "barn": Benchmark("BARN", measure, ("barn",), {"recording": "off", "trials": 1}, LAYOUT)
}
