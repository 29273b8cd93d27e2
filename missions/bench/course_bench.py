"""Benchmark of narrow passages: its runs and its table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from missions.bench.bench import CAUSES, Bench, Options, Rows, groups
from missions.bench.courses import COURSES, Course
from missions.bench.goal_runs import Entry, Rules, Setup, TrialRow, with_controller
from missions.bench.layout import write_world
from missions.bench.trial import run_trial, settings_of
from missions.execution.prepare import RunOptions
from missions.execution.resources import MISSIONS, load_robot
from stack.errors import InputError
from stack.parameters import suggestion

RULES = Rules(goal_radius=0.3, time_limit=120.0, by_mission=True)

STATUSES = ("contact", "struck", "timeout", "gave_up")
"""Of runs that failed."""


def entries_of(options: Options) -> list[Entry]:
    """Return the runs of every robot, controller, course and trial.

    Raises:
        InputError: unknown course or robot.
    """
    return [
        entry
        for robot in options.robots
        for controller in options.controllers or (None,)
        for name in options.names or COURSES
        for entry in _entries(_course(name), robot, controller, options)
    ]


def table_of(runs: Sequence[TrialRow]) -> Rows:
    """Return a row for each setup and course."""
    return [
        {"setup": setup, "course": course, **figures(group.rows)}
        for (setup, course), group in groups(runs, lambda run: (run.setup, run.world)).items()
    ]


def figures(runs: Sequence[TrialRow]) -> dict[str, Any]:
    """Return medians of the successful runs, their least clearance, and the ends of the others."""
    good = [run for run in runs if run.success]
    count = Counter(run.status for run in runs)
    return {
        "success": f"{len(good)}/{len(runs)}",
        "time s": median(run.time for run in good) if good else None,
        "driven / shortest": (
            median(run.driven / run.path_length for run in good) if good else None
        ),
        "clearance cm": min((100 * run.clearance for run in good), default=None),
        **{status: count[status] for status in STATUSES},
        CAUSES: "; ".join(
            f"{_which(run)}: {run.status}: {run.cause}" for run in runs if not run.success
        ),
    }


def _which(run: TrialRow) -> str:
    return f"world {run.world}" if run.world.isdecimal() else f"trial {run.trial}"


def _course(name: str) -> Course:
    if name not in COURSES:
        raise InputError(f"no course {name!r}; {suggestion(name, [*COURSES])}")
    return COURSES[name]


def _entries(course: Course, robot: str, controller: str | None, options: Options) -> list[Entry]:
    mission = "course.yaml" if course.mapped else "course_unmapped.yaml"
    options_of_runs = RunOptions(robot=robot, parameters=with_controller(controller, {}))
    setup = Setup(str(MISSIONS / "bench" / mission), RULES, options_of_runs)
    description = load_robot(robot, Path.cwd())
    folder = options.worlds / description.name
    return [
        Entry(setup, write_world(
            course.text(description, trial), course.name, folder / f"{course.name}_{trial}.yaml"
        ), trial)
        for trial in options.seeds
    ]  # fmt: skip


COURSE_BENCH = Bench(TrialRow, entries_of, run_trial, settings_of, table_of)
