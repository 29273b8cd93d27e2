"""Makes the runs of a benchmark over processes; the table is written as it grows and resumed."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from missions.bench.picture import draw_story
from missions.bench.reporting import short
from missions.bench.resumable import TableOptions, Work, claim, fill
from missions.bench.runs import Entry, Run, Setup
from missions.bench.trial import run_trial

__all__ = ["TableOptions", "fill_table", "line_of"]

PICTURES = "failures"


def fill_table(
    entries: Sequence[Entry], options: TableOptions, tell: Callable[[str], None]
) -> list[Run]:
    """Make the runs that the table does not hold yet; all that were asked for, in that order.

    Args:
        entries: what to run.
        options: where the table is.
        tell: takes lines for the person who waits.

    Raises:
        InputError: a wrong mission, or a folder with results of another setting.
    """
    _claim({entry.setup.label: entry for entry in entries}, options.out, tell)
    work = Work(partial(_run_and_draw, out=options.out), _row, line_of)
    return fill(entries, options, work, tell)


def line_of(run: Run) -> str:
    """A run in a line."""
    figures = f"{run.time:.1f} s, {run.driven:.1f} m, clearance {run.clearance:.2f} m"
    what = figures if run.success else f"{run.status.upper()}: {run.cause}"
    return f"{short(run.setup)}, world {run.world} trial {run.trial}: {what}"


def _claim(setups: dict[str, Entry], out: Path, tell: Callable[[str], None]) -> None:
    """Write down each setup's settings, or compare them with those of the folder's results."""
    found = {label: _settings(entry.setup, entry) for label, entry in setups.items()}
    claim(out, {label: settings for label, (settings, _) in found.items()})
    for _, sentence in found.values():
        tell(sentence)


def _settings(setup: Setup, entry: Entry) -> tuple[dict[str, Any], str]:
    """What a setup's results depend on, as plain values, and a line about its robot."""
    plan, _ = setup.plan(entry.case, 0)
    limits = asdict(plan.robot.limits)
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    settings = {
        "mission": hashlib.sha256(plan.text.encode()).hexdigest()[:16],
        "arguments": setup.arguments, "robot": plan.robot.name, "limits": limits,
        "navigation": chosen, "rules": asdict(setup.rules),
    }  # fmt: skip
    sentence = (
        f"{plan.robot.name}: {limits['linear_speed']:g} m/s, {limits['angular_speed']:g} rad/s, "
        f"+{limits['linear_acceleration']:g}/-{limits['linear_deceleration']:g} m/s², "
        f"{limits['angular_acceleration']:g} rad/s²; controller {plan.choices['controller'].name}"
    )
    return settings, sentence


def _row(values: dict[str, Any]) -> Run:
    return Run(**{**values, "end": tuple(values["end"])})


def _run_and_draw(entry: Entry, out: Path) -> Run:
    story = run_trial(entry)
    if not story.run.success:
        folder = out / PICTURES
        folder.mkdir(exist_ok=True)
        plan, _ = entry.setup.plan(entry.case, entry.trial)
        name = re.sub(r"[^\w.=-]+", "-", " ".join(map(str, entry.key)))
        draw_story(folder / f"{name}.png", plan, story)
    return story.run
