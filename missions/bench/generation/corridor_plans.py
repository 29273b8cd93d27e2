"""Flats, offices and hotels: rooms on both sides of a corridor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi

import numpy as np
from numpy.random import Generator

from missions.bench.generation.floor_plan import FloorPlan, Opening, Piece, Room
from missions.bench.generation.free_space import FreeSpace
from missions.bench.generation.furniture import furnish, place
from stack.types import Pose2D

CORNER = 0.35
"""Wall between a doorway and the corner of a room, metres."""


@dataclass(frozen=True)
class Style:
    """Sizes of a kind of building, each smallest and largest.

    Attributes:
        corridor: width of the corridor, metres.
        room: width of a room along the corridor, metres. depth: of the rooms, metres.
        door: width of a doorway, metres.
        rooms: number of rooms, if none is asked for.
        kinds: kinds of rooms, repeated in random order.
        joined: probability that a door joins two neighbouring rooms.
        end_room: probability that the corridor ends in a room.
    """

    corridor: tuple[float, float]
    room: tuple[float, float]
    depth: tuple[float, float]
    door: tuple[float, float]
    rooms: tuple[int, int]
    kinds: tuple[str, ...]
    joined: float
    end_room: float


FLAT = Style(
    (1.2, 2.0), (2.6, 4.6), (3.0, 4.6), (0.8, 1.0), (4, 10),
    ("living room", "kitchen", "bathroom", "bedroom", "study", "bedroom"), 0.25, 0.6,
)  # fmt: skip
OFFICE = Style(
    (1.6, 2.4), (3.0, 5.5), (3.6, 5.2), (0.9, 1.0), (6, 12),
    ("office", "office", "meeting room", "office", "kitchen"), 0.15, 0.3,
)  # fmt: skip


def corridor_plan(name: str, style: Style, count: int, radius: float, seed: Generator) -> FloorPlan:
    """Return a furnished flat or office.

    Args:
        name: of the world.
        style: sizes.
        count: number of rooms, at least 2.
        radius: inscribed radius of the robot, metres.
        seed: random stream.
    """
    plan = FloorPlan(name, f"A building with {count} rooms on a corridor.")
    ends_in_room = count >= 4 and seed.uniform() < style.end_room
    sided = count - ends_in_room
    south = sided // 2 + (int(seed.integers(2)) if sided % 2 else 0)
    width = seed.uniform(*style.corridor)
    rows = [n for n in (south, sided - south) if n]
    # Both sides have the same length; the mean room has a width of the style.
    length = max(rows) * seed.uniform(style.room[0] + 0.3, style.room[1] - 0.3)
    length = max(length, max(rows) * style.room[0])
    kinds = _kinds(style, count, seed)
    depths = seed.uniform(*style.depth), seed.uniform(*style.depth)
    plan.rooms.append(Room("corridor", "corridor", (0.0, 0.0, length, width)))
    for side, number in ((0, south), (1, sided - south)):
        edges = _edges(number, length, style.room[0], seed)
        y_min, y_max = (-depths[0], 0.0) if side == 0 else (width, width + depths[1])
        for low, high in pairwise(edges):
            _add_room(plan, kinds.pop(), (low, y_min, high, y_max))
            door = seed.uniform(*style.door)
            at = seed.uniform(low + CORNER + door / 2.0, high - CORNER - door / 2.0)
            plan.openings.append(Opening((at, 0.0 if side == 0 else width), door, True))
        for edge in edges[1:-1]:
            if seed.uniform() < style.joined:
                door = seed.uniform(*style.door)
                at = seed.uniform(y_min + CORNER + door, y_max - CORNER - door)
                plan.openings.append(Opening((edge, at), door, False))
    if ends_in_room:
        far = length + seed.uniform(*style.depth)
        _add_room(plan, kinds.pop(), (length, -depths[0], far, width + depths[1]))
        plan.openings.append(Opening((length, width / 2.0), seed.uniform(*style.door), False))
    _raise_walls(plan)
    space = FreeSpace(plan, radius)
    for room in sorted(plan.rooms, key=lambda room: room.name == "corridor"):
        furnish(plan, room, space, seed)
    return plan


def hotel_plan(
    name: str, count: int, radius: float, seed: Generator, *, with_difference: bool
) -> FloorPlan:
    """Return a hotel corridor with rooms that have the same walls and furniture.

    Without a difference the plan looks the same after half a turn, so that poses in opposite
    corners cannot be told apart. With it, a printer and a plant stand in the corridor.

    Args:
        name: of the world.
        count: number of rooms, even.
        radius: inscribed radius of the robot, metres.
        seed: random stream.
        with_difference: whether something mapped in the corridor tells its ends apart.
    """
    kind = "with a printer and a plant in the corridor" if with_difference else "without a mark"
    plan = FloorPlan(name, f"A hotel corridor with {count} rooms that look the same, {kind}.")
    columns = max(1, count // 2)
    width, wide, deep = seed.uniform(1.6, 2.0), seed.uniform(3.2, 3.8), seed.uniform(4.0, 4.8)
    length, door = columns * wide, seed.uniform(0.85, 1.0)
    offset = seed.uniform(0.35 + door / 2.0, wide / 2.0 - 0.2)
    middle = Pose2D(length / 2.0, width / 2.0, pi)
    turn = middle.compose(Pose2D(-length / 2.0, -width / 2.0))
    plan.rooms.append(Room("corridor", "corridor", (0.0, 0.0, length, width)))
    for n in range(columns):
        _add_room(plan, "bedroom", (n * wide, -deep, (n + 1) * wide, 0.0))
        plan.openings.append(Opening((n * wide + offset, 0.0), door, True))
    for n in range(columns):
        _add_room(plan, "bedroom", (n * wide, width, (n + 1) * wide, width + deep))
        plan.openings.append(Opening(((n + 1) * wide - offset, width), door, True))
    _raise_walls(plan)
    space = FreeSpace(plan, radius)
    for piece in _hotel_room(wide, deep):
        for n in range(columns):
            moved = replace(piece, pose=Pose2D(n * wide, 0.0).compose(piece.pose))
            place(plan, moved, space)
            place(plan, replace(moved, pose=turn.compose(moved.pose)), space)
    if with_difference:
        x = seed.uniform(0.15, 0.35) * length
        for spot in np.linspace(x, length * 0.45, 12):
            printer = Piece("printer", Pose2D(float(spot), width - 0.27), (0.6, 0.4), 1.1)
            if place(plan, printer, space):
                break
        for spot in np.linspace(0.3, length - 0.3, 30):
            if place(plan, Piece("plant", Pose2D(float(spot), 0.27), (0.4, 0.4), 1.2, 0.2), space):
                break
    return plan


def _hotel_room(wide: float, deep: float) -> list[Piece]:
    """Return the furniture of the south room whose corner at the corridor is the origin."""
    return [
        Piece("bed", Pose2D(wide - 1.1, -deep + 1.2, 0.0), (2.0, 1.6), 0.5),
        Piece("desk", Pose2D(0.4, -deep + 1.3, pi / 2.0), (1.4, 0.6), 0.74),
        Piece("wardrobe", Pose2D(wide - 0.4, -0.9, pi / 2.0), (1.2, 0.6), 2.0),
        Piece("chair", Pose2D(1.0, -deep + 1.4), (0.4, 0.4), 0.9, 0.2),
    ]


def _kinds(style: Style, count: int, random: Generator) -> list[str]:
    """Return the kinds of `count` rooms: every kind of the style before one is repeated."""
    kinds: list[str] = []
    while len(kinds) < count:
        kinds = [*random.permutation(np.array(style.kinds)).tolist(), *kinds]
    return kinds[-count:]


def _add_room(plan: FloorPlan, kind: str, bounds: tuple[float, float, float, float]) -> None:
    plan.rooms.append(Room(f"room_{len(plan.rooms)}", kind, bounds))


def _edges(count: int, length: float, least: float, random: Generator) -> list[float]:
    """Return the edges of `count` rooms along a length, each at least `least` metres wide."""
    if not count:
        return []
    parts = random.uniform(0.4, 1.0, count)
    spare = length - count * least
    widths = least + spare * parts / parts.sum()
    return [0.0, *np.cumsum(widths)[:-1].tolist(), length]


def _raise_walls(plan: FloorPlan) -> None:
    """Add the walls of all rooms; a wall that two rooms share is added once."""
    lines: dict[tuple[bool, float], list[tuple[float, float]]] = {}
    for room in plan.rooms:
        x_min, y_min, x_max, y_max = room.bounds
        for y in (y_min, y_max):
            lines.setdefault((True, round(y, 6)), []).append((x_min, x_max))
        for x in (x_min, x_max):
            lines.setdefault((False, round(x, 6)), []).append((y_min, y_max))
    for (along_x, line), spans in lines.items():
        for low, high in _merged(spans):
            begin, end = ((low, line), (high, line)) if along_x else ((line, low), (line, high))
            plan.wall(begin, end)


def _merged(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    merged: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if merged and low <= merged[-1][1] + 1e-6:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged
