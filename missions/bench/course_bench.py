"""Benchmark of narrow passages: its runs and its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from missions.bench.courses import COURSES, Course
from missions.bench.layout import write_world
from missions.bench.reporting import FIGURES, failures, figures
from missions.bench.runs import Entry, Rules, Setup, TrialRow, with_controller
from missions.execution.prepare import RunOptions
from missions.execution.resources import MISSIONS, load_robot
from stack.errors import InputError
from stack.parameters import suggestion

RULES = Rules(goal_radius=0.3, time_limit=120.0, by_mission=True)

ROBOTS = ("scout", "jackal")


@dataclass(frozen=True)
class CourseOptions:
    """Courses, robots and controllers of a benchmark.

    Attributes:
        worlds: folder for the generated world files.
        courses: names of courses; empty for all.
        robots: names or files of robots.
        controllers: names of controllers; empty for the default.
        trials: runs per course.
    """

    worlds: Path
    courses: tuple[str, ...] = ()
    robots: tuple[str, ...] = ROBOTS
    controllers: tuple[str, ...] = ()
    trials: int = 20


def course_entries(options: CourseOptions) -> list[Entry]:
    """Return the runs of every robot, controller, course and trial.

    Raises:
        InputError: unknown course or robot.
    """
    return [
        entry
        for robot in options.robots
        for controller in options.controllers or (None,)
        for name in options.courses or COURSES
        for entry in _entries(_course(name), robot, controller, options)
    ]


def report(runs: Sequence[TrialRow]) -> list[str]:
    """Return a line per setup and course, and one per failure."""
    lines = [f"{'setup':<36}{'course':<10}  passed{FIGURES}"]
    for setup, world in dict.fromkeys((run.setup, run.world) for run in runs):
        own = [run for run in runs if (run.setup, run.world) == (setup, world)]
        passed = f"{sum(run.success for run in own)}/{len(own)}"
        lines.append(f"{setup:<36}{world:<10}  {passed:<6}{figures(own)}")
    return lines + failures(runs)


def _course(name: str) -> Course:
    if name not in COURSES:
        raise InputError(f"no course {name!r}; {suggestion(name, [*COURSES])}")
    return COURSES[name]


def _entries(
    course: Course, robot: str, controller: str | None, options: CourseOptions
) -> list[Entry]:
    mission = "course.yaml" if course.mapped else "course_unmapped.yaml"
    options_of_runs = RunOptions(robot=robot, parameters=with_controller(controller, {}))
    setup = Setup(str(MISSIONS / "bench" / mission), RULES, options_of_runs)
    description = load_robot(robot, Path.cwd())
    folder = options.worlds / description.name
    return [
        Entry(setup, write_world(
            course.text(description, trial), course.name, folder / f"{course.name}_{trial}.yaml"
        ), trial)
        for trial in range(options.trials)
    ]  # fmt: skip
