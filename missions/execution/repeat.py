"""Runs a recorded run again, and says whether the result is the same."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable
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


def repeat_run(folder: Path) -> Repetition:
    """Run a run again from the copies in its folder, with the same options.

    Args:
        folder: of the run.

    Raises:
        InputError: the folder does not hold what the run was made of.
    """
    inputs, before = read_inputs(folder), read_report(folder)
    if before is None:
        raise InputError(f"{folder} has no report: the run did not come to its end")
    inputs.link_large_files()
    out = _new_folder(folder, inputs)
    options = replace(inputs.options, out=out, serve=False)
    plan = prepare(inputs.mission, options)
    report = execute(plan, options)
    is_same = report.log_sha256 == before.log_sha256
    reasons = [] if is_same else inputs.changes(plan.read)
    difference = (
        ""
        if is_same
        else first_difference(
            read_events(folder / EVENTS), read_events(out / EVENTS), ("the run", "the repetition")
        )
    )
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
        shutil.copy(inputs.kept, parent / f"{inputs.mission.stem}.kept.json")
    return out


def first_difference(one: Iterable[Event], other: Iterable[Event], names: tuple[str, str]) -> str:
    """The first event in which two runs differ, as a sentence; empty if none does.

    Args:
        one: events of a run.
        other: events of another run.
        names: of the two runs.
    """
    old, new = differing_events(one, other)
    if old is not None and new is not None:
        return f"equal up to {min(old.time, new.time):.2f} s; then {_apart(old, new, names)}"
    for longer, event in zip(names, (old, new), strict=True):
        if event is not None:
            return f"equal up to {event.time:.2f} s; then only {longer} continues: {event.text}"
    return ""


def differing_events(
    one: Iterable[Event], other: Iterable[Event]
) -> tuple[Event | None, Event | None]:
    """The first events in which two runs differ; None of a run that ends before, or if none do."""
    pairs = ((old, new) for old, new in zip_longest(one, other) if old != new)
    return next(pairs, (None, None))


def _apart(old: Event, new: Event, names: tuple[str, str]) -> str:
    if (old.kind, old.text, old.time) != (new.kind, new.text, new.time):
        return (
            f"{names[0]}: {old.text} ({old.time:.2f} s), but {names[1]}: {new.text}"
            f" ({new.time:.2f} s)"
        )
    differ = [name for name in old.fields if old.fields[name] != new.fields.get(name)]
    shown = ", ".join(
        f"{name} {json.dumps(old.fields[name])} and {json.dumps(new.fields.get(name))}"
        for name in differ[:3]
    )
    return f"event {old.number}, {old.kind}: {shown or 'other fields'}"
