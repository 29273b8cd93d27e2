"""One drive to a goal, judged by ground truth and the benchmark's own clock."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from missions.bench.conditions import conditions
from missions.bench.goal_runs import Entry, Rules, TrialRow, goal_of
from missions.bench.picture import Drawn, draw_run
from missions.bench.shortest_path import shortest_path_lengths
from missions.execution.build import Engine
from missions.execution.prepare import PreparedMission
from missions.execution.run import Run
from stack.body import SimulatedWorld
from stack.telemetry.records import Event, MissionState
from stack.telemetry.sinks import Sink
from stack.types import FloatArray, Pose2D

START_DISTANCE = 0.1
"""Distance from the start at which the benchmark's clock starts, metres."""


class FailureNotes(Sink):
    """A telemetry sink that keeps the events that explain a failure."""

    def __init__(self) -> None:
        self.contact = ""
        self.trouble = ""

    def event(self, event: Event) -> None:
        """Keep the last contact, and the last warning, error or recovery."""
        if event.kind == "contact":
            self.contact = event.text
        elif event.level in ("warning", "error") or event.kind == "recovery":
            self.trouble = f"{event.text} ({event.time:.1f} s)"


@dataclass(frozen=True, slots=True)
class TrialState:
    """Ground truth of a run after a step.

    Attributes:
        time: seconds on the robot's clock.
        truth: true pose of the robot.
        contact: the robot has touched something. struck: something ran into the standing robot.
        outcome: final state of the mission; empty while it runs.
    """

    time: float
    truth: Pose2D
    contact: bool = False
    struck: bool = False
    outcome: str = ""


@dataclass
class GoalMonitor:
    """Judges a run: starts the clock after START_DISTANCE and sets the status at the end.

    Attributes:
        trace: true poses, one per control step.
        started: start of the clock, seconds on the robot's clock; None before.
        status: success | contact | struck | timeout | gave_up; empty while it drives.
        time: seconds on the benchmark's clock.
    """

    goal: Pose2D
    rules: Rules
    trace: list[Pose2D] = field(default_factory=list)
    started: float | None = None
    status: str = ""
    time: float = 0.0

    def update(self, state: TrialState) -> None:
        """Judge the state after a step."""
        self.trace.append(state.truth)
        if self.started is None and state.truth.distance_to(self.trace[0]) > START_DISTANCE:
            self.started = state.time
        self.time = state.time - self.started if self.started is not None else 0.0
        if state.contact:
            self.status = "contact"
        elif state.struck:
            self.status = "struck"
        elif self._is_at_goal(state):
            self.status = "success"
        elif state.time - (self.started or 0.0) >= self.rules.time_limit:
            self.status = "timeout"
        elif state.outcome:
            self.status = "gave_up"

    def _is_at_goal(self, state: TrialState) -> bool:
        near = state.truth.distance_to(self.goal) <= self.rules.goal_radius
        return near and (state.outcome == MissionState.SUCCESS or not self.rules.by_mission)

    @property
    def driven(self) -> float:
        """Driven distance, metres."""
        return sum(a.distance_to(b) for a, b in zip(self.trace, self.trace[1:], strict=False))


@dataclass(frozen=True)
class Trial:
    """A run with the data for its picture.

    Attributes:
        plan: the mission.
        trace: true poses of the robot.
        walkers: moving obstacles at the end, (n, 3): x, y, radius in metres.
    """

    run: TrialRow
    plan: PreparedMission
    goal: Pose2D
    trace: list[Pose2D]
    walkers: FloatArray


def run_trial(entry: Entry, picture: Path) -> TrialRow:
    """Make one run, and draw it if it fails.

    Raises:
        InputError: the mission has errors or no goal.
    """
    trial = driven(entry)
    if not trial.run.success:
        drawn = Drawn((trial.trace,), (trial.goal,), trial.walkers)
        caption = f"{trial.run.title}: {trial.run.status}. {trial.run.cause}"
        draw_run(picture, trial.plan, drawn, caption)
    return trial.run


def driven(entry: Entry) -> Trial:
    """Make one run.

    Raises:
        InputError: the mission has errors or no goal.
    """
    plan, options = entry.setup.plan(entry.case, entry.trial)
    goal = goal_of(plan)
    notes, monitor = FailureNotes(), GoalMonitor(goal, entry.setup.rules)
    run = Run(plan, options, [notes])
    try:
        while not monitor.status:
            run.step()
            monitor.update(_trial_state(run.engine, has_people=bool(plan.world.people)))
        row = _row(entry, monitor, run.engine, notes)
        walkers = _simulation(run.engine).people
    finally:
        run.close()
    length = entry.case.path_length
    if not length:
        length = shortest_path_lengths(plan.world, plan.robot, (plan.start, goal))(plan.start, goal)
    return Trial(replace(row, path_length=length), plan, goal, monitor.trace, walkers)


def settings_of(entry: Entry) -> dict[str, Any]:
    """Return what the runs of a setup depend on besides the world and the trial."""
    plan, options = entry.setup.plan(entry.case, 0)
    return {**conditions(plan, options), "rules": asdict(entry.setup.rules)}


def _trial_state(engine: Engine, *, has_people: bool) -> TrialState:
    """Return the current state; in a world without people the robot causes every contact."""
    tally, state = _simulation(engine).tally, engine.runtime.state
    return TrialState(
        engine.body.time, _simulation(engine).truth.pose,
        contact=tally.by_robot + (0 if has_people else tally.against_standing) > 0,
        struck=tally.against_standing > 0,
        outcome=str(state) if state.is_over else "",
    )  # fmt: skip


def _row(entry: Entry, monitor: GoalMonitor, engine: Engine, notes: FailureNotes) -> TrialRow:
    end, counters = monitor.trace[-1], engine.runtime.counters()
    return TrialRow(
        setup=entry.setup.label,
        world=entry.case.name,
        trial=entry.trial,
        status=monitor.status,
        cause=_cause(monitor, engine, notes),
        time=round(monitor.time, 3),
        driven=round(monitor.driven, 3),
        clearance=round(_simulation(engine).clearance, 4),
        recoveries=int(counters["recoveries"]),
        replans=int(counters["replans"]),
        end=(round(end.x, 3), round(end.y, 3), round(end.heading, 3)),
    )


def _cause(monitor: GoalMonitor, engine: Engine, notes: FailureNotes) -> str:
    end, speed = monitor.trace[-1], engine.runtime.perceived.motion.twist
    if monitor.status in ("contact", "struck"):
        events = _simulation(engine).take_events()
        contacts = [event.text for event in events if event.kind == "contact"]
        return (
            f"{(contacts or [notes.contact])[0]} after {monitor.time:.1f} s, at"
            f" {speed.linear:.2f} m/s"
            f" and {speed.angular:.2f} rad/s"
        )
    where = f"at ({end.x:.2f}, {end.y:.2f}), {end.distance_to(monitor.goal):.1f} m from the goal"
    trouble = f"; last: {notes.trouble}" if notes.trouble else ""
    if monitor.status == "timeout":
        return f"still driving {where}{trouble}"
    if monitor.status == "gave_up":
        reason = engine.runtime.reason or "it reported success away from the goal"
        return f"the mission ended {where}: {reason}"
    return ""


def _simulation(engine: Engine) -> SimulatedWorld:
    assert engine.simulation is not None  # trials run in the simulation only
    return engine.simulation
