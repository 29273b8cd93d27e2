"""One run through one BARN world, watched with the benchmark's eyes: the truth and its clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from missions.assembly import Plan, RunOptions, prepare
from missions.bench.barn_score import GOAL_RADIUS, START_DISTANCE, TIME_LIMIT, Crossing
from missions.bench.barn_worlds import BarnWorld, path_length
from missions.wiring import Wiring, run_info, wire
from stack.errors import InputError
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Event, RunInfo, Snapshot
from stack.types import Pose2D


@dataclass(frozen=True)
class Setup:
    """What every run of a benchmark shares.

    Attributes:
        mission: name or path of the mission; its argument `goal` says where to.
        arguments: as `--set` gives them.
    """

    mission: str
    arguments: dict[str, str] = field(default_factory=dict)

    def plan(self, trial: int) -> tuple[Plan, RunOptions]:
        """The mission, read and checked, and how it is run."""
        options = RunOptions(
            seed=trial, arguments=self.arguments, serve=False, camera="off",
        )  # fmt: skip
        return prepare(self.mission, options), options

    def goal(self, plan: Plan) -> Pose2D:
        """Where the mission's argument `goal` leads.

        Raises:
            InputError: the mission has no such argument.
        """
        value = plan.mission.arguments.get("goal")
        if not isinstance(value, Pose2D):
            raise InputError(f"{self.mission}: a BARN mission needs the argument goal, a Pose")
        return value


class Notes:
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


@dataclass
class Watch:
    """The benchmark's clock: starts after START_DISTANCE, ends in a word.

    Attributes:
        trace: true poses, one a control step.
        started: seconds on the robot's clock; None while it stands at the start.
        status: success | contact | timeout | gave_up; empty while it drives.
    """

    goal: Pose2D
    trace: list[Pose2D] = field(default_factory=list)
    started: float | None = None
    status: str = ""
    time: float = 0.0

    def look(self, time: float, truth: Pose2D, *, touched: bool, over: bool) -> None:
        """Take in a step."""
        self.trace.append(truth)
        if self.started is None and truth.distance_to(self.trace[0]) > START_DISTANCE:
            self.started = time
        self.time = time - self.started if self.started is not None else 0.0
        if touched:
            self.status = "contact"
        elif truth.distance_to(self.goal) <= GOAL_RADIUS:
            self.status = "success"
        elif time - (self.started or 0.0) >= TIME_LIMIT:
            self.status = "timeout"
        elif over:
            self.status = "gave_up"

    @property
    def driven(self) -> float:
        """Metres."""
        return sum(a.distance_to(b) for a, b in zip(self.trace, self.trace[1:], strict=False))


def cross(case: BarnWorld, setup: Setup, trial: int) -> tuple[Crossing, list[Pose2D]]:
    """Run the mission through a world; the result and the true poses on the way.

    Raises:
        InputError: the mission is wrong, or names no goal.
    """
    began = perf_counter()
    plan, options = setup.plan(trial)
    plan = replace(plan, world=case.world)
    goal = setup.goal(plan)
    length = path_length(case, plan.robot, plan.start, goal)
    notes, watch = Notes(), Watch(goal)
    telemetry = Telemetry(run_info(plan, f"barn-{case.name}", trial), [notes])
    wiring = wire(plan, options, telemetry, None)
    try:
        while not watch.status:
            wiring.runtime.step()
            tally = wiring.body.tally
            watch.look(
                wiring.body.time, wiring.witness.truth,
                touched=tally.by_robot + tally.against_standing > 0,
                over=wiring.runtime.state.is_over,
            )  # fmt: skip
        crossing = _crossing(case.name, trial, watch, length, wiring, notes)
    finally:
        wiring.runtime.parts.navigation.close()
        wiring.telemetry.close(None)
        wiring.body.close()
    return replace(crossing, wall_seconds=round(perf_counter() - began, 2)), watch.trace


def _crossing(  # noqa: PLR0913 - the figures of one row
    name: str, trial: int, watch: Watch, length: float, wiring: Wiring, notes: Notes
) -> Crossing:
    end = watch.trace[-1]
    counters = wiring.runtime.counters()
    return Crossing(
        world=name,
        trial=trial,
        status=watch.status,
        cause=_cause(watch, wiring, notes),
        time=round(watch.time, 3),
        path_length=length,
        driven=round(watch.driven, 3),
        clearance=round(wiring.body.clearance, 4),
        recoveries=int(counters["recoveries"]),
        replans=int(counters["replans"]),
        end=(round(end.x, 3), round(end.y, 3), round(end.heading, 3)),
        wall_seconds=0.0,
    )


def _cause(watch: Watch, wiring: Wiring, notes: Notes) -> str:
    end, speed = watch.trace[-1], wiring.runtime.odometry.twist
    if watch.status == "contact":
        news = [text for kind, text in wiring.body.news() if kind == "contact"]
        return (
            f"{(news or [notes.contact])[0]} after {watch.time:.1f} s, at {speed.linear:.2f} m/s"
            f" and {speed.angular:.2f} rad/s"
        )
    where = f"at ({end.x:.2f}, {end.y:.2f}), {end.distance_to(watch.goal):.1f} m from the goal"
    trouble = f"; last: {notes.trouble}" if notes.trouble else ""
    if watch.status == "timeout":
        return f"still driving {where}{trouble}"
    if watch.status == "gave_up":
        return f"the mission ended {where}: {wiring.runtime.reason or 'it took itself for there'}"
    return ""
