"""Whole missions, driven to their own end and measured: what `bench missions` and `tune` run."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import mean
from time import perf_counter
from typing import Any

from missions.bench.drive_recorder import DriveRecorder
from missions.bench.resumable import Key, Work
from missions.bench.shortest import shortest_ways
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.runner import execute
from stack.errors import NavigationError
from stack.telemetry.records import MissionState
from stack.types import Pose2D

TIMEOUT = "timeout"


@dataclass(frozen=True)
class MissionEntry:
    """A mission to run once.

    Attributes:
        mission: name or path.
        seed: of everything random.
        time_limit: simulated seconds after which it has failed.
        arguments: as `--set` gives them. robot: in place of the mission's.
        parameters: `controller.cruise_speed` -> value as text, over everything in files.
    """

    mission: str
    seed: int
    time_limit: float
    arguments: Mapping[str, str] = field(default_factory=dict)
    robot: str | None = None
    parameters: Mapping[str, str] = field(default_factory=dict)

    @property
    def key(self) -> Key:
        """Names it among all of a table."""
        return Path(self.mission).stem, settings_text(self.parameters), self.seed

    @property
    def options(self) -> RunOptions:
        """How it is run."""
        return RunOptions(
            seed=self.seed, arguments=dict(self.arguments), robot=self.robot, serve=False,
            parameters=self.parameters,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class MissionRun:
    """A run of a mission, as it stands in the table.

    Attributes:
        settings: `controller.cruise_speed=0.5 …`; empty for the mission as it is.
        status: the mission's state at its end, or timeout. cause: why it failed.
        time: simulated seconds. driven: metres.
        shortest: metres of the shortest way by the goals that were reached, where it reached them.
        clearance: least true distance to anything, metres; 1 stands for more.
        turning: mean absolute change of the commanded angular velocity, rad/s².
        jerk: root mean square of the commanded jerk, m/s³.
        goal_error: mean true distance from the goals, where it took itself for there, metres;
            None when it drove to no goal.
        collisions: contacts of the moving robot. pushed_into: of what ran into it as it stood.
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
        """Whether the mission says so."""
        return self.status == MissionState.SUCCESS

    @property
    def detour(self) -> float | None:
        """Metres driven per metre of the shortest way."""
        return self.driven / self.shortest if self.shortest else None

    @property
    def key(self) -> Key:
        """That of its entry."""
        return self.mission, self.settings, self.seed


def settings_text(parameters: Mapping[str, str]) -> str:
    """Parameters in a line."""
    return " ".join(f"{name}={value}" for name, value in parameters.items())


def conditions(entry: MissionEntry, plan: PreparedMission) -> dict[str, object]:
    """What all runs of a mission depend on but their seeds, for `resumable.claim`.

    Args:
        entry: one of them.
        plan: the mission without what may differ between its runs.
    """
    world = plan.world.source
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    return {
        "mission": _digest(plan.text.encode()),
        "world": plan.world.name if world is None else _digest(world.read_bytes()),
        "arguments": dict(entry.arguments), "robot": plan.robot.name,
        "limits": asdict(plan.robot.limits), "navigation": chosen, "time_limit": entry.time_limit,
    }  # fmt: skip


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def run_entry(entry: MissionEntry) -> MissionRun:
    """Run a mission to its end.

    Raises:
        InputError: the mission is wrong.
    """
    began = perf_counter()
    plan = prepare(entry.mission, entry.options)
    recorder = DriveRecorder()
    report = execute(plan, entry.options, [recorder], lambda: recorder.time >= entry.time_limit)
    late = report.status == MissionState.INTERRUPTED
    errors = [goal.distance_to(truth) for goal, truth in recorder.reached]
    shortest = _shortest(plan, [truth for _, truth in recorder.reached])
    name, settings, seed = entry.key
    return MissionRun(
        mission=name, settings=settings, seed=seed,
        status=TIMEOUT if late else report.status,
        cause=f"still at it after {entry.time_limit:g} s" if late else report.reason,
        time=round(report.simulated_seconds, 3),
        driven=round(report.distance_m, 3),
        shortest=None if shortest is None else round(shortest, 3),
        clearance=round(1.0 if report.min_clearance_m is None else report.min_clearance_m, 4),
        turning=round(recorder.turning, 4),
        jerk=round(recorder.jerk, 4),
        goal_error=round(mean(errors), 4) if errors else None,
        wall_seconds=round(perf_counter() - began, 2),
        **_counted(report),
    )  # fmt: skip


def _counted(report: Report) -> dict[str, Any]:
    """What is in the report as it is."""
    error = report.localisation_error or {"mean": 0.0, "max": 0.0}
    return {
        "collisions": report.collisions,
        "pushed_into": report.pushed_into,
        "recoveries": report.recoveries,
        "replans": report.replans,
        "localisation_error": (round(error["mean"], 4), round(error["max"], 4)),
        "real_time_factor": round(report.real_time_factor, 2),
    }


def _shortest(plan: PreparedMission, stops: list[Pose2D]) -> float | None:
    """Metres from the start by all stops; as the crow flies where no way can be drawn."""
    if not stops:
        return None
    chain = [plan.start, *stops]
    way = shortest_ways(plan.world, plan.robot, chain)

    def length(here: Pose2D, there: Pose2D) -> float:
        try:
            return way(here, there)
        except NavigationError:
            return here.distance_to(there)

    return sum(length(here, there) for here, there in pairwise(chain))


def line_of(run: MissionRun) -> str:
    """A run in a line."""
    figures = f"{run.time:.1f} s, {run.driven:.1f} m, clearance {run.clearance:.2f} m"
    what = figures if run.success else f"{run.status.upper()}: {run.cause}"
    return f"{run.settings or run.mission} seed {run.seed}: {what}"


def _read(values: dict[str, Any]) -> MissionRun:
    mean_error, largest = values["localisation_error"]
    return MissionRun(**{**values, "localisation_error": (mean_error, largest)})


MISSION_WORK: Work[MissionEntry, MissionRun] = Work(run_entry, _read, line_of)
