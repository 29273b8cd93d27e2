"""Warehouses with rows of shelves, and a featureless corridor."""

from __future__ import annotations

from numpy.random import Generator

from missions.bench.generation.floor_plan import FloorPlan, Opening, Piece, Room
from missions.bench.generation.free_space import FreeSpace
from missions.bench.generation.furniture import furnish, place
from stack.types import Pose2D


def warehouse_plan(name: str, rows: int, radius: float, random: Generator) -> FloorPlan:
    """Return a hall with rows of shelves, an office in a corner, and pallets.

    Args:
        name: of the world.
        rows: number of rows of shelves, at least 1.
        radius: inscribed radius of the robot, metres.
        random: random stream.
    """
    plan = FloorPlan(name, f"A hall with {rows} rows of shelves, a goods-in area and an office.")
    aisle, front = random.uniform(2.0, 2.8), random.uniform(4.0, 6.0)
    length = front + random.uniform(10.0, 16.0)
    width = rows * (aisle + 1.0) + aisle
    office = random.uniform(3.0, front - 0.8), random.uniform(2.6, min(4.0, width / 2.0))
    plan.rooms.append(Room("hall", "bay", (0.0, 0.0, length, width)))
    plan.rooms.append(Room("office", "office", (0.0, width - office[1], office[0], width)))
    door = Opening((office[0] * random.uniform(0.35, 0.65), width - office[1]), 1.0, True)
    plan.openings.append(door)
    for begin, end in (
        ((0.0, 0.0), (length, 0.0)), ((0.0, width), (length, width)),
        ((0.0, 0.0), (0.0, width)), ((length, 0.0), (length, width)),
        ((0.0, width - office[1]), (office[0], width - office[1])),
        ((office[0], width - office[1]), (office[0], width)),
    ):  # fmt: skip
        plan.wall(begin, end)
    space = FreeSpace(plan, radius)
    for row in range(rows):
        y = aisle + 0.5 + row * (aisle + 1.0)
        first = front + random.uniform(0.0, 1.0)
        cut = random.uniform(0.35, 0.65) if random.uniform() < 0.6 else 0.0
        for low, high in _parts(first, length - aisle, cut, aisle):
            pose = Pose2D((low + high) / 2.0, y)
            place(plan, Piece("shelf", pose, (high - low, 1.0), 2.0), space)
    for x in (front * 0.75, front * 0.75 + (length - front) / 2.0):
        place(plan, Piece("column", Pose2D(x, aisle * 0.45), (0.4, 0.4), 2.5), space)
    furnish(plan, plan.rooms[1], space, random)
    bay = Room("bay", "bay", (0.0, 0.0, front, width - office[1]))
    for _ in range(2):
        furnish(plan, bay, space, random)
    return plan


def corridor_only(name: str, radius: float, random: Generator) -> FloorPlan:
    """Return a straight corridor of 40 m without features between two rooms at its ends."""
    plan = FloorPlan(name, "A corridor of 40 m between two rooms, with nothing on its walls.")
    length, width = 40.0, random.uniform(1.6, 2.2)
    side = 4.0
    low = -random.uniform(0.5, side - width - 0.5)
    rooms = {
        "corridor": (0.0, 0.0, length, width),
        "west": (-side, low, 0.0, low + side),
        "east": (length, low, length + side, low + side),
    }
    plan.rooms += [Room(key, "study", bounds) for key, bounds in rooms.items()]
    plan.openings += [
        Opening((0.0, width / 2.0), width - 0.2, False),
        Opening((length, width / 2.0), width - 0.2, False),
    ]
    for x_min, y_min, x_max, y_max in rooms.values():
        plan.walls += [((x_min, y_min), (x_max, y_min)), ((x_min, y_max), (x_max, y_max))]
    for x in (-side, length + side):
        plan.wall((x, low), (x, low + side))
    for x in (0.0, length):
        plan.wall((x, low), (x, low + side))
    space = FreeSpace(plan, radius)
    for room in plan.rooms[1:]:
        furnish(plan, room, space, random)
    return plan


def _parts(begin: float, end: float, cut: float, gap: float) -> list[tuple[float, float]]:
    """Return one shelf from begin to end, or two with a gap at a share of the length."""
    if not cut:
        return [(begin, end)]
    middle = begin + cut * (end - begin)
    return [(begin, middle - gap / 2.0), (middle + gap / 2.0, end)]
