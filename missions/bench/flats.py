"""Random flats and offices with people: `treepilot bench flats`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missions.bench.bench import Bench, Options, Rows
from missions.bench.generation.floor_plan import START_CLEARANCE, FloorPlan
from missions.bench.generation.worlds import WorldOptions, generate
from missions.bench.people_runs import (
    MODELS,
    PeopleCase,
    PeopleEntry,
    PeopleRow,
    alone,
    check_people,
    figures,
    run_entry,
    settings_of,
    write_shared_world,
)
from stack.streams import stream

GOALS = 4
MOST_PEOPLE = 6
UNMAPPED = 0.2
"""Share of the furniture that the map does not show."""


def make_flat(entry: PeopleEntry) -> PeopleCase:
    """Generate the world of a run, write its file, and choose start and goals.

    The walls, the furniture, the people and the goals of a seed are the same for all robots and all
    kinds of people. Everybody begins at least START_CLEARANCE from the robot, or as far as their
    way leads.
    """
    random = stream(entry.seed, "flats")
    count = int(random.integers(1, MOST_PEOPLE + 1))
    kind = "flat" if entry.seed % 2 == 0 else "office"
    plan = generate(WorldOptions(kind, entry.seed, people=count, unmapped=UNMAPPED))
    names = [str(name) for name in random.permutation(list(plan.places))]
    start, *others = names
    goals = [plan.places[(others or [start])[n % max(1, len(others))]] for n in range(GOALS)]
    _choose_people(plan, entry.people, start)
    file = write_shared_world(entry, kind, plan.text(start))
    return PeopleCase(file, tuple(goals), len(plan.people))


def _choose_people(plan: FloorPlan, model: str, start: str) -> None:
    """Give the people of a plan their model, and let nobody begin near the start.

    The start of a person on a loop is a share of its length; people who walk by social forces begin
    at a waypoint.
    """
    if model == "none":
        plan.people.clear()
    at = plan.places[start]
    plan.keep_clear(at)
    for person in plan.people:
        if model != "social_force":
            person["yields"] = model == "polite"
            continue
        person["model"] = "social_force"
        way = np.array(person["waypoints"], dtype=np.float64)
        away = np.hypot(way[:, 0] - at.x, way[:, 1] - at.y)
        number = int(person["start"] * len(way))
        if min(away[number], away[(number + 1) % len(way)]) < START_CLEARANCE:
            person["start"] = round(int(np.argmax(away)) / len(way) + 0.001, 3)


def entries_of(options: Options) -> list[PeopleEntry]:
    """Return the runs, seed by seed, so that an interrupted bench has all kinds.

    Raises:
        InputError: there is no such kind of people.
    """
    check_people(options)
    return [
        PeopleEntry("flats", robot, model, seed, make_flat, options)
        for seed in options.seeds
        for robot in options.robots
        for model in options.people
    ]


def table_of(rows: Sequence[PeopleRow]) -> Rows:
    """Return a row of figures for each kind of people and robot, and one for all robots."""
    robots = list(dict.fromkeys(row.robot for row in rows))
    found: Rows = []
    for model in MODELS:
        for robot in [*robots, "all"] if len(robots) > 1 else robots:
            own = [row for row in rows if row.people == model and robot in (row.robot, "all")]
            if own:
                found.append({"people": model, "robot": robot, **figures(own, alone(rows))})
    return found


FLATS = Bench(PeopleRow, entries_of, run_entry, settings_of, table_of)
