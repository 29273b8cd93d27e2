"""Whole missions over seeds: runs, for `bench missions` and `tune`, and their table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import mean, median
from typing import Any

from missions.bench.bench import CAUSES, CRASHED, Bench, Options, Row, Rows, groups
from missions.bench.conditions import conditions, world_of
from missions.bench.drive_recorder import DriveRecorder
from missions.bench.shortest_path import shortest_path_lengths
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.resources import mission_files
from missions.execution.running import execute
from stack.errors import InputError, NavigationError
from stack.telemetry.records import MissionState
from stack.types import Pose2D

TIMEOUT = "timeout"

TIME_LIMIT = 7200.0
"""Simulated seconds; the longest of the shipped missions takes about two minutes."""

QUIET = RunOptions(serve=False)
"""Options of a run that nobody watches."""


@dataclass(frozen=True)
class MissionEntry:
    """One run of a mission to make.

    Attributes:
        mission: name or path of the mission.
        time_limit: simulated seconds after which the run has failed.
        options: of the run: seed, arguments, robot and parameters.
    """

    mission: str
    time_limit: float
    options: RunOptions = QUIET

    @property
    def key(self) -> tuple[str, str, int]:
        """Unique key of the run in a table."""
        settings = settings_text(self.options.parameters or {})
        return self.label, settings, self.options.seed

    @property
    def label(self) -> str:
        """Name of the mission."""
        return Path(self.mission).stem


@dataclass(frozen=True, slots=True)
class MissionRun(Row):
    """One row of the table: a run of a mission.

    Attributes:
        settings: `controller.cruise_speed=0.5 …`; empty for the unchanged mission.
        status: final state of the mission, or timeout. cause: why it failed.
        time: simulated seconds. driven: metres.
        shortest: length of the shortest path through the true poses at the reached goals, metres.
        clearance: smallest true distance to any obstacle, metres, measured up to 1 m.
        turning: mean absolute change of the commanded angular velocity, rad/s².
        jerk: root mean square of the commanded jerk, m/s³.
        goal_error: mean true distance to the goals when the robot reported them reached, metres;
            None when it drove to no goal.
        collisions: contacts while the robot moved. pushed_into: contacts while it stood still.
        localisation_error: mean distance between estimate and truth, and the largest, metres.
        real_time_factor: simulated seconds per wall second. wall_seconds: compute time.
    """

    mission: str
    settings: str
    seed: int
    status: str
    cause: str
    time: float = 0.0
    driven: float = 0.0
    shortest: float | None = None
    clearance: float = 0.0
    turning: float = 0.0
    jerk: float = 0.0
    goal_error: float | None = None
    collisions: int = 0
    pushed_into: int = 0
    recoveries: int = 0
    replans: int = 0
    localisation_error: tuple[float, float] = (0.0, 0.0)
    real_time_factor: float = 0.0
    wall_seconds: float = 0.0

    @property
    def detour(self) -> float | None:
        """Metres driven per metre of the shortest path."""
        return self.driven / self.shortest if self.shortest else None

    @property
    def title(self) -> str:
        """Which run it was."""
        return f"{self.settings or self.mission} seed {self.seed}"

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        return f"{self.time:.1f} s, {self.driven:.1f} m, clearance {self.clearance:.2f} m"


WAITING = ("44_ground_station",)
"""Shipped missions that wait for hours for somebody to command them: not run without a name."""


def settings_text(parameters: Mapping[str, str]) -> str:
    """Return parameters as one line."""
    return " ".join(f"{name}={value}" for name, value in parameters.items())


def settings_of(entry: MissionEntry) -> dict[str, Any]:
    """Return what the runs of a mission depend on besides the seed."""
    plan = prepare(entry.mission, entry.options)
    return {
        **conditions(plan, entry.options), "world": world_of(plan), "time_limit": entry.time_limit,
    }  # fmt: skip


def entries_of(options: Options) -> list[MissionEntry]:
    """Return the runs of every mission and seed.

    Raises:
        InputError: two missions have the same name.
    """
    shipped = (file.stem for file in mission_files() if file.stem not in WAITING)
    names = options.names or tuple(shipped)
    for stem, count in Counter(Path(name).stem for name in names).items():
        if count > 1:
            raise InputError(f"{stem} is given {count} times; use unique mission names")
    (robot,) = options.robots or (None,)
    quiet = replace(QUIET, robot=robot, parameters=dict(options.parameters))
    return [
        MissionEntry(name, TIME_LIMIT, replace(quiet, seed=seed))
        for name in names
        for seed in options.seeds
    ]


def run_entry(entry: MissionEntry, picture: Path) -> MissionRun:
    """Run a mission to its end.

    Raises:
        InputError: the mission has errors.
    """
    plan = prepare(entry.mission, entry.options)
    recorder = DriveRecorder()
    report = execute(plan, entry.options, [recorder], lambda: recorder.time >= entry.time_limit)
    late = report.status == MissionState.INTERRUPTED and recorder.time >= entry.time_limit
    errors = [goal.distance_to(truth) for goal, truth in recorder.reached]
    shortest = _shortest(plan, [truth for _, truth in recorder.reached])
    name, settings, seed = entry.key
    return MissionRun(
        mission=name, settings=settings, seed=seed,
        status=TIMEOUT if late else report.status,
        cause=f"not finished after {entry.time_limit:g} s" if late else report.reason,
        time=round(report.simulated_seconds, 3),
        driven=round(report.distance_m or 0.0, 3),
        shortest=None if shortest is None else round(shortest, 3),
        clearance=round(1.0 if report.min_clearance_m is None else report.min_clearance_m, 4),
        turning=round(recorder.turning, 4),
        jerk=round(recorder.jerk, 4),
        goal_error=round(mean(errors), 4) if errors else None,
        **_from_report(report),
    )  # fmt: skip


def _from_report(report: Report) -> dict[str, Any]:
    """Return the figures copied from the report; a replayed log has no contacts."""
    error = report.localisation_error or {"mean": 0.0, "max": 0.0}
    return {
        "collisions": report.collisions or 0,
        "pushed_into": report.pushed_into or 0,
        "recoveries": report.recoveries,
        "replans": report.replans,
        "localisation_error": (round(error["mean"], 4), round(error["max"], 4)),
        "real_time_factor": round(report.real_time_factor, 2),
    }


def _shortest(plan: PreparedMission, stops: list[Pose2D]) -> float | None:
    """Return the shortest length from the start over all stops, metres; straight without a path."""
    if not stops:
        return None
    chain = [plan.start, *stops]
    path_length = shortest_path_lengths(plan.world, plan.robot, chain)

    def length(here: Pose2D, there: Pose2D) -> float:
        try:
            return path_length(here, there)
        except NavigationError:
            return here.distance_to(there)

    return sum(length(here, there) for here, there in pairwise(chain))


def table_of(runs: Sequence[MissionRun]) -> Rows:
    """Return one row per mission: successes, medians of time and distance, sums, worst values."""
    return [
        _table_row(name, group.rows)
        for name, group in groups(runs, lambda run: run.mission).items()
    ]


def _table_row(name: str, runs: Sequence[MissionRun]) -> dict[str, Any]:
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
        CAUSES: "; ".join(f"{run.seed}: {run.cause}" for run in runs if not run.success),
    }


MISSIONS = Bench(MissionRun, entries_of, run_entry, settings_of, table_of)
