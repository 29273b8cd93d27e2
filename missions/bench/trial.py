"""One run of a benchmark, watched with the benchmark's eyes: the truth and its clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from missions.bench.runs import Entry, Rules, Run, goal_of
from missions.bench.shortest import shortest_way
from missions.execution.build import Engine, build, run_info
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.types import FloatArray, Pose2D

START_DISTANCE = 0.1
"""Metres that the robot has driven when its clock starts."""


class FailureNotes:
    """A telemetry sink that keeps what explains a failure."""

    def __init__(self) -> None:
        self.contact = ""
        self.trouble = ""

    def open(self, info: RunInfo) -> None:
        """Nothing to prepare."""

    def event(self, event: Event) -> None:
        """Keep the contact and the last trouble."""
        if event.kind == "contact":
            self.contact = event.text
        elif event.level in ("warning", "error") or event.kind == "recovery":
            self.trouble = f"{event.text} ({event.time:.1f} s)"

    def wants_snapshot(self, time: float) -> bool:
        """Never."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """The last one comes unasked; nothing to keep of it."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Nothing to close."""


@dataclass(frozen=True, slots=True)
class GoalObservation:
    """What the benchmark sees of a step.

    Attributes:
        time: seconds on the robot's clock.
        truth: the robot's pose.
        touched: it has touched something. struck: something that moves ran into it as it stood.
        outcome: of the mission; empty while it goes on.
    """

    time: float
    truth: Pose2D
    touched: bool = False
    struck: bool = False
    outcome: str = ""


@dataclass
class GoalMonitor:
    """The benchmark's clock: starts after START_DISTANCE, ends in a word.

    Attributes:
        trace: true poses, one a control step.
        started: seconds on the robot's clock; None while it stands at the start.
        status: success | contact | struck | timeout | gave_up; empty while it drives.
    """

    goal: Pose2D
    rules: Rules
    trace: list[Pose2D] = field(default_factory=list)
    started: float | None = None
    status: str = ""
    time: float = 0.0

    def look(self, sight: GoalObservation) -> None:
        """Take in a step."""
        self.trace.append(sight.truth)
        if self.started is None and sight.truth.distance_to(self.trace[0]) > START_DISTANCE:
            self.started = sight.time
        self.time = sight.time - self.started if self.started is not None else 0.0
        if sight.touched:
            self.status = "contact"
        elif sight.struck:
            self.status = "struck"
        elif self._there(sight):
            self.status = "success"
        elif sight.time - (self.started or 0.0) >= self.rules.time_limit:
            self.status = "timeout"
        elif sight.outcome:
            self.status = "gave_up"

    def _there(self, sight: GoalObservation) -> bool:
        near = sight.truth.distance_to(self.goal) <= self.rules.goal_radius
        return near and (sight.outcome == MissionState.SUCCESS or not self.rules.by_mission)

    @property
    def driven(self) -> float:
        """Metres."""
        return sum(a.distance_to(b) for a, b in zip(self.trace, self.trace[1:], strict=False))


@dataclass(frozen=True)
class Trial:
    """A run and what a picture of it shows.

    Attributes:
        trace: the robot's true poses.
        walkers: (n, 3) x, y, radius of what moves, at the end.
    """

    run: Run
    goal: Pose2D
    trace: list[Pose2D]
    walkers: FloatArray


def run_trial(entry: Entry) -> Trial:
    """Make a run.

    Raises:
        InputError: the mission is wrong, or names no goal.
    """
    began = perf_counter()
    plan, options = entry.setup.plan(entry.case, entry.trial)
    goal = goal_of(plan)
    notes, watch = FailureNotes(), GoalMonitor(goal, entry.setup.rules)
    telemetry = Telemetry(run_info(plan, f"bench-{entry.case.name}", entry.trial), [notes])
    engine = build(plan, options, telemetry, None)
    try:
        while not watch.status:
            engine.runtime.step()
            watch.look(_goal_observation(engine, alive=bool(plan.world.people)))
        run = _row(entry, watch, engine, notes)
        walkers = engine.body.people
    finally:
        engine.runtime.parts.navigator.close()
        engine.telemetry.close(None)
        engine.body.close()
    length = entry.case.path_length or shortest_way(plan.world, plan.robot, plan.start, goal)
    seconds = round(perf_counter() - began, 2)
    run = replace(run, path_length=length, wall_seconds=seconds)
    return Trial(run, goal, watch.trace, walkers)


def _goal_observation(engine: Engine, *, alive: bool) -> GoalObservation:
    """What is to be seen now; where nothing is alive every contact is the robot's own."""
    tally, state = engine.body.tally, engine.runtime.state
    return GoalObservation(
        engine.body.time, engine.scorer.truth,
        touched=tally.by_robot + (0 if alive else tally.against_standing) > 0,
        struck=tally.against_standing > 0,
        outcome=str(state) if state.is_over else "",
    )  # fmt: skip


def _row(entry: Entry, watch: GoalMonitor, engine: Engine, notes: FailureNotes) -> Run:
    end, counters = watch.trace[-1], engine.runtime.counters()
    return Run(
        setup=entry.setup.label,
        world=entry.case.name,
        trial=entry.trial,
        status=watch.status,
        cause=_cause(watch, engine, notes),
        time=round(watch.time, 3),
        path_length=0.0,
        driven=round(watch.driven, 3),
        clearance=round(engine.body.clearance, 4),
        recoveries=int(counters["recoveries"]),
        replans=int(counters["replans"]),
        end=(round(end.x, 3), round(end.y, 3), round(end.heading, 3)),
        wall_seconds=0.0,
    )


def _cause(watch: GoalMonitor, engine: Engine, notes: FailureNotes) -> str:
    end, speed = watch.trace[-1], engine.runtime.odometry.twist
    if watch.status in ("contact", "struck"):
        news = [text for kind, text in engine.body.news() if kind == "contact"]
        return (
            f"{(news or [notes.contact])[0]} after {watch.time:.1f} s, at {speed.linear:.2f} m/s"
            f" and {speed.angular:.2f} rad/s"
        )
    where = f"at ({end.x:.2f}, {end.y:.2f}), {end.distance_to(watch.goal):.1f} m from the goal"
    trouble = f"; last: {notes.trouble}" if notes.trouble else ""
    if watch.status == "timeout":
        return f"still driving {where}{trouble}"
    if watch.status == "gave_up":
        return f"the mission ended {where}: {engine.runtime.reason or 'it took itself for there'}"
    return ""
