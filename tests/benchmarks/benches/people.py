"""Meetings with people: in corridors, at doors, crossings, in a crowd, in an office.

A run passes when all goals are reached. Contacts are counted by who moved into whom.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from missions.bench.bench import Bench, Rows
from missions.bench.people_runs import (
    MODELS,
    PeopleCase,
    PeopleEntry,
    alone,
    check_people,
    figures,
    settings_of,
    write_shared_world,
)
from missions.execution.resources import WORLDS
from stack.documents import as_yaml, read_file
from stack.errors import InputError
from stack.sim.worlds.people import read_tracks
from stack.streams import stream
from stack.types import Pose2D
from tests.benchmarks.benches.shipped import FIRST_SEED
from tests.benchmarks.benchmark import Benchmark, Given, MoreOptions, table
from tests.benchmarks.judged import JudgedRow, impossible, run_judged
from tests.benchmarks.layouts import Layout

Point = tuple[float, float]
Line = list[Point]

WIDTHS = (1.2, 1.4, 1.6, 2.0, 2.4)
"""Widths of the corridors, metres."""

ROOM, LENGTH = 4.0, 12.0
"""Side of the rooms at both ends of a corridor, and its length, metres."""

DOOR = 0.9
"""Width of the door, metres."""

CROWD, HALL = 20, 12.0
"""Number of people in the hall, and its side, metres."""

OFFICE_PEOPLE = 5

MARGIN = 1.0
"""Metres between recorded tracks and the walls round them."""


@dataclass
class Scene:
    """A world to be written.

    Attributes:
        walls: polylines, metres. start: of the robot. goals: in turn.
        ways: way of each person; back and forth.
        start_shares: where on their way they begin, 0 to 1.
    """

    walls: list[Line]
    start: Pose2D
    goals: tuple[Pose2D, ...]
    ways: list[Line] = field(default_factory=list)
    start_shares: list[float] = field(default_factory=list)


def corridor(width: float, oncoming: int, same_way: int, random: Generator) -> Scene:
    """Return a corridor between two rooms; people walk through it from room to room."""
    middle, end = ROOM / 2.0, ROOM + LENGTH
    low, high = middle - width / 2.0, middle + width / 2.0
    outline: Line = [
        (0.0, 0.0), (ROOM, 0.0), (ROOM, low), (end, low), (end, 0.0), (end + ROOM, 0.0),
        (end + ROOM, ROOM), (end, ROOM), (end, high), (ROOM, high), (ROOM, ROOM), (0.0, ROOM),
        (0.0, 0.0),
    ]  # fmt: skip
    far = end + middle
    scene = Scene([outline], Pose2D(middle, middle), (Pose2D(far, middle),))
    for number in range(oncoming + same_way):
        side = float(random.uniform(-0.5, 0.5)) * max(0.0, width - 0.8)
        back, there = (1.0, 1.0 + float(random.uniform(0.0, 2.0))), (far, middle)
        inside = [(ROOM + 0.3, middle + side), (end - 0.3, middle + side)]
        way = [there, *reversed(inside), back] if number < oncoming else [back, *inside, there]
        scene.ways.append([(round(x, 3), round(y, 3)) for x, y in way])
        share = float(random.uniform(0.02, 0.12)) if number < oncoming else 0.17
        scene.start_shares.append(round(share + 0.05 * (number % 4), 3))
    return scene


def door(people: int, random: Generator) -> Scene:
    """Return two rooms with a door; people come through it from the other side."""
    side, gap = 5.0, DOOR / 2.0
    middle = side / 2.0
    walls: list[Line] = [
        [(0.0, 0.0), (2 * side, 0.0), (2 * side, side), (0.0, side), (0.0, 0.0)],
        [(side, 0.0), (side, middle - gap)], [(side, middle + gap), (side, side)],
    ]  # fmt: skip
    scene = Scene(walls, Pose2D(1.0, middle), (Pose2D(2 * side - 1.0, middle),))
    for number in range(people):
        y = round(float(random.uniform(0.8, side - 0.8)), 3)
        there = (2 * side - 0.8 - 0.6 * number, y)
        scene.ways.append([there, (side, middle), (0.8, side - y)])
        scene.start_shares.append(round(float(random.uniform(0.0, 0.15)), 3))
    return scene


def crossing(people: int, random: Generator) -> Scene:
    """Return two corridors of 2 m that cross; people come from the sides."""
    near, far, end = 7.0, 9.0, 16.0
    walls: list[Line] = [
        [(0.0, near), (near, near), (near, 0.0), (far, 0.0), (far, near), (end, near)],
        [(end, far), (far, far), (far, end), (near, end), (near, far), (0.0, far)],
        [(0.0, far), (0.0, near)], [(end, near), (end, far)],
    ]  # fmt: skip
    scene = Scene(walls, Pose2D(1.0, 8.0), (Pose2D(15.0, 8.0),))
    for number in range(people):
        x = round(8.0 + float(random.uniform(-0.5, 0.5)), 3)
        ends = [(x, 1.0 + 0.7 * number), (x, 15.0 - 0.7 * number)]
        scene.ways.append(ends if number % 2 == 0 else ends[::-1])
        scene.start_shares.append(round(float(random.uniform(0.0, 0.25)), 3))
    return scene


def crowd(people: int, random: Generator) -> Scene:
    """Return a hall in which people walk between random points."""
    walls: list[Line] = [[(0.0, 0.0), (HALL, 0.0), (HALL, HALL), (0.0, HALL), (0.0, 0.0)]]
    scene = Scene(walls, Pose2D(1.0, HALL / 2), (Pose2D(HALL - 1.0, HALL / 2),))
    while len(scene.ways) < people:
        points = random.uniform(0.6, HALL - 0.6, (3, 2)).round(2)
        if np.hypot(*(points[0] - (1.0, HALL / 2))) > 1.5:
            scene.ways.append([(float(x), float(y)) for x, y in points])
            scene.start_shares.append(0.0)
    return scene


COUNTS = {"1 oncoming": (1, 0), "2 oncoming": (2, 0), "4 oncoming": (4, 0), "1 ahead": (0, 1)}
"""People in a corridor: how many come towards the robot, and how many walk ahead of it."""

SCENES: dict[str, Callable[[Generator], Scene]] = {
    **{
        f"corridor {width:g} m, {text}": partial(corridor, width, *counts)
        for width in WIDTHS
        for text, counts in COUNTS.items()
    },
    **{f"door, {count} oncoming": partial(door, count) for count in (1, 2)},
    **{f"crossing, {count}": partial(crossing, count) for count in (1, 3)},
    "crowd": partial(crowd, CROWD),
}
"""Scenes by name; `office` and recorded tracks are made from files."""

OFFICE = "office"
RECORDED = "recorded "
"""Begin of the name of a scene with recorded tracks; the file follows."""


def scene_names(only: tuple[str, ...], tracks: tuple[Path, ...]) -> list[str]:
    """Return the names of the scenes that begin with one of some words; all without any.

    Raises:
        InputError: no scene begins so.
    """
    known = [*SCENES, OFFICE, *(f"{RECORDED}{path}" for path in tracks)]
    for word in only:
        if not any(name.startswith(word) for name in known):
            kinds = sorted({name.split()[0].rstrip(",") for name in known})
            raise InputError(f"no scene begins with {word!r}; there are {', '.join(kinds)}")
    return [name for name in known if not only or name.startswith(only)]


def make_scene(entry: PeopleEntry) -> PeopleCase:
    """Write the world of a scene.

    Raises:
        InputError: a file of tracks cannot be read.
    """
    random = stream(entry.seed, f"scene {entry.scene}")
    if entry.scene == OFFICE:
        return _office(entry, random)
    if entry.scene.startswith(RECORDED):
        return _recorded(entry, Path(entry.scene.removeprefix(RECORDED)), random)
    scene = SCENES[entry.scene](random)
    document = _document(entry.scene, scene.walls, scene.start)
    for number, (way, share) in enumerate(
        zip(scene.ways, scene.start_shares, strict=True), start=1
    ):
        there_and_back = [*way, *way[-2:0:-1]] if len(way) > 2 else way
        document["people"].append({
            "name": f"person {number}", "waypoints": [list(point) for point in there_and_back],
            "speed": round(float(random.uniform(0.7, 1.3)), 2), "start": share,
            **_model(entry.people),
        })  # fmt: skip
    return _written(entry, document, scene.goals)


def _model(people: str) -> dict[str, Any]:
    if people == "social_force":
        return {"model": "social_force"}
    return {"yields": people == "polite"}


def _document(name: str, walls: list[Line], start: Pose2D) -> dict[str, Any]:
    points = np.array([point for line in walls for point in line])
    low, high = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    return {
        "world": re.sub(r"\W+", "_", name), "format": 1, "doc": name,
        "bounds": [*low.tolist(), *high.tolist()], "start": [start.x, start.y, start.heading],
        "walls": [{"points": [list(point) for point in line]} for line in walls],
        "people": [],
    }  # fmt: skip


def _office(entry: PeopleEntry, random: Generator) -> PeopleCase:
    """Return the shipped office with other people, who walk between its places."""
    document = read_file(WORLDS / "office.yaml", "world file").plain()
    places = {
        name: Pose2D(x, y, float(str(turn).removesuffix(" deg")) / 180.0 * pi)
        for name, (x, y, turn) in document["places"].items()
    }
    document.pop("timeline", None)
    document["people"] = []
    for number in range(0 if entry.people == "none" else OFFICE_PEOPLE):
        chosen = random.permutation([name for name in places if name != "dock"])[:3]
        document["people"].append({
            "name": f"person {number + 1}",
            "waypoints": [[places[name].x, places[name].y] for name in chosen],
            "speed": round(float(random.uniform(0.7, 1.3)), 2),
            "pause": round(float(random.uniform(0.0, 4.0)), 1), **_model(entry.people),
        })  # fmt: skip
    goals = tuple(places[name] for name in ("desk_b", "kitchen", "reception", "dock"))
    return _written(entry, document, goals)


def _recorded(entry: PeopleEntry, file: Path, random: Generator) -> PeopleCase:
    """Return a hall round recorded tracks, which the robot crosses along its longer side."""
    try:
        tracks = read_tracks(file, 25.0, Pose2D(0.0, 0.0))
    except (OSError, ValueError) as error:
        raise InputError(f"--tracks {file}: {error}") from None
    points = np.concatenate([track[:, 1:3] for track in tracks.values()])
    left, bottom = (points.min(axis=0) - MARGIN).round(3).tolist()
    right, top = (points.max(axis=0) + MARGIN).round(3).tolist()
    walls: list[Line] = [
        [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    ]
    share = round(float(random.uniform(0.3, 0.7)), 3)
    if right - left > top - bottom:
        y = bottom + share * (top - bottom)
        start, goal = Pose2D(left + 0.6, y), Pose2D(right - 0.6, y)
    else:
        x = left + share * (right - left)
        start, goal = Pose2D(x, bottom + 0.6, pi / 2), Pose2D(x, top - 0.6, pi / 2)
    document = _document(f"recorded {file.stem}", walls, start)
    document["people"] = [{"name": "walker", "model": "recorded", "track": str(file.resolve())}]
    return _written(entry, document, (goal,), len(tracks))


def _written(
    entry: PeopleEntry, document: Mapping[str, Any], goals: tuple[Pose2D, ...], people: int = 0
) -> PeopleCase:
    """Write the world file and return the case."""
    file = write_shared_world(entry, document["world"], as_yaml(dict(document)))
    return PeopleCase(file, goals, people or len(document["people"]))


def entries_of(options: MoreOptions) -> list[PeopleEntry]:
    """Return the runs, seed by seed; recorded people react to nobody, whatever was chosen.

    Raises:
        InputError: there is no such kind of people, or no such scene.
    """
    check_people(options)
    return [
        PeopleEntry(scene, robot, model, seed, make_scene, options)
        for seed in options.seeds
        for scene in scene_names(options.names, options.files)
        for robot in options.robots
        for model in (("unaware",) if scene.startswith(RECORDED) else _models(scene, options))
    ]


def _models(scene: str, options: MoreOptions) -> list[str]:
    """Return the kinds of people of a scene: in an empty office the time is measured alone."""
    return [model for model in options.people if model != "none" or scene == OFFICE]


def table_of(rows: Sequence[JudgedRow]) -> Rows:
    """Return a row of figures for each group of scenes and kind of people."""
    found: Rows = []
    for group in dict.fromkeys(group_of(row.scene) for row in rows):
        for model in MODELS:
            own = [row for row in rows if row.people == model and group_of(row.scene) == group]
            if own:
                found.append({
                    "scene": group, "people": model, **figures(own, alone(rows)),
                    "impossible": impossible(own),
                })  # fmt: skip
    return found


def group_of(scene: str) -> str:
    """Return the group of a scene: corridors by width, the others by their first word."""
    if scene.startswith(RECORDED):
        return f"recorded {Path(scene.removeprefix(RECORDED)).stem}"
    return scene.split(",")[0]


PEOPLE = Bench(JudgedRow, entries_of, run_judged, settings_of, table_of)


def measure(given: Given) -> Rows:
    """Return a row for each group of scenes and kind of people, with seeds held out."""
    return table(PEOPLE, given.options(
        "people", given.seeds(FIRST_SEED, given["seeds"]), robots=("scout",),
        people=("none", "social_force", "unaware"),
    ))  # fmt: skip


LAYOUT = Layout({
    "scene": "{scene}", "people": "{people}", "reached": "{all goals}",
    "95 %": "{95 % interval}", "drove into": "{drove into}",
    "struck moving": "{struck moving}", "struck standing": "{struck standing}",
    "things": "{things}", "standoffs": "{standoffs}", "within 0.45 m": "{intimate}",
    "least distance": "{least distance}", "time": "{time}",
}, added={"nobody could pass": "{impossible}"})  # fmt: skip
BENCHMARKS = {
    "people": Benchmark(
        "Meetings with people", measure, ("seeds",),
        {"recording": "off", "first seed": FIRST_SEED}, LAYOUT,
    )
}  # fmt: skip
