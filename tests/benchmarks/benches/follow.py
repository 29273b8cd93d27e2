"""A guide who is followed through the rooms of mission 35.

A run passes when the robot is with the guide at the end. The gap is that of the true outlines.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, inf
from pathlib import Path
from typing import Any

import numpy as np

from missions.bench.bench import Bench, Options, Row, Rows, groups
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS
from missions.execution.running import execute
from stack.telemetry.records import Event, Snapshot
from stack.telemetry.sinks import Sink
from tests.benchmarks.benchmark import HELD_OUT, Benchmark, Given, table
from tests.benchmarks.layouts import Layout
from tests.benchmarks.robot_entry import RobotEntry
from tests.benchmarks.truth import ending

MISSION = MISSIONS / "35_follow_me.yaml"

TIME_LIMIT = 300.0


@dataclass(frozen=True, slots=True)
class FollowRow(Row):
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
    def figures(self) -> str:
        """Its most important figures as text."""
        return (
            f"{self.time:.0f} s, {self.driven:.0f} m, mean gap {self.mean_gap:.2f} m, within 0.45 m"
            f" for {self.intimate:.1f} s, lost {self.lost} times, drove into {self.drove_into},"
            f" struck {self.struck}, things {self.things}"
        )


class GapRecorder(Sink):
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

    def event(self, event: Event) -> None:
        """Count the contacts with things."""
        self.things += event.kind == "contact" and not event.fields["is_person"]

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


def entries_of(options: Options) -> list[RobotEntry]:
    """Return the runs, seed by seed."""
    return [RobotEntry(robot, seed, options) for seed in options.seeds for robot in options.robots]


def run_entry(entry: RobotEntry, picture: Path) -> FollowRow:
    """Make one run.

    Raises:
        InputError: a parameter has errors.
    """
    options = RunOptions(
        seed=entry.seed, robot=entry.robot, serve=False, parameters=dict(entry.options.parameters)
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
        driven=round(report.distance_m or 0.0, 2),
    )  # fmt: skip


def settings_of(entry: RobotEntry) -> dict[str, Any]:
    """Return what the runs of a robot depend on."""
    return {"parameters": dict(entry.options.parameters), "time_limit": TIME_LIMIT}


def table_of(rows: Sequence[FollowRow]) -> Rows:
    """Return a row of figures for each robot."""
    found: Rows = []
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


FOLLOW = Bench(FollowRow, entries_of, run_entry, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for the robot, with seeds that were not used for development."""
    seeds = given.seeds(HELD_OUT, given["seeds"])
    return table(FOLLOW, given.options("follow", seeds, robots=("scout",)))


LAYOUT = Layout({
    "robot": "{robot}", "with the guide at the end": "{success}", "95 %": "{95 % interval}",
    "drove into": "{drove into}", "struck": "{struck}", "things": "{things}",
    "within 0.45 m": "{intimate}", "least distance": "{least distance}",
    "mean gap": "{mean gap}", "largest": "{largest gap}", "lost per run": "{lost}",
    "median time": "{time}",
})  # fmt: skip
BENCHMARKS = {
    "follow": Benchmark(
        "Following a guide (35)", measure, ("seeds",),
        {"recording": "off", "first seed": HELD_OUT}, LAYOUT,
    )
}  # fmt: skip
