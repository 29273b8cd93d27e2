"""Worlds by kind, seed and options, the same in every process."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.random import Generator

from missions.bench.generation.corridor_plans import FLAT, OFFICE, corridor_plan, hotel_plan
from missions.bench.generation.floor_plan import FloorPlan, Room
from missions.bench.generation.free_space import FreeSpace
from missions.bench.generation.halls import corridor_only, warehouse_plan
from stack.errors import InputError
from stack.streams import stream
from stack.types import Pose2D

KINDS = ("flat", "office", "warehouse", "hotel", "twin", "corridor")
"""`hotel` has a mapped difference between the halves of its corridor, `twin` has none."""

PLACE_CLEARANCE = 0.4
"""Distance of places to obstacles, metres; a robot of up to this radius can turn there."""

PLACE_AREA = 30.0
"""Square metres of a room for each place after the first."""

PERSON_CLEARANCE = 0.3
"""Distance of people's ways to walls and furniture, metres."""


@dataclass(frozen=True)
class WorldOptions:
    """What a generated world contains.

    Attributes:
        kind: one of KINDS.
        seed: of its random stream.
        rooms: number of rooms, or of rows of shelves; 0: drawn.
        people: number of people.
        unmapped: share of the furniture that maps do not show, 0 to 1.
        radius: inscribed radius of the robot that must reach every room, metres.
    """

    kind: str
    seed: int
    rooms: int = 0
    people: int = 0
    unmapped: float = 0.0
    radius: float = 0.22

    @property
    def name(self) -> str:
        """Name of the world and of its file."""
        extra = f"_{self.rooms}r" if self.rooms else ""
        extra += f"_{self.people}p" if self.people else ""
        extra += f"_{round(100 * self.unmapped)}u" if self.unmapped else ""
        return f"{self.kind}_{self.seed}{extra}"


def generate(options: WorldOptions) -> FloorPlan:
    """Return the floor plan of a world.

    People and the choice of unmapped furniture have streams of their own: the walls and the
    furniture of a kind and seed are the same with all of them.

    Raises:
        InputError: an option is out of its range.
    """
    _check(options)
    kind, seed = options.kind, options.seed
    plan = _plan(options, stream(seed, f"world {kind}"))
    if kind in ("flat", "office", "warehouse"):
        plan = plan.turned(int(stream(seed, "turn").integers(4)))
    space = FreeSpace(plan, options.radius)
    _add_places(plan, space, stream(seed, f"places {kind}"))
    plan.hide(options.unmapped, stream(seed, f"unmapped {kind}"))
    _add_people(plan, space, options.people, stream(seed, f"people {kind}"))
    return plan


def _check(options: WorldOptions) -> None:
    if options.kind not in KINDS:
        raise InputError(f"no kind of world {options.kind!r}; choose one of {', '.join(KINDS)}")
    if options.rooms and not 2 <= options.rooms <= 40:
        raise InputError(f"--rooms {options.rooms}: expected 2 to 40, or 0 for a drawn number")
    if not 0.0 <= options.unmapped <= 1.0:
        raise InputError(f"--unmapped {options.unmapped:g}: expected a share from 0 to 1")
    if not 0 <= options.people <= 50:
        raise InputError(f"--people {options.people}: expected 0 to 50")


def _plan(options: WorldOptions, random: Generator) -> FloorPlan:
    kind, name, radius = options.kind, options.name, options.radius
    if kind == "corridor":
        return corridor_only(name, radius, random)
    if kind == "warehouse":
        drawn = int(random.integers(2, 5))
        return warehouse_plan(name, options.rooms or drawn, radius, random)
    if kind in ("hotel", "twin"):
        drawn = 2 * int(random.integers(3, 6))
        count = (options.rooms + 1) // 2 * 2 or drawn
        return hotel_plan(name, count, radius, random, with_difference=kind == "hotel")
    style = FLAT if kind == "flat" else OFFICE
    drawn = int(random.integers(style.rooms[0], style.rooms[1] + 1))
    return corridor_plan(name, style, options.rooms or drawn, radius, random)


def _add_places(plan: FloorPlan, space: FreeSpace, random: Generator) -> None:
    """Add a place in each room, in which the robot can turn; in large ones more than one.

    A small room full of furniture has none.
    """
    for room in plan.rooms:
        points = space.points_in(room, PLACE_CLEARANCE)
        if not points.size:
            points = space.points_in(room, 0.0)
        if not points.size:
            continue
        for number in range(1 + min(5, int(room.area / PLACE_AREA))):
            x, y = points[int(random.integers(len(points)))].round(3).tolist()
            name = f"{room.name}_{number + 1}" if number else room.name
            plan.places[name] = Pose2D(x, y, round(float(random.uniform(-pi, pi)), 3))


def _add_people(plan: FloorPlan, space: FreeSpace, count: int, random: Generator) -> None:
    """Add people with loops: back and forth through a room, along the corridor, or both."""
    rooms = sorted(plan.rooms, key=lambda room: -room.area)
    for number in range(count):
        loop = _loop(rooms[number % len(rooms)], space, random)
        if loop:
            plan.people.append({
                "name": f"person {number + 1}",
                "waypoints": loop,
                "speed": round(random.uniform(0.5, 1.1), 2),
                "pause": round(random.uniform(0.0, 4.0), 1),
                "start": round(random.uniform(0.0, 0.99), 2),
            })  # fmt: skip


def _loop(room: Room, space: FreeSpace, random: Generator) -> list[Any]:
    """Return waypoints whose straight lines are clear; the last leads back to the first."""
    points = space.points_in(room, PERSON_CLEARANCE)
    best: list[Any] = []
    for _ in range(30):
        if len(points) < 2:
            break
        way = [points[int(random.integers(len(points)))]]
        for _ in range(20):
            there = points[int(random.integers(len(points)))]
            if np.hypot(*(there - way[-1])) > 0.8 and space.is_clear(way[-1], there, 0.25):
                way.append(there)
            if len(way) == 4:
                break
        if len(way) >= 2:
            back = way if space.is_clear(way[-1], way[0], 0.25) else [*way, *way[-2:0:-1]]
            best = [point.round(2).tolist() for point in back]
            if len(way) >= 3:
                break
    return best
