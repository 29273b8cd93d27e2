"""Table of a benchmark: makes its runs in several processes, resumable, with failure pictures."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from missions.bench.people.oracle_picture import draw_verdict
from missions.bench.picture import draw_trial
from missions.bench.reporting import short
from missions.bench.resumable import TableOptions, Work, fill, record_settings
from missions.bench.runs import CRASHED, Entry, Setup, TrialRow
from missions.bench.trial import run_trial

__all__ = ["TableOptions", "fill_table", "line_of"]

PICTURES = "failures"

LONGEST_NAME = 160
"""Characters of the name of a picture."""


def fill_table(
    entries: Sequence[Entry], options: TableOptions, log: Callable[[str], None]
) -> list[TrialRow]:
    """Make the runs that are missing in the table; return all, in the order of the entries.

    Args:
        entries: the runs.
        options: folder of the table and number of processes.
        log: receives lines of progress.

    Raises:
        InputError: a mission has errors, or the folder has results of other settings.
    """
    _record_settings({entry.setup.label: entry for entry in entries}, options.out, log)
    work = Work(partial(_run_and_draw, out=options.out), _row, line_of, _crashed)
    return fill(entries, options, work, log)


def line_of(run: TrialRow) -> str:
    """Return a run as one line."""
    figures = f"{run.time:.1f} s, {run.driven:.1f} m, clearance {run.clearance:.2f} m"
    outcome = figures if run.success else f"{run.status.upper()}: {run.cause}"
    return f"{short(run.setup)}, world {run.world} trial {run.trial}: {outcome}"


def _record_settings(setups: dict[str, Entry], out: Path, log: Callable[[str], None]) -> None:
    """Record the settings of each setup, and log the limits of its robot."""
    found = {label: _settings(entry.setup, entry) for label, entry in setups.items()}
    record_settings(out, {label: settings for label, (settings, _) in found.items()})
    for _, sentence in found.values():
        log(sentence)


def _settings(setup: Setup, entry: Entry) -> tuple[dict[str, Any], str]:
    """Return the settings that results depend on, and a line about the robot's limits."""
    plan, _ = setup.plan(entry.case, 0)
    limits = asdict(plan.robot.limits)
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    settings = {
        "mission": hashlib.sha256(plan.text.encode()).hexdigest()[:16],
        "arguments": setup.options.arguments or {}, "robot": plan.robot.name, "limits": limits,
        "navigation": chosen, "rules": asdict(setup.rules),
    }  # fmt: skip
    sentence = (
        f"{plan.robot.name}: {limits['linear_speed']:g} m/s, {limits['angular_speed']:g} rad/s, "
        f"+{limits['linear_acceleration']:g}/-{limits['linear_deceleration']:g} m/s², "
        f"{limits['angular_acceleration']:g} rad/s²; controller {plan.choices['controller'].name}"
    )
    return settings, sentence


def _row(values: dict[str, Any]) -> TrialRow:
    return TrialRow(**{**values, "end": tuple(values["end"])})


def _crashed(entry: Entry, sentence: str) -> TrialRow:
    """Return the row of a run that ended with an exception."""
    label, world, trial = entry.key
    return TrialRow(
        setup=label, world=world, trial=trial, status=CRASHED, cause=sentence, time=0.0,
        path_length=0.0, driven=0.0, clearance=0.0, recoveries=0, replans=0, end=(0.0, 0.0, 0.0),
        wall_seconds=0.0,
    )  # fmt: skip


def picture_name(key: Sequence[object]) -> str:
    """Return the name of the picture of a run, without its ending.

    File systems allow 255 bytes: a longer name, of a setup with many parameters, is shortened in
    the middle, and a digest tells it from others.
    """
    name = re.sub(r"[^\w.=-]+", "-", " ".join(map(str, key)), flags=re.ASCII)
    if len(name) <= LONGEST_NAME:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:8]
    half = LONGEST_NAME // 2
    return f"{name[:half]}-{digest}-{name[-half:]}"


def _run_and_draw(entry: Entry, out: Path) -> TrialRow:
    trial = run_trial(entry)
    if not trial.run.success:
        folder = out / PICTURES
        folder.mkdir(exist_ok=True)
        plan, _ = entry.setup.plan(entry.case, entry.trial)
        name = picture_name(entry.key)
        draw_trial(folder / f"{name}.png", plan, trial)
        if trial.verdict is not None:
            draw_verdict(folder / f"{name}-oracle.png", trial.verdict, (trial.goal,))
    return trial.run
