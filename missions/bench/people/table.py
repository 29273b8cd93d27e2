"""Tables of `treepilot bench flats` and `treepilot bench people`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

from missions.bench.localisation.report import wilson
from missions.bench.mission_runs import MissionEntry, conditions
from missions.bench.people.flats import FLATS, MODELS, make_flat
from missions.bench.people.runs import (
    MISSION,
    PEOPLE_WORK,
    TIME_LIMIT,
    PeopleEntry,
    PeopleRow,
    options_of,
)
from missions.bench.people.scenes import OFFICE, RECORDED, make_scene
from missions.bench.resumable import TableOptions, fill, record_settings
from missions.execution.prepare import prepare
from stack.errors import InputError


def flat_entries(  # noqa: PLR0913 - the options of the command
    robots: Sequence[str], people: Sequence[str], seeds: range, folder: Path,
    parameters: Mapping[str, str], keep: Path | None = None,
) -> list[PeopleEntry]:  # fmt: skip
    """Return the runs, seed by seed, so that an interrupted bench has all kinds.

    Raises:
        InputError: there is no such kind of people.
    """
    _check(people)
    return [
        PeopleEntry(FLATS, robot, model, seed, make_flat, folder, parameters, keep)
        for seed in seeds
        for robot in robots
        for model in people
    ]


def scene_entries(  # noqa: PLR0913 - the options of the command
    scenes: Sequence[str], robots: Sequence[str], people: Sequence[str], seeds: range,
    folder: Path, parameters: Mapping[str, str], keep: Path | None = None,
) -> list[PeopleEntry]:  # fmt: skip
    """Return the runs, seed by seed; recorded people react to nobody, whatever was chosen.

    Raises:
        InputError: there is no such kind of people.
    """
    _check(people)
    return [
        PeopleEntry(scene, robot, model, seed, make_scene, folder, parameters, keep)
        for seed in seeds
        for scene in scenes
        for robot in robots
        for model in (("unaware",) if scene.startswith(RECORDED) else _models(scene, people))
    ]


def _models(scene: str, people: Sequence[str]) -> list[str]:
    """Return the kinds of people of a scene: in an empty office the time is measured alone."""
    return [model for model in people if model != "none" or scene == OFFICE]


def _check(people: Sequence[str]) -> None:
    for model in people:
        if model not in MODELS:
            raise InputError(f"--people {model}: choose from {', '.join(MODELS)}")


def measured(
    entries: Sequence[PeopleEntry], options: TableOptions, log: Callable[[str], None]
) -> list[PeopleRow]:
    """Make the runs that are missing in the table; return all.

    Raises:
        InputError: the folder has results of other settings.
    """
    some = {entry.key[0]: entry for entry in entries}
    record_settings(options.out, {name: _settings(entry) for name, entry in some.items()})
    return fill(entries, options, PEOPLE_WORK, log)


def _settings(entry: PeopleEntry) -> dict[str, object]:
    """Return the conditions of the runs in a scene, with the world and the goals of one of them.

    It is the same one for all runs, so that a table can be continued with other seeds and people.
    """
    one = replace(entry, seed=0, people="unaware")
    options = options_of(one, one.make(one))
    run = MissionEntry(str(MISSION), TIME_LIMIT, options)
    found = conditions(run, prepare(MISSION, options))
    return {**found, "parameters": dict(entry.parameters)}


def rows_of(rows: Sequence[PeopleRow]) -> list[dict[str, object]]:
    """Return a row of figures for each kind of people and robot, and one for all robots."""
    robots = list(dict.fromkeys(row.robot for row in rows))
    alone = {
        (row.scene, row.robot, row.seed): row
        for row in rows
        if row.people == "none" and row.success
    }
    found: list[dict[str, object]] = []
    for model in MODELS:
        for robot in [*robots, "all"] if len(robots) > 1 else robots:
            own = [row for row in rows if row.people == model and robot in (row.robot, "all")]
            if own:
                found.append({"people": model, "robot": robot, **_figures(own, alone)})
    return found


def scene_rows(rows: Sequence[PeopleRow]) -> list[dict[str, object]]:
    """Return a row of figures for each group of scenes and kind of people."""
    groups = list(dict.fromkeys(group_of(row.scene) for row in rows))
    alone = {
        (row.scene, row.robot, row.seed): row
        for row in rows
        if row.people == "none" and row.success
    }
    found: list[dict[str, object]] = []
    for group in groups:
        for model in MODELS:
            own = [row for row in rows if row.people == model and group_of(row.scene) == group]
            if own:
                found.append({"scene": group, "people": model, **_figures(own, alone)})
    return found


def group_of(scene: str) -> str:
    """Return the group of a scene: corridors by width, the others by their first word."""
    if scene.startswith(RECORDED):
        return f"recorded {Path(scene.removeprefix(RECORDED)).stem}"
    return scene.split(",")[0]


def _figures(
    rows: Sequence[PeopleRow], alone: Mapping[tuple[str, str, int], PeopleRow]
) -> dict[str, object]:
    passed = sum(row.success for row in rows)
    low, high = wilson(passed, len(rows))
    empty = [(row, alone.get((row.scene, row.robot, row.seed))) for row in rows if row.success]
    times = [row.time / other.time for row, other in empty if other is not None]
    ways = [row.driven / other.driven for row, other in empty if other is not None]
    distances = [row.least_distance for row in rows if row.least_distance is not None]
    return {
        "all goals": f"{passed}/{len(rows)}",
        "95 % interval": f"{low:.0%} to {high:.0%}",
        "impossible": _impossible(rows),
        "goals": f"{sum(row.visited for row in rows)}/{sum(row.goals for row in rows)}",
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


def _impossible(rows: Sequence[PeopleRow]) -> str:
    """Return how many runs nobody could have passed without a contact, of those judged."""
    judged = [row for row in rows if row.possible is not None]
    return f"{sum(not row.possible for row in judged)}/{len(judged)}" if judged else ""


def report(rows: Sequence[PeopleRow], table: Sequence[Mapping[str, object]]) -> list[str]:
    """Return a table of the rows as lines, and a line per failure."""
    if not table:
        return []
    heads = list(table[0])
    widths = [max(len(head), *(len(str(row[head])) for row in table)) for head in heads]
    lines = ["  ".join(f"{head:<{w}}" for head, w in zip(heads, widths, strict=True)).rstrip()]
    for row in table:
        cells = (f"{row[head]!s:<{w}}" for head, w in zip(heads, widths, strict=True))
        lines.append("  ".join(cells).rstrip())
    return lines + [
        f"  {row.scene}, {row.robot}, {row.people} seed {row.seed}: "
        f"{row.visited}/{row.goals} goals: {row.cause}"
        for row in rows
        if not row.success
    ]
