"""Runs a recorded run again, and tells whether it became the same."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

from missions.execution.prepare import prepare
from missions.execution.records.inputs import REPEATS, RunInputs, read_inputs
from missions.execution.report import Report, read_report
from missions.execution.running import execute
from stack.errors import InputError
from stack.telemetry.event_log import read_events
from stack.telemetry.hub import EVENTS
from stack.telemetry.records import Event


@dataclass(frozen=True, slots=True)
class Repetition:
    """Outcome of a repetition.

    Attributes:
        folder: of the new run.
        report: of the new run.
        is_same: whether its event log is the same, bit for bit.
        difference: the first event that differs, as a sentence; empty if none does.
        reasons: what is not as it was: versions and files, as sentences.
    """

    folder: Path
    report: Report
    is_same: bool
    difference: str
    reasons: tuple[str, ...]


def repeat_run(folder: Path, interrupted: Callable[[], bool] = lambda: False) -> Repetition:
    """Run a run again from the copies in its folder, with the same options.

    Args:
        folder: of the run.
        interrupted: called between steps; True ends the run.

    Raises:
        InputError: the folder does not hold what the run was made of.
    """
    inputs, before = read_inputs(folder), read_report(folder)
    if before is None:
        raise InputError(f"{folder} has no report: the run did not come to its end")
    out = _new_folder(folder, inputs)
    options = replace(inputs.options, out=out, serve=False)
    plan = prepare(inputs.mission, options)
    report = execute(plan, options, interrupted=interrupted)
    is_same = report.log_sha256 == before.log_sha256
    reasons = [] if is_same else inputs.changes(plan.read)
    difference = "" if is_same else _first_difference(folder / EVENTS, out / EVENTS)
    return Repetition(out, report, is_same, difference, tuple(reasons))


def _new_folder(folder: Path, inputs: RunInputs) -> Path:
    """An unused folder for the repetition, with the kept values that the run began with."""
    parent = folder / REPEATS
    number = 1
    while (parent / str(number)).exists():
        number += 1
    out = parent / str(number)
    if inputs.kept.exists():
        parent.mkdir(exist_ok=True)
        shutil.copy(inputs.kept, parent / f"{Path(inputs.mission).stem}.kept.json")
    return out


def _first_difference(before: Path, after: Path) -> str:
    """The first event in which two logs differ, as a sentence."""
    for old, new in zip_longest(read_events(before), read_events(after)):
        if old == new:
            continue
        if old is None or new is None:
            more = "the repetition" if old is None else "the first run"
            return f"{more} has more events, from {(old or new).time:.2f} s on: {(old or new).text}"
        what = _fields_that_differ(old, new)
        return f"event {old.number} at {old.time:.2f} s: {what}"
    return "the events are equal, their bytes are not"


def _fields_that_differ(old: Event, new: Event) -> str:
    if (old.kind, old.text) != (new.kind, new.text) or old.time != new.time:
        return f"was {old.text!r} at {old.time:.2f} s, is {new.text!r} at {new.time:.2f} s"
    names = [name for name in old.fields if old.fields[name] != new.fields.get(name)]
    shown = ", ".join(
        f"{name} was {json.dumps(old.fields[name])}, is {json.dumps(new.fields.get(name))}"
        for name in names[:3]
    )
    return f"{old.kind}: {shown or 'fields'}"
