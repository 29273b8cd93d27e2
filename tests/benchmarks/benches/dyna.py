"""A field of moving cylinders that do not avoid the robot, faster than its usual speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from missions.bench.bench import Bench, Rows, groups
from missions.bench.course_bench import figures
from missions.bench.goal_runs import Entry, Rules, Setup, TrialRow, goal_of, with_controller
from missions.bench.layout import write_world
from missions.bench.trial import run_trial, settings_of
from missions.execution.prepare import RunOptions
from stack.errors import InputError
from tests.benchmarks.benchmark import FILES, Benchmark, Given, MoreOptions, table
from tests.benchmarks.dyna_worlds import WORLDS, dyna_text
from tests.benchmarks.layouts import Layout
from tests.benchmarks.oracle import Task, judge
from tests.benchmarks.oracle_picture import draw_verdict
from tests.benchmarks.setups import with_choices

FAST: dict[str, dict[str, str]] = {
    "mppi": {
        "controller.cruise_speed": "1.8", "controller.reverse_speed": "0.9",
        "controller.turn_speed": "3.5", "controller.linear_deviation": "0.7",
        "controller.angular_deviation": "1.4", "controller.moving_margin": "1.0",
        "controller.path_align_weight": "5", "controller.path_follow_weight": "3",
    },
    "dwb": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "graceful": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "pure_pursuit": {"controller.cruise_speed": "1.8"},
}  # fmt: skip
"""Parameters for 1.8 m/s by controller: the cylinders are faster than the default of 0.8 m/s. In an
open field, `mppi` needs no path to keep to; it searches widely and keeps farther away."""

MISSION = FILES / "dyna.yaml"
RULES = Rules(goal_radius=1.0, time_limit=100.0)
CONTROLLERS, TRIALS = ("pure_pursuit", "mppi", "dwb"), 3


@dataclass(frozen=True, slots=True)
class JudgedTrial(TrialRow):
    """One row of the table.

    Attributes:
        possible: whether anybody could have reached the goal without a contact, by the oracle; None
            where it cannot tell. oracle_time: seconds, earliest arrival.
    """

    possible: bool | None = None
    oracle_time: float | None = None


def entries_of(options: MoreOptions) -> list[Entry]:
    """Return the runs of every robot, controller, trial and world.

    Given parameters override those of `FAST`.
    """
    setups = [
        Setup(options.mission or str(MISSION), RULES, RunOptions(
            robot=robot,
            parameters=with_controller(name, {**FAST.get(name, {}), **options.parameters}),
        ))
        for robot in options.robots
        for name in options.controllers
    ]  # fmt: skip
    cases = [
        write_world(dyna_text(int(number)), number, options.worlds / f"dyna_{number}.yaml")
        for number in options.names
    ]
    return [
        Entry(setup, case, trial) for setup in setups for trial in options.seeds for case in cases
    ]


def spread(worlds: int) -> tuple[str, ...]:
    """Return the numbers of some worlds, spread evenly over all.

    Raises:
        InputError: more worlds than exist.
    """
    if not 1 <= worlds <= WORLDS:
        raise InputError(f"--worlds {worlds}: expected 1 to {WORLDS}")
    return tuple(str(round(n * (WORLDS - 1) / max(1, worlds - 1))) for n in range(worlds))


def run(entry: Entry, picture: Path) -> JudgedTrial:
    """Make one run, and say whether anybody could have passed.

    A run may stand for the time limit before its clock starts, and then drive for as long.
    """
    row, (plan, _) = run_trial(entry, picture), entry.setup.plan(entry.case, entry.trial)
    goal, rules = goal_of(plan), entry.setup.rules
    task = Task(plan.start, (goal,), rules.goal_radius, 2.0 * rules.time_limit)
    verdict = judge(plan.world, plan.robot, entry.trial, task)
    if verdict is None:
        return JudgedTrial(**asdict(row))
    if not row.success:
        draw_verdict(picture.with_stem(f"{picture.stem}-oracle"), verdict, (goal,))
    return JudgedTrial(**asdict(row), possible=verdict.possible, oracle_time=verdict.time)


def table_of(runs: Sequence[JudgedTrial]) -> Rows:
    """Return a row for each setup."""
    return [
        {
            "setup": setup, **figures(group.rows),
            "impossible": sum(run.possible is False for run in group.rows),
        }
        for setup, group in groups(runs, lambda run: run.setup).items()
    ]  # fmt: skip


DYNA = Bench(JudgedTrial, entries_of, run, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for each controller."""
    options = given.options(
        "dyna", range(given.repeats or TRIALS), names=spread(given["worlds"]),
        robots=("jackal",), controllers=CONTROLLERS,
    )  # fmt: skip
    return with_choices(table(DYNA, options), entries_of(options))


LAYOUT = Layout({
    "controller": "{controller}", "reached": "{success}", "drove into": "{contact}",
    "was struck": "{struck}", "timeout": "{timeout}", "gave up": "{gave_up}",
    "median time": "{time s:.1f} s",
}, added={"nobody could pass": "{impossible}"})  # fmt: skip
BENCHMARKS = {
    "dyna": Benchmark(
        "Across a field of moving cylinders", measure, ("worlds",),
        {"recording": "off", "trials": TRIALS}, LAYOUT,
    )
}  # fmt: skip
