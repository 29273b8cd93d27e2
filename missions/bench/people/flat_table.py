"""Table of `treepilot bench flats`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median

from missions.bench.localisation.report import wilson
from missions.bench.people.flats import (
    FLATS,
    GOALS,
    MISSION,
    MODELS,
    FlatEntry,
    FlatRow,
    make_case,
    options_of,
)
from missions.bench.resumable import TableOptions, fill, record_settings
from missions.execution.prepare import prepare
from stack.errors import InputError


def flat_entries(  # noqa: PLR0913 - the options of the command
    robots: Sequence[str], people: Sequence[str], seeds: range, folder: Path,
    parameters: Mapping[str, str], keep: Path | None = None,
) -> list[FlatEntry]:  # fmt: skip
    """Return the runs, seed by seed, so that an interrupted bench has all kinds.

    Raises:
        InputError: there is no such kind of people.
    """
    for model in people:
        if model not in MODELS:
            raise InputError(f"--people {model}: choose from {', '.join(MODELS)}")
    return [
        FlatEntry(robot, model, seed, folder, parameters, keep)
        for seed in seeds
        for robot in robots
        for model in people
    ]


def measured(
    entries: Sequence[FlatEntry], options: TableOptions, log: Callable[[str], None]
) -> list[FlatRow]:
    """Make the runs that are missing in the table; return all.

    Raises:
        InputError: the folder has results of other settings.
    """
    first = {entry.key[0]: entry for entry in reversed(entries)}
    record_settings(options.out, {name: _settings(entry) for name, entry in first.items()})
    return fill(entries, options, FLATS, log)


def _settings(entry: FlatEntry) -> dict[str, object]:
    plan = prepare(MISSION, options_of(entry, make_case(entry)))
    chosen = {
        kind: {"use": choice.name, **asdict(choice.parameters)}
        for kind, choice in plan.choices.items()
    }
    return {"robot": plan.robot.name, "navigation": chosen, "parameters": dict(entry.parameters)}


def rows_of(rows: Sequence[FlatRow]) -> list[dict[str, object]]:
    """Return a row of figures for each robot and kind of people, and one for all robots."""
    robots = list(dict.fromkeys(row.robot for row in rows))
    alone = {(row.robot, row.seed): row for row in rows if row.people == "none" and row.success}
    found = []
    for model in MODELS:
        for robot in [*robots, "all"] if len(robots) > 1 else robots:
            own = [row for row in rows if row.people == model and robot in (row.robot, "all")]
            if own:
                found.append(_figures(robot, model, own, alone))
    return found


def _figures(
    robot: str, model: str, rows: Sequence[FlatRow], alone: Mapping[tuple[str, int], FlatRow]
) -> dict[str, object]:
    passed = sum(row.success for row in rows)
    low, high = wilson(passed, len(rows))
    empty = [(row, alone.get((row.robot, row.seed))) for row in rows if row.success]
    times = [row.time / other.time for row, other in empty if other is not None]
    ways = [row.driven / other.driven for row, other in empty if other is not None]
    distances = [row.least_distance for row in rows if row.least_distance is not None]
    return {
        "people": model,
        "robot": robot,
        "all four goals": f"{passed}/{len(rows)}",
        "95 % interval": f"{low:.0%} to {high:.0%}",
        "goals": f"{sum(row.visited for row in rows)}/{GOALS * len(rows)}",
        "false": sum(row.false_goals for row in rows),
        "drove into": sum(row.drove_into for row in rows),
        "struck moving": sum(row.struck_moving for row in rows),
        "struck standing": sum(row.struck_standing for row in rows),
        "things": sum(row.things for row in rows),
        "time": f"{median(times):.2f}" if times else "",
        "way": f"{median(ways):.2f}" if ways else "",
        "standoffs": sum(row.standoffs for row in rows),
        "intimate": f"{sum(row.intimate for row in rows) / max(1, len(rows)):.1f} s",
        "least distance": f"{median(distances):.2f} m" if distances else "",
    }


def report(rows: Sequence[FlatRow]) -> list[str]:
    """Return the table as lines, and a line per failure."""
    table = rows_of(rows)
    if not table:
        return []
    heads = list(table[0])
    widths = [max(len(head), *(len(str(row[head])) for row in table)) for head in heads]
    lines = ["  ".join(f"{head:<{w}}" for head, w in zip(heads, widths, strict=True)).rstrip()]
    for row in table:
        cells = (f"{row[head]!s:<{w}}" for head, w in zip(heads, widths, strict=True))
        lines.append("  ".join(cells).rstrip())
    return lines + [
        f"  {row.robot} {row.people} seed {row.seed}: {row.visited}/{GOALS} goals: {row.cause}"
        for row in rows
        if not row.success
    ]
