"""Every world by every trial, over processes; the table is written as it grows and resumed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from missions.bench.barn_crossing import Setup, cross
from missions.bench.barn_picture import draw_crossing
from missions.bench.barn_score import Crossing, per_world, summary
from missions.bench.barn_worlds import BarnWorld, find_worlds
from stack.documents import Finding, Mark
from stack.errors import InputError

TABLE, SETTINGS, PICTURES = "runs.jsonl", "settings.json", "failures"

RUNS_PER_PROCESS = 40
"""PyBullet keeps every mesh it ever loaded, some 10 MB a world, until its process ends."""


@dataclass(frozen=True)
class BenchOptions:
    """What is run.

    Attributes:
        worlds: folder or file.
        only: names of worlds; empty for all.
        trials: runs in each world; trial n has seed n.
        jobs: processes.
        out: folder of the table and the pictures.
    """

    worlds: Path
    setup: Setup
    out: Path
    only: tuple[str, ...] = ()
    trials: int = 1
    jobs: int = 1


def run_barn(options: BenchOptions, tell: Callable[[str], None]) -> list[Crossing]:
    """Run what the table does not hold yet; the crossings of all worlds and trials asked for.

    Args:
        options: what is run.
        tell: takes lines for the person who waits.

    Raises:
        InputError: no worlds, a wrong mission, or a folder with results of another setting.
    """
    cases = _chosen(find_worlds(options.worlds), options.only)
    _claim(options, tell)
    wanted = {(case.name, trial): case for trial in range(options.trials) for case in cases}
    done = {key: row for key, row in _table(options.out).items() if key in wanted}
    if done:
        tell(f"{len(done)} of {len(wanted)} runs are in {options.out / TABLE} already")
    left = [(case, trial) for (name, trial), case in wanted.items() if (name, trial) not in done]
    with (options.out / TABLE).open("a", encoding="utf-8") as table:
        for crossing in _crossings(left, options):
            table.write(json.dumps(asdict(crossing)) + "\n")
            table.flush()
            done[crossing.world, crossing.trial] = crossing
            tell(_line(crossing, len(done), len(wanted)))
    return [done[key] for key in wanted]


def report(crossings: Sequence[Crossing]) -> list[str]:
    """The whole table and the summary under it, in lines."""
    return [*per_world(crossings), "", *summary(crossings)]


def _chosen(cases: list[BarnWorld], only: tuple[str, ...]) -> list[BarnWorld]:
    unknown = [name for name in only if name not in {case.name for case in cases}]
    if unknown:
        raise InputError(f"there is no world {unknown[0]!r} among the {len(cases)} here")
    return [case for case in cases if not only or case.name in only]


def _claim(options: BenchOptions, tell: Callable[[str], None]) -> None:
    """Write down the settings, or compare them with those that the folder's results are from."""
    plan, _ = options.setup.plan(0)
    limits = asdict(plan.robot.limits)
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    settings = {
        "mission": hashlib.sha256(plan.text.encode()).hexdigest()[:16],
        "arguments": options.setup.arguments, "robot": plan.robot.name, "limits": limits,
        "navigation": chosen,
    }  # fmt: skip
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / SETTINGS
    text = json.dumps(settings, indent=2, default=str)
    if file.exists() and file.read_text("utf-8") != text:
        raise InputError(
            f"{options.out} holds results of other settings (see {SETTINGS}); choose another --out"
        )
    file.write_text(text, "utf-8")
    tell(
        f"{plan.robot.name}: {limits['linear_speed']:g} m/s, {limits['angular_speed']:g} rad/s, "
        f"+{limits['linear_acceleration']:g}/-{limits['linear_deceleration']:g} m/s², "
        f"{limits['angular_acceleration']:g} rad/s²; controller {plan.choices['controller'].name}"
    )


def _table(folder: Path) -> dict[tuple[str, int], Crossing]:
    """The runs written down so far; a last line cut off by an interruption is run again."""
    rows: dict[tuple[str, int], Crossing] = {}
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
            row = Crossing(**values)
        except (ValueError, TypeError, KeyError) as error:
            mark = Mark(str(file), number)
            sentence = f"not a line of this table: {error}"
            raise InputError([Finding(mark, "E004", sentence, "choose another --out")]) from None
        rows[row.world, row.trial] = row
    return rows


def _crossings(tasks: Sequence[tuple[BarnWorld, int]], options: BenchOptions) -> Iterator[Crossing]:
    """The runs as they come to their ends."""
    if len(tasks) < 2 or (options.jobs == 1 and len(tasks) <= RUNS_PER_PROCESS):
        for case, trial in tasks:
            yield _cross_and_draw(case, options.setup, trial, options.out)
        return
    pool = get_context("spawn").Pool(options.jobs, maxtasksperchild=RUNS_PER_PROCESS)
    try:
        given = [(case, options.setup, trial, options.out) for case, trial in tasks]
        yield from pool.imap_unordered(_cross_and_draw_packed, given)
    finally:
        pool.terminate()
        pool.join()


def _cross_and_draw_packed(given: tuple[BarnWorld, Setup, int, Path]) -> Crossing:
    return _cross_and_draw(*given)


def _cross_and_draw(case: BarnWorld, setup: Setup, trial: int, out: Path) -> Crossing:
    crossing, trace = cross(case, setup, trial)
    if not crossing.success:
        folder = out / PICTURES
        folder.mkdir(exist_ok=True)
        plan, _ = setup.plan(trial)
        picture = folder / f"{case.name}-{trial}.png"
        draw_crossing(picture, case.world, trace, plan.robot.footprint, crossing, setup.goal(plan))
    return crossing


def _line(crossing: Crossing, count: int, total: int) -> str:
    figures = f"{crossing.time:.1f} s, {crossing.driven:.1f} m, k=2 {crossing.score(2.0):.3f}"
    what = figures if crossing.success else f"{crossing.status.upper()}: {crossing.cause}"
    return f"{count:4d}/{total}  world {crossing.world} trial {crossing.trial}: {what}"
