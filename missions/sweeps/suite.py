"""A suite of faults: many missions, each with each fault and without, as sweeps side by side.

OUT/MISSION/    a sweep with the factor `faults`, like any other
OUT/faults.html the table: missions by faults
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from missions.execution.fit.faults import NONE, SUITE, chosen_faults, fault_files
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import find_mission, mission_files
from missions.sweeps.checking import checked
from missions.sweeps.design import GRID
from missions.sweeps.factors import Factor, listed
from missions.sweeps.row import SUCCESS, TIME_LIMIT, SweepRow
from missions.sweeps.runner import ExecutionSettings, Follow, run_sweep
from missions.sweeps.sweep import FAILURES, FAULTS, Sweep
from missions.sweeps.table import SweepFolder
from robots.bodies import body_kind
from stack.errors import InputError

TIME_LIMIT_S = 300.0
"""Simulated seconds after which a run of a suite has failed."""


@dataclass(frozen=True)
class SuiteSweep:
    """One mission of a suite.

    Attributes:
        sweep: with the factor `faults`: `none` and those that fit.
        unfit: why the others do not fit, by name.
    """

    sweep: Sweep
    unfit: Mapping[str, str]

    @property
    def name(self) -> str:
        """Name of the mission."""
        return Path(self.sweep.mission).stem


@dataclass(frozen=True)
class Suite:
    """Missions and faults.

    Attributes:
        faults: names, `none` not among them.
        sweeps: of the missions.
        left_out: why other missions are not among them, by name.
    """

    faults: tuple[str, ...]
    sweeps: tuple[SuiteSweep, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return sum(one.sweep.runs for one in self.sweeps)


@dataclass(frozen=True)
class Cell:
    """What became of a mission with a fault.

    Attributes:
        rows: its runs; none: not made, or the fault does not fit.
    """

    rows: tuple[SweepRow, ...] = ()

    @property
    def successes(self) -> int:
        """Number of runs that succeeded without a contact."""
        return sum(row.is_success and not row.collisions for row in self.rows)

    @property
    def collisions(self) -> int:
        """Number of runs in which the robot drove into something."""
        return sum(bool(row.collisions) for row in self.rows)

    @property
    def word(self) -> str:
        """`ok`, `collision`, the most frequent other outcome, or nothing without a run."""
        if not self.rows:
            return ""
        if self.collisions:
            return "collision"
        others = [row.outcome for row in self.rows if not row.is_success]
        if not others:
            return "ok"
        return max(sorted(set(others)), key=others.count)


def fault_list(text: str) -> tuple[str, ...]:
    """Return the faults that `--faults` names: `suite`, all shipped files, or names by commas.

    Raises:
        InputError: it names none, or one that does not exist.
    """
    names = [part.strip() for part in text.split(",") if part.strip()]
    found = [name for part in names for name in (fault_files() if part == SUITE else (part,))]
    chosen = tuple(dict.fromkeys(name for name in found if name != NONE))
    if not chosen:
        raise InputError(f"--faults {text}: it names no fault", "write suite, or wet_floor,push")
    for name in chosen:
        chosen_faults(name, None)
    return chosen


def driving_missions() -> list[str]:
    """Return the names of the shipped missions."""
    return [file.stem for file in mission_files()]


@dataclass(frozen=True)
class SuiteOptions:
    """How a suite is run.

    Attributes:
        seeds: runs of each mission with each fault.
        seed: of the first run.
        time_limit: simulated seconds.
        keep: run folders that are kept: all | failures | none.
    """

    seeds: int = 1
    seed: int = 0
    time_limit: float = TIME_LIMIT_S
    keep: str = FAILURES


def plan_suite(missions: Sequence[str], faults: Sequence[str], options: SuiteOptions) -> Suite:
    """Return the suite: of each mission that drives in a simulation, the faults that fit it.

    Args:
        missions: names or files; with none, the shipped ones.
        faults: names of kinds or files.
        options: of the runs.

    Raises:
        InputError: a mission that is named cannot be swept, two have one name, or no fault fits
            any.
    """
    sweeps, left_out = [], {}
    for name in missions or driving_missions():
        try:
            sweeps.append(_sweep(name, faults, options))
        except InputError as error:
            if missions:
                raise
            left_out[name] = str(error)
    names = [one.name for one in sweeps]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two missions are called {twice}: each needs a folder of its name")
    if all(fault in one.unfit for one in sweeps for fault in faults):
        first = next((reason for one in sweeps for reason in one.unfit.values()), "no missions")
        raise InputError(f"no fault fits any of the missions: {first}")
    return Suite(tuple(faults), tuple(sweeps), left_out)


def _sweep(name: str, faults: Sequence[str], options: SuiteOptions) -> SuiteSweep:
    file = find_mission(name)
    plan = prepare(file, RunOptions())
    if plan.recording is not None or not body_kind(plan.robot.body).simulates:
        raise InputError(f"{name}: its robot is not simulated")
    if not plan.robot.drivetrain.moves:
        raise InputError(f"{name}: its robot does not drive")
    unfit = {fault: reason for fault in faults if (reason := _refusal(file, fault))}
    values = [NONE, *(fault for fault in faults if fault not in unfit)]
    sweep = Sweep(
        name, len(values) * options.seeds, GRID, (listed(FAULTS, values),), options.seed,
        time_limit=options.time_limit, keep=options.keep,
    )  # fmt: skip
    return SuiteSweep(sweep, unfit)


def _refusal(mission: Path, fault: str) -> str:
    try:
        prepare(mission, RunOptions(faults=fault))
    except InputError as error:
        return str(error)
    return ""


def run_suite(suite: Suite, out: Path, execution: ExecutionSettings, follow: Follow) -> None:
    """Make the runs that the folder lacks, mission by mission, in the order of the suite.

    Args:
        suite: to run.
        out: folder of its sweeps.
        execution: processes and patience.
        follow: gets all rows of the suite so far.

    Raises:
        InputError: the folder holds something else, or cannot be written.
    """
    before: list[SweepRow] = []
    for one in suite.sweeps:
        ready = checked(one.sweep, _unchanged)
        before += run_sweep(
            ready, SweepFolder(out / one.name), execution, partial(_follow, follow, tuple(before))
        )


def _follow(follow: Follow, before: Sequence[SweepRow], rows: list[SweepRow]) -> None:
    follow([*before, *rows])


def _unchanged(factor: Factor, error: InputError) -> InputError:
    return error


def cells_of(suite: Suite, out: Path) -> dict[tuple[str, str], Cell]:
    """Return the cells of the table by mission and fault, with the runs that are there."""
    return dict(_cells(suite, out))


def _cells(suite: Suite, out: Path) -> Iterator[tuple[tuple[str, str], Cell]]:
    for one in suite.sweeps:
        folder = SweepFolder(out / one.name)
        rows = folder.rows(one.sweep.runs) if folder.is_begun else []
        for fault in (NONE, *suite.faults):
            found = tuple(row for row in rows if row.settings.get(FAULTS) == fault)
            yield (one.name, fault), Cell(found)


MARKS = {"ok": "+", "collision": "X", "failure": "f", TIME_LIMIT: "t", "": "."}
"""Characters of the words in the terminal; others are `!`."""

LEGEND = (
    "+ success  f failure  t time limit  X collision  ! crashed or hung  . does not fit, or not run"
)


def table_lines(suite: Suite, cells: Mapping[tuple[str, str], Cell]) -> Iterator[str]:
    """Yield the table for a terminal: a line a mission, a column a fault, and the rates."""
    names = [NONE, *suite.faults]
    width = max(len(one.name) for one in suite.sweeps)
    yield f"{'':{width}}  " + " ".join(f"{number:>2}" for number in range(len(names)))
    for one in suite.sweeps:
        marks = (MARKS.get(cells[one.name, fault].word, "!") for fault in names)
        yield f"{one.name:{width}}  " + " ".join(f"{mark:>2}" for mark in marks)
    yield LEGEND
    yield ""
    longest = max(map(len, names))
    for number, fault in enumerate(names):
        cell = over_missions(suite, cells, fault)
        if cell.rows:
            rate = f"{cell.successes}/{len(cell.rows)}"
            yield f"{number:>2} {fault:{longest}}  {rate:>7}  collisions {cell.collisions}"


def over_missions(suite: Suite, cells: Mapping[tuple[str, str], Cell], fault: str) -> Cell:
    """Return the runs of all missions with a fault."""
    return Cell(tuple(row for one in suite.sweeps for row in cells[one.name, fault].rows))


def figures(suite: Suite, cells: Mapping[tuple[str, str], Cell]) -> tuple[int, int, int]:
    """Return successes, runs and collisions of all runs with a fault."""
    every = [over_missions(suite, cells, fault) for fault in suite.faults]
    return (
        sum(cell.successes for cell in every), sum(len(cell.rows) for cell in every),
        sum(cell.collisions for cell in every),
    )  # fmt: skip


def reasons(cells: Mapping[tuple[str, str], Cell]) -> Iterator[tuple[str, str, str, str]]:
    """Yield mission, fault, word and reason of what was no success."""
    for (mission, fault), cell in cells.items():
        if cell.word in ("", "ok"):
            continue
        bad = next(row for row in cell.rows if row.outcome != SUCCESS or row.collisions)
        yield mission, fault, cell.word, bad.reason or bad.cause
