"""Following a guide through the rooms of mission 35, and its table: `treepilot bench follow`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from missions.bench.perception.table import RunRow, ending, failures, groups, measure
from missions.bench.resumable import Key, TableOptions, Work
from missions.bench.runs import CRASHED
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS
from missions.execution.running import execute
from stack.telemetry.records import Event, RunInfo, Snapshot

MISSION = MISSIONS / "35_follow_me.yaml"

TIME_LIMIT = 300.0


@dataclass(frozen=True)
class FollowEntry:
    """One run to make.

    Attributes:
        robot: name or file. seed: of the people and the run.
        parameters: `safety.top_speed` -> value as text.
    """

    robot: str
    seed: int
    parameters: Mapping[str, str]

    @property
    def key(self) -> Key:
        """Unique key of the run in a table."""
        return Path(self.robot).stem, "follow", self.seed


@dataclass(frozen=True, slots=True)
class FollowRow(RunRow):
    """One row of the table: a run.

    Attributes:
        status: passed (the mission's success) | failed | crashed. cause: why it failed.
        drove_into: contacts with people into which the robot drove. struck: the others.
        things: contacts with things.
        least_distance: to any person, metres. intimate, personal: seconds in Hall's zones.
        mean_gap: distance between the outlines of robot and guide, mean over time, metres.
        largest_gap: metres.
        lost: how often the guide went out of sight.
        time: seconds. driven: metres. wall_seconds: compute time.
    """

    robot: str
    seed: int
    status: str
    cause: str
    drove_into: int = 0
    struck: int = 0
    things: int = 0
    least_distance: float = 0.0
    intimate: float = 0.0
    personal: float = 0.0
    mean_gap: float = 0.0
    largest_gap: float = 0.0
    lost: int = 0
    time: float = 0.0
    driven: float = 0.0
    wall_seconds: float = 0.0

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return self.robot, "follow", self.seed


class GapRecorder:
    """A telemetry sink that records the true distance to the first person of the world.

    Attributes:
        time: seconds on the robot's clock.
        gaps: metres between the outlines, at every step.
        things: contacts with things.
    """

    def __init__(self, radius: float) -> None:
        self.time, self.things = 0.0, 0
        self.gaps: list[float] = []
        self._radius = radius

    def open(self, info: RunInfo) -> None:
        """Do nothing."""

    def event(self, event: Event) -> None:
        """Count the contacts with things."""
        self.things += event.kind == "contact" and "person" not in event.text

    def wants_snapshot(self, time: float) -> bool:
        """Return True: every step is recorded."""
        return True

    def snapshot(self, snapshot: Snapshot) -> None:
        """Record a step; the last step arrives twice and counts once."""
        people, pose = snapshot.people, snapshot.truth
        if snapshot.time <= self.time or people is None or pose is None or not len(people):
            return
        self.time = snapshot.time
        x, y, radius = people[0].tolist()
        self.gaps.append(hypot(x - pose.x, y - pose.y) - radius - self._radius)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Do nothing."""


def follow_entries(
    robots: Sequence[str], seeds: range, parameters: Mapping[str, str]
) -> list[FollowEntry]:
    """Return the runs, seed by seed."""
    return [FollowEntry(robot, seed, parameters) for seed in seeds for robot in robots]


def run_entry(entry: FollowEntry) -> FollowRow:
    """Make one run.

    Raises:
        InputError: a parameter has errors.
    """
    began = perf_counter()
    options = RunOptions(
        seed=entry.seed, robot=entry.robot, serve=False, parameters=dict(entry.parameters)
    )
    plan = prepare(MISSION, options)
    recorder = GapRecorder(plan.robot.footprint.circumscribed_radius)
    report = execute(plan, options, [recorder], lambda: recorder.time >= TIME_LIMIT)
    people = report.people or {}
    by = Counter(item["by"] for item in people.get("contacts", ()))
    status, cause = ending(report)
    return FollowRow(
        Path(entry.robot).stem, entry.seed, status=status, cause=cause,
        drove_into=by["robot"], struck=sum(by.values()) - by["robot"], things=recorder.things,
        least_distance=people.get("least_distance") or 0.0,
        intimate=people.get("seconds_intimate", 0.0), personal=people.get("seconds_personal", 0.0),
        mean_gap=round(float(np.mean(recorder.gaps or [inf])), 3),
        largest_gap=round(max(recorder.gaps, default=inf), 3),
        lost=int(report.blackboard.get("lost", "0")), time=round(report.simulated_seconds, 2),
        driven=round(report.distance_m, 2), wall_seconds=round(perf_counter() - began, 2),
    )  # fmt: skip


def line_of(row: FollowRow) -> str:
    """Return a run as one line."""
    figures = (
        f"{row.time:.0f} s, {row.driven:.0f} m, mean gap {row.mean_gap:.2f} m, within 0.45 m for "
        f"{row.intimate:.1f} s, lost {row.lost} times"
    )
    if row.drove_into or row.struck or row.things:
        figures += f", drove into {row.drove_into}, struck {row.struck}, things {row.things}"
    return f"{row.robot} seed {row.seed}: {row.outcome(figures)}"


def measured(
    entries: Sequence[FollowEntry], options: TableOptions, log: Callable[[str], None]
) -> list[FollowRow]:
    """Make the runs that are missing in the table; return all.

    Raises:
        InputError: the folder has results of other settings.
    """
    return measure(entries, _settings, options, FOLLOW_WORK, log)


def _settings(entry: FollowEntry) -> tuple[str, dict[str, Any]]:
    return entry.robot, {"parameters": dict(entry.parameters), "time_limit": TIME_LIMIT}


def rows_of(rows: Sequence[FollowRow]) -> list[dict[str, object]]:
    """Return a row of figures for each robot."""
    found: list[dict[str, object]] = []
    for robot, group in groups(rows, lambda row: row.robot).items():
        own, good = group.rows, group.good
        found.append({
            "robot": robot, "success": group.share(),
            "95 % interval": group.interval,
            "drove into": sum(row.drove_into for row in own),
            "struck": sum(row.struck for row in own), "things": sum(row.things for row in own),
            "intimate": f"{float(np.mean([row.intimate for row in own])):.1f} s",
            "least distance": f"{min(row.least_distance for row in own):.2f} m",
            "mean gap": f"{float(np.mean([row.mean_gap for row in good])):.2f} m",
            "largest gap": f"{max(row.largest_gap for row in good):.1f} m",
            "lost": f"{sum(row.lost for row in own) / len(own):.1f}",
            "time": f"{float(np.median([row.time for row in good])):.0f} s",
        })  # fmt: skip
    return found


def report(rows: Sequence[FollowRow]) -> list[str]:
    """Return a line per robot, and one per run that failed."""
    lines = [
        f"{row['robot']:<9}{row['success']:>7} followed to the end, "
        f"drove into {row['drove into']}, struck {row['struck']}, "
        f"within 0.45 m {row['intimate']}, least {row['least distance']}, "
        f"mean gap {row['mean gap']}, lost {row['lost']} times, {row['time']}"
        for row in rows_of(rows)
    ]
    return lines + failures(rows, line_of)


def _crashed(entry: FollowEntry, sentence: str) -> FollowRow:
    """Return the row of a run that ended with an exception."""
    return FollowRow(Path(entry.robot).stem, entry.seed, status=CRASHED, cause=sentence)


FOLLOW_WORK: Work[FollowEntry, FollowRow] = Work(run_entry, FollowRow.read, line_of, _crashed)
