"""One run of the localisation bench, and its row in the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import degrees, inf
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from missions.bench.drive_recorder import DriveRecorder
from missions.bench.localisation.experiments import (
    EXPERIMENTS,
    Case,
    LocalisationEntry,
    make_case,
)
from missions.bench.localisation.monitor import (
    BINS,
    NEAR,
    LocalisationMonitor,
    Sample,
    speed_of,
)
from missions.bench.localisation.picture import draw_case
from missions.bench.resumable import Key, Work
from missions.bench.runs import CRASHED
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.run import Run

PASSED, FAILED = "passed", "failed"
PICTURES = "failures"

LARGEST_ERROR, CONTAINED = 0.5, 0.95
"""Metres that a tracked pose may be off, and the share of errors that the covariance contains."""

NOTICED_IN, CORRECTED_IN, DRIVING = 3.0, 15.0, 10.0
"""Seconds until an event is noticed and corrected, and of driving after an unknown start."""


@dataclass(frozen=True, slots=True)
class LocalisationRow:
    """One row of the table: a run. Seconds that were never reached are None.

    Attributes:
        status: passed | failed | crashed. cause: why it failed, in a sentence.
        time: seconds on the run's clock. driven: metres.
        error: mean and largest distance between estimate and truth, metres.
        turn: mean and largest error of the heading, degrees.
        contained: share of the samples whose 95 % ellipse contains the error.
        noticed, corrected: seconds after the push, the kidnap or the unknown start.
        driving: seconds of driving until an unknown start was right.
        lost_falsely: times at which a right pose became LOST.
        wrong_claims: seconds with a good health and without rivals at a wrong pose.
        ambiguous: seconds with rivals.
        goals: goals reported as reached. false_goals: those at which the robot was not.
        bins: samples, sum of the health and right samples for each tenth of the health.
    """

    experiment: str
    kind: str
    seed: int
    status: str
    cause: str
    time: float
    driven: float
    error: tuple[float, float]
    turn: tuple[float, float]
    contained: float
    noticed: float | None
    corrected: float | None
    driving: float | None
    lost_falsely: int
    wrong_claims: float
    ambiguous: float
    goals: int
    false_goals: int
    bins: list[list[float]]
    wall_seconds: float

    @property
    def success(self) -> bool:
        """Whether the run fulfils the aim of its experiment."""
        return self.status == PASSED

    @property
    def key(self) -> Key:
        """Key of its entry."""
        return self.experiment, self.kind, self.seed


def run_case(entry: LocalisationEntry, parameters: dict[str, str], out: Path) -> LocalisationRow:
    """Make one run, and draw it if it fails.

    Args:
        entry: what to run.
        parameters: `localisation.beams` -> value as text.
        out: folder of the results.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    began = perf_counter()
    case = make_case(entry)
    options = options_of(entry, case, parameters)
    plan = prepare(case.mission, options)
    monitor, recorder = LocalisationMonitor(EXPERIMENTS[entry.experiment]), DriveRecorder()
    driven = _drive(plan, options, monitor, recorder)
    row = _row(entry, monitor, recorder, driven)
    if not row.success:
        folder = out / PICTURES
        folder.mkdir(parents=True, exist_ok=True)
        name = " ".join(map(str, entry.key)).replace(" ", "-")
        caption = [f"{' '.join(map(str, entry.key))}: {row.cause}", case.command(entry.seed)]
        draw_case(folder / f"{name}.png", plan, monitor.trace, caption)
    return replace(row, wall_seconds=round(perf_counter() - began, 2))


def options_of(entry: LocalisationEntry, case: Case, parameters: dict[str, str]) -> RunOptions:
    """Return the options of a run."""
    return RunOptions(
        seed=entry.seed, arguments={"goals": case.goals}, world=str(case.file), serve=False,
        camera="off", parameters=parameters,
    )  # fmt: skip


def _drive(
    plan: PreparedMission, options: RunOptions, monitor: LocalisationMonitor,
    recorder: DriveRecorder,
) -> float:  # fmt: skip
    """Run to the end of the experiment; return the distance driven, metres."""
    run = Run(plan, options, [recorder])
    try:
        runtime, simulation = run.engine.runtime, run.engine.simulation
        assert simulation is not None  # the bench runs in the simulation only
        while not run.is_over and not monitor.is_done:
            truth = simulation.truth  # the step estimates the pose of this time
            run.step()
            if runtime.perceived.time > monitor.experiment.seconds:
                break
            twist, motion = truth.twist, runtime.perceived.motion
            speed = speed_of(twist.linear, twist.lateral, twist.angular)
            monitor.update(
                Sample(
                    runtime.perceived.time, runtime.parts.estimator.estimate, truth.pose, speed,
                    motion.disturbed,
                ),
                runtime.period,
            )  # fmt: skip
        return runtime.distance
    finally:
        run.close()


def _row(
    entry: LocalisationEntry, monitor: LocalisationMonitor, recorder: DriveRecorder, driven: float
) -> LocalisationRow:
    errors = np.array(monitor.errors or [(0.0, 0.0)])
    mean, largest = errors.mean(axis=0), errors.max(axis=0)
    false = sum(goal.distance_to(truth) > 2.0 * NEAR[0] for goal, truth in recorder.reached)
    row = LocalisationRow(
        experiment=entry.experiment, kind=entry.kind, seed=entry.seed, status=PASSED, cause="",
        time=round(recorder.time, 2), driven=round(driven, 2),
        error=(round(float(mean[0]), 4), round(float(largest[0]), 4)),
        turn=(round(degrees(mean[1]), 3), round(degrees(largest[1]), 3)),
        contained=round(monitor.contained / max(1, len(monitor.errors)), 4),
        noticed=_seconds(monitor.noticed), corrected=_seconds(monitor.corrected),
        driving=_seconds(monitor.driving),
        lost_falsely=monitor.lost_falsely, wrong_claims=round(monitor.wrong_claims, 1),
        ambiguous=round(monitor.ambiguous, 1), goals=len(recorder.reached), false_goals=false,
        bins=monitor.bins.round(3).tolist(), wall_seconds=0.0,
    )  # fmt: skip
    cause = cause_of(row, is_near=bool(errors[-1][0] <= NEAR[0] and errors[-1][1] <= NEAR[1]))
    return replace(row, status=FAILED, cause=cause) if cause else row


def cause_of(row: LocalisationRow, *, is_near: bool) -> str:
    """Return why a run does not fulfil the aim of its experiment; empty if it does.

    Args:
        row: its figures.
        is_near: whether its last pose is right.
    """
    event = EXPERIMENTS[row.experiment].event
    if row.false_goals:
        return f"{row.false_goals} of {row.goals} goals reported as reached were not"
    if event in ("push", "kidnap"):
        return _late(row.noticed, NOTICED_IN, "noticed") or _late(
            row.corrected, CORRECTED_IN, "within 10 cm"
        )
    judge = _JUDGES.get(row.experiment, _wrong_tracking)
    return judge(row, is_near)


def _late(seconds: float | None, limit: float, what: str) -> str:
    """Return a sentence if something was reached later than its limit, or never."""
    if seconds is not None and seconds <= limit:
        return ""
    reached = "never" if seconds is None else f"after {seconds:.1f} s"
    return f"not {what} in {limit:g} s, but {reached}"


def _wrong_tracking(row: LocalisationRow, is_near: bool) -> str:
    return "" if row.error[1] <= LARGEST_ERROR else f"up to {row.error[1]:.2f} m off"


def _wrong_start(row: LocalisationRow, is_near: bool) -> str:
    return _late(row.driving, DRIVING, "right by driving")


def _unresolved(row: LocalisationRow, is_near: bool) -> str:
    return "" if is_near else "the pose is wrong at the end"


def _nothing(row: LocalisationRow, is_near: bool) -> str:
    return ""


def _lost(row: LocalisationRow, is_near: bool) -> str:
    return f"LOST {row.lost_falsely} times at a right pose" if row.lost_falsely else ""


def _not_contained(row: LocalisationRow, is_near: bool) -> str:
    return "" if row.contained >= CONTAINED else f"contains {row.contained:.0%} of the errors"


_JUDGES: dict[str, Callable[[LocalisationRow, bool], str]] = {
    "corridor": _not_contained,
    "unknown": _wrong_start,
    "hotel": _unresolved,
    "twin": _nothing,  # false goals alone
    "people": _lost,
}


def work_of(parameters: dict[str, str], out: Path) -> Work[LocalisationEntry, LocalisationRow]:
    """Return the functions of the table.

    Args:
        parameters: of all runs.
        out: folder of the results.
    """
    return Work(partial(run_case, parameters=parameters, out=out), _read, line_of, _crashed)


def line_of(row: LocalisationRow) -> str:
    """Return a run as one line."""
    figures = f"mean {100.0 * row.error[0]:.1f} cm, largest {row.error[1]:.2f} m"
    outcome = figures if row.success else f"{row.status.upper()}: {row.cause}; {figures}"
    return f"{row.experiment} {row.kind} seed {row.seed}: {outcome}"


def _seconds(value: float) -> float | None:
    return None if value == inf else round(value, 2)


def _read(values: dict[str, Any]) -> LocalisationRow:
    (mean, largest), (turn, most) = values["error"], values["turn"]
    return LocalisationRow(**{**values, "error": (mean, largest), "turn": (turn, most)})


def _crashed(entry: LocalisationEntry, sentence: str) -> LocalisationRow:
    """Return the row of a run that ended with an exception."""
    return LocalisationRow(
        experiment=entry.experiment, kind=entry.kind, seed=entry.seed, status=CRASHED,
        cause=sentence, time=0.0, driven=0.0, error=(0.0, 0.0), turn=(0.0, 0.0), contained=0.0,
        noticed=None, corrected=None, driving=None, lost_falsely=0, wrong_claims=0.0,
        ambiguous=0.0, goals=0, false_goals=0, bins=[[0.0, 0.0, 0.0]] * BINS, wall_seconds=0.0,
    )  # fmt: skip
