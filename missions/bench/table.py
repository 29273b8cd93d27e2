"""Makes the runs of a benchmark over processes; the table is written as it grows and resumed."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from missions.bench.picture import draw_story
from missions.bench.reporting import short
from missions.bench.running import carry_out
from missions.bench.runs import Entry, Run, Setup
from stack.documents import Finding, Mark
from stack.errors import InputError

TABLE, SETTINGS, PICTURES = "runs.jsonl", "settings.json", "failures"

RUNS_PER_PROCESS = 40
"""PyBullet keeps every mesh it ever loaded, some 10 MB a world, until its process ends."""

Key = tuple[str, str, int]


@dataclass(frozen=True)
class TableOptions:
    """Where the table is, and by how many processes it is filled."""

    out: Path
    jobs: int = 1


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
    wanted = {entry.key: entry for entry in entries}
    done = {key: row for key, row in _table(options.out).items() if key in wanted}
    if done:
        tell(f"{len(done)} of {len(wanted)} runs are in {options.out / TABLE} already")
    left = [entry for key, entry in wanted.items() if key not in done]
    with (options.out / TABLE).open("a", encoding="utf-8") as table:
        for run in _runs(left, options):
            table.write(json.dumps(asdict(run)) + "\n")
            table.flush()
            done[run.key] = run
            tell(f"{len(done):4d}/{len(wanted)}  {line_of(run)}")
    return [done[key] for key in wanted]


def line_of(run: Run) -> str:
    """A run in a line."""
    figures = f"{run.time:.1f} s, {run.driven:.1f} m, clearance {run.clearance:.2f} m"
    what = figures if run.success else f"{run.status.upper()}: {run.cause}"
    return f"{short(run.setup)}, world {run.world} trial {run.trial}: {what}"


def _claim(setups: dict[str, Entry], out: Path, tell: Callable[[str], None]) -> None:
    """Write down each setup's settings, or compare them with those of the folder's results."""
    out.mkdir(parents=True, exist_ok=True)
    file = out / SETTINGS
    known: dict[str, Any] = json.loads(file.read_text("utf-8")) if file.exists() else {}
    for label, entry in setups.items():
        settings, sentence = _settings(entry.setup, entry)
        if known.setdefault(label, settings) != settings:
            raise InputError(
                f"{out} holds results of other settings (see {SETTINGS}); choose another --out"
            )
        tell(sentence)
    file.write_text(json.dumps(known, indent=2), "utf-8")


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
    plain: dict[str, Any] = json.loads(json.dumps(settings, default=str))
    return plain, sentence


def _table(folder: Path) -> dict[Key, Run]:
    """The runs written down so far; a last line cut off by an interruption is run again."""
    rows: dict[Key, Run] = {}
    file = folder / TABLE
    if not file.exists():
        return rows
    text = file.read_text("utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        file.write_text(whole, "utf-8")
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            values: dict[str, Any] = json.loads(line)
            values["end"] = tuple(values["end"])
            row = Run(**values)
        except (ValueError, TypeError, KeyError) as error:
            mark = Mark(str(file), number)
            sentence = f"not a line of this table: {error}"
            raise InputError([Finding(mark, "E004", sentence, "choose another --out")]) from None
        rows[row.key] = row
    return rows


def _runs(entries: Sequence[Entry], options: TableOptions) -> Iterator[Run]:
    """The runs as they come to their ends."""
    if len(entries) < 2 or (options.jobs == 1 and len(entries) <= RUNS_PER_PROCESS):
        for entry in entries:
            yield _run_and_draw((entry, options.out))
        return
    pool = get_context("spawn").Pool(options.jobs, maxtasksperchild=RUNS_PER_PROCESS)
    try:
        yield from pool.imap_unordered(_run_and_draw, [(entry, options.out) for entry in entries])
    finally:
        pool.terminate()
        pool.join()


def _run_and_draw(given: tuple[Entry, Path]) -> Run:
    entry, out = given
    story = carry_out(entry)
    if not story.run.success:
        folder = out / PICTURES
        folder.mkdir(exist_ok=True)
        plan, _ = entry.setup.plan(entry.case, entry.trial)
        name = re.sub(r"[^\w.=-]+", "-", " ".join(map(str, entry.key)))
        draw_story(folder / f"{name}.png", plan, story)
    return story.run
