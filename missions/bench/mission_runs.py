"""Runs of whole missions and their figures, for `bench missions` and `tune`."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any

from missions.bench.drive_recorder import DriveRecorder
from missions.bench.resumable import Key, Work
from missions.bench.runs import CRASHED
from missions.bench.shortest import shortest_path_lengths
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.running import execute
from stack.errors import NavigationError
from stack.telemetry.records import MissionState
from stack.types import Pose2D

TIMEOUT = "timeout"

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
    def key(self) -> Key:
        """Unique key of the run in a table."""
        settings = settings_text(self.options.parameters or {})
        return Path(self.mission).stem, settings, self.options.seed


@dataclass(frozen=True, slots=True)
class MissionRun:
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
    time: float
    driven: float
    shortest: float | None
    clearance: float
    turning: float
    jerk: float
    goal_error: float | None
    collisions: int
    pushed_into: int
    recoveries: int
    replans: int
    localisation_error: tuple[float, float]
    real_time_factor: float
    wall_seconds: float

    @property
    def success(self) -> bool:
        """Whether the mission succeeded."""
        return self.status == MissionState.SUCCESS

    @property
    def detour(self) -> float | None:
        """Metres driven per metre of the shortest path."""
        return self.driven / self.shortest if self.shortest else None

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return self.mission, self.settings, self.seed


def settings_text(parameters: Mapping[str, str]) -> str:
    """Return parameters as one line."""
    return " ".join(f"{name}={value}" for name, value in parameters.items())


def conditions(entry: MissionEntry, plan: PreparedMission) -> dict[str, object]:
    """Return what the runs of a mission depend on besides the seed, for `record_settings`.

    Args:
        entry: one of the runs.
        plan: the mission, without the settings that differ between its runs.
    """
    world = plan.world.source
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    return {
        "mission": _digest(plan.text.encode()),
        "world": plan.world.name if world is None else _digest(world.read_bytes()),
        "arguments": dict(entry.options.arguments or {}), "robot": plan.robot.name,
        "limits": asdict(plan.robot.limits), "navigation": chosen, "time_limit": entry.time_limit,
    }  # fmt: skip


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def run_entry(entry: MissionEntry) -> MissionRun:
    """Run a mission to its end.

    Raises:
        InputError: the mission has errors.
    """
    began = perf_counter()
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
        driven=round(report.distance_m, 3),
        shortest=None if shortest is None else round(shortest, 3),
        clearance=round(1.0 if report.min_clearance_m is None else report.min_clearance_m, 4),
        turning=round(recorder.turning, 4),
        jerk=round(recorder.jerk, 4),
        goal_error=round(mean(errors), 4) if errors else None,
        wall_seconds=round(perf_counter() - began, 2),
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


def line_of(run: MissionRun) -> str:
    """Return a run as one line."""
    figures = f"{run.time:.1f} s, {run.driven:.1f} m, clearance {run.clearance:.2f} m"
    outcome = figures if run.success else f"{run.status.upper()}: {run.cause}"
    return f"{run.settings or run.mission} seed {run.seed}: {outcome}"


def _read(values: dict[str, Any]) -> MissionRun:
    mean_error, largest = values["localisation_error"]
    return MissionRun(**{**values, "localisation_error": (mean_error, largest)})


def _crashed(entry: MissionEntry, sentence: str) -> MissionRun:
    """Return the row of a run that ended with an exception."""
    name, settings, seed = entry.key
    return MissionRun(
        mission=name, settings=settings, seed=seed, status=CRASHED, cause=sentence, time=0.0,
        driven=0.0, shortest=None, clearance=0.0, turning=0.0, jerk=0.0, goal_error=None,
        collisions=0, pushed_into=0, recoveries=0, replans=0, localisation_error=(0.0, 0.0),
        real_time_factor=0.0, wall_seconds=0.0,
    )  # fmt: skip


MISSION_WORK: Work[MissionEntry, MissionRun] = Work(run_entry, _read, line_of, _crashed)
