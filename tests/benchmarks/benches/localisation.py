"""The estimated pose against the truth: pushes, kidnaps, unknown starts, twin rooms, health."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from math import degrees, inf
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np

from missions.bench.bench import CAUSES, FAILED, PASSED, Bench, Group, Row, Rows, groups
from missions.bench.drive_recorder import DriveRecorder
from missions.bench.picture import Drawn, draw_run
from missions.bench.run_table import measured
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.run import Run
from stack.types import FloatArray
from tests.benchmarks.benchmark import Benchmark, Given, tell
from tests.benchmarks.experiment_monitor import (
    BINS,
    NEAR,
    LocalisationMonitor,
    Sample,
    speed_of,
)
from tests.benchmarks.experiments import EXPERIMENTS, Case, LocalisationEntry, entries_of, make_case
from tests.benchmarks.layouts import Layout
from tests.benchmarks.reliability import draw_reliability

LARGEST_ERROR, CONTAINED = 0.5, 0.95
"""Metres that a tracked pose may be off, and the share of errors that the covariance contains."""

NOTICED_IN, CORRECTED_IN, DRIVING = 3.0, 15.0, 10.0
"""Seconds until an event is noticed and corrected, and of driving after an unknown start."""


@dataclass(frozen=True, slots=True)
class LocalisationRow(Row):
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
    time: float = 0.0
    driven: float = 0.0
    error: tuple[float, float] = (0.0, 0.0)
    turn: tuple[float, float] = (0.0, 0.0)
    contained: float = 0.0
    noticed: float | None = None
    corrected: float | None = None
    driving: float | None = None
    lost_falsely: int = 0
    wrong_claims: float = 0.0
    ambiguous: float = 0.0
    goals: int = 0
    false_goals: int = 0
    bins: tuple[Sequence[float], ...] = ((0.0, 0.0, 0.0),) * BINS
    wall_seconds: float = 0.0

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        return f"mean {100.0 * self.error[0]:.1f} cm, largest {self.error[1]:.2f} m"


def run_case(entry: LocalisationEntry, picture: Path) -> LocalisationRow:
    """Make one run, and draw it if it fails.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    case = make_case(entry)
    options = options_of(entry, case)
    plan = prepare(case.mission, options)
    monitor, recorder = LocalisationMonitor(EXPERIMENTS[entry.experiment]), DriveRecorder()
    driven = _drive(plan, options, monitor, recorder)
    row = _row(entry, monitor, recorder, driven)
    if not row.success:
        truths, estimates = zip(*monitor.trace, strict=True) if monitor.trace else ((), ())
        caption = f"{row.title}: {row.cause}; {case.command(entry.seed)}"
        draw_run(picture, plan, Drawn((truths, estimates)), caption)
    return row


def options_of(entry: LocalisationEntry, case: Case) -> RunOptions:
    """Return the options of a run."""
    return RunOptions(
        seed=entry.seed, arguments={"goals": case.goals}, world=str(case.file), serve=False,
        camera="off", parameters=dict(entry.options.parameters),
    )  # fmt: skip


def settings_of(entry: LocalisationEntry) -> dict[str, Any]:
    """Return what the runs of an experiment depend on."""
    case = make_case(entry)
    plan = prepare(case.mission, options_of(entry, case))
    chosen = plan.choices["localisation"]
    return {
        "experiment": asdict(EXPERIMENTS[entry.experiment]), "robot": plan.robot.name,
        "localisation": {"use": chosen.name, **asdict(chosen.parameters)},
        "parameters": dict(entry.options.parameters),
    }  # fmt: skip


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
                    runtime.perceived.time, runtime.perceived.estimate, truth.pose, speed,
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
    middle, largest = errors.mean(axis=0), errors.max(axis=0)
    false = sum(goal.distance_to(truth) > 2.0 * NEAR[0] for goal, truth in recorder.reached)
    row = LocalisationRow(
        experiment=entry.experiment, kind=entry.kind, seed=entry.seed, status=PASSED, cause="",
        time=round(recorder.time, 2), driven=round(driven, 2),
        error=(round(float(middle[0]), 4), round(float(largest[0]), 4)),
        turn=(round(degrees(middle[1]), 3), round(degrees(largest[1]), 3)),
        contained=round(monitor.contained / max(1, len(monitor.errors)), 4),
        noticed=_seconds(monitor.noticed), corrected=_seconds(monitor.corrected),
        driving=_seconds(monitor.driving),
        lost_falsely=monitor.lost_falsely, wrong_claims=round(monitor.wrong_claims, 1),
        ambiguous=round(monitor.ambiguous, 1), goals=len(recorder.reached), false_goals=false,
        bins=tuple(monitor.bins.round(3).tolist()),
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


def _seconds(value: float) -> float | None:
    return None if value == inf else round(value, 2)


def table_of(rows: Sequence[LocalisationRow]) -> Rows:
    """Return a row for each experiment, and one for the calibration of the health."""
    found = groups(rows, lambda row: row.experiment)
    table: Rows = [_figures(name, found[name]) for name in EXPERIMENTS if name in found]
    bins = bins_of(rows)
    samples = f"{bins[:, 0].sum():.0f} samples"
    error = f"expected calibration error {calibration_error(bins):.3f}"
    blank = dict.fromkeys(table[0], "")
    return [*table, {**blank, "experiment": f"health, {samples}", "contained": error}]


def bins_of(rows: Sequence[LocalisationRow]) -> FloatArray:
    """Return the sum of the bins of all runs, (BINS, 3)."""
    return np.sum([np.array(row.bins) for row in rows], axis=0) if rows else np.zeros((BINS, 3))


def calibration_error(bins: FloatArray) -> float:
    """Return the mean difference of health and share of right poses, weighted by the samples.

    The expected calibration error after C. Guo et al., "On Calibration of Modern Neural
    Networks", ICML 2017, equation 3.
    """
    counts = bins[:, 0]
    if not counts.sum():
        return 0.0
    used = counts > 0
    gaps = np.abs(bins[used, 1] - bins[used, 2]) / counts[used]
    return float(gaps @ counts[used] / counts.sum())


def _figures(name: str, group: Group[LocalisationRow]) -> dict[str, object]:
    rows = group.rows
    return {
        "experiment": name,
        "passed": group.share(),
        "95 % interval": group.interval,
        "mean error": f"{100.0 * mean(row.error[0] for row in rows):.1f} cm",
        "largest": f"{max(row.error[1] for row in rows):.2f} m",
        "heading": f"{mean(row.turn[0] for row in rows):.2f} deg",
        "contained": f"{mean(row.contained for row in rows):.0%}",
        "noticed": _median([row.noticed for row in rows]),
        "corrected": _median([row.corrected for row in rows]),
        "false LOST": sum(row.lost_falsely for row in rows),
        "wrongly sure": f"{sum(row.wrong_claims for row in rows):.0f} s",
        "ambiguous": f"{sum(row.ambiguous for row in rows):.0f} s",
        "false goals": f"{sum(r.false_goals for r in rows)}/{sum(r.goals for r in rows)}",
        CAUSES: "; ".join(
            f"{row.kind} seed {row.seed}: {row.cause}" for row in rows if not row.success
        ),
    }


def _median(values: Sequence[float | None]) -> str:
    """Return the median of seconds; those never reached count as the longest."""
    known = sorted(value for value in values if value is not None)
    middle = (len(values) - 1) // 2
    if not known or middle >= len(known):
        return "never" if any(value is None for value in values) and known else "-"
    return f"{known[middle]:.1f} s"


LOCALISATION = Bench(LocalisationRow, entries_of, run_case, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return the table, and draw the reliability of the health."""
    options = given.options("localisation", given.seeds(0, given["cases"]))
    rows = measured(LOCALISATION, options, tell)
    bins = bins_of(rows)
    draw_reliability(options.out / "reliability.png", bins, calibration_error(bins))
    return table_of(rows)


LAYOUT = Layout(
    {
        "experiment": "{experiment}", "passed": "{passed}", "interval": "{95 % interval}",
        "mean error": "{mean error}", "largest": "{largest}", "heading": "{heading}",
        "contained": "{contained}", "noticed": "{noticed}", "corrected": "{corrected}",
        "false LOST": "{false LOST}", "wrongly sure": "{wrongly sure}",
        "ambiguous": "{ambiguous}", "false goals": "{false goals}",
    },
    failed="{experiment}",
)  # fmt: skip
BENCHMARKS = {
    "localisation": Benchmark(
        "Localisation in generated worlds", measure, ("cases",), {"recording": "off"}, LAYOUT
    )
}
