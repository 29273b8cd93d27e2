"""Furniture of rooms: kinds with their sizes, and where they stand."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.random import Generator

from missions.bench.generation.floor_plan import WALL, FloorPlan, Opening, Piece, Room
from missions.bench.generation.free_space import FreeSpace
from stack.types import Pose2D

DOOR_DEPTH = 0.8
"""Depth, metres, that furniture leaves clear on both sides of a doorway."""

OPEN_SHARE = 0.1
"""Share of each room's area in which the centre of the robot can be."""

TRIES = 12


@dataclass(frozen=True)
class Kind:
    """A kind of furniture.

    Attributes:
        size: smallest and largest length, smallest and largest width, metres; of a cylinder the
            diameter twice.
        height: metres.
        at_wall: its long side is at a wall; otherwise it stands in the room at any angle.
        chairs: chairs around it.
    """

    name: str
    size: tuple[float, float, float, float]
    height: float
    at_wall: bool = True
    is_round: bool = False
    chairs: int = 0


BED = Kind("bed", (1.9, 2.1, 0.9, 1.6), 0.5)
WARDROBE = Kind("wardrobe", (1.0, 2.2, 0.55, 0.65), 2.0)
DESK = Kind("desk", (1.2, 1.8, 0.6, 0.8), 0.74, chairs=1)
SOFA = Kind("sofa", (1.6, 2.4, 0.8, 0.95), 0.7)
SHELF = Kind("shelf", (0.6, 1.6, 0.3, 0.4), 1.8)
COUNTER = Kind("counter", (1.8, 3.2, 0.6, 0.65), 0.9)
FRIDGE = Kind("fridge", (0.6, 0.7, 0.6, 0.7), 1.8)
TUB = Kind("tub", (1.6, 1.8, 0.7, 0.8), 0.6)
BASIN = Kind("basin", (0.5, 0.7, 0.4, 0.5), 0.85)
TABLE = Kind("table", (1.0, 2.0, 0.8, 1.0), 0.74, at_wall=False, chairs=4)
COFFEE = Kind("coffee table", (0.7, 1.1, 0.5, 0.7), 0.45, at_wall=False)
ROUND = Kind("round table", (0.7, 1.1, 0.0, 0.0), 0.74, at_wall=False, is_round=True, chairs=2)
PLANT = Kind("plant", (0.3, 0.45, 0.0, 0.0), 1.2, is_round=True)
BIN = Kind("bin", (0.25, 0.35, 0.0, 0.0), 0.4, is_round=True)
BOX = Kind("box", (0.35, 0.7, 0.3, 0.5), 0.5, at_wall=False)
CABINET = Kind("cabinet", (0.8, 1.2, 0.4, 0.5), 1.2)
PALLET = Kind("pallet", (1.2, 1.2, 0.8, 0.8), 0.9, at_wall=False)
DRUM = Kind("drum", (0.55, 0.65, 0.0, 0.0), 0.9, at_wall=False, is_round=True)

ROOMS: dict[str, tuple[Kind, ...]] = {
    "bedroom": (BED, WARDROBE, SHELF, PLANT, BOX),
    "living room": (SOFA, COFFEE, SHELF, TABLE, PLANT, SOFA),
    "kitchen": (COUNTER, FRIDGE, ROUND, BIN),
    "bathroom": (TUB, BASIN, CABINET),
    "study": (DESK, SHELF, SHELF, PLANT, BOX),
    "office": (DESK, DESK, CABINET, SHELF, PLANT, BIN),
    "meeting room": (TABLE, CABINET, PLANT),
    "corridor": (CABINET, PLANT, SHELF),
    "bay": (PALLET, PALLET, DRUM, BOX),
}
"""Furniture of each kind of room, in the order in which it is placed."""


def furnish(plan: FloorPlan, room: Room, space: FreeSpace, random: Generator) -> None:
    """Place the furniture of a room; leave out what would block a door or a way."""
    for kind in ROOMS[room.kind]:
        for _ in range(TRIES):
            piece = _drawn(kind, room, random)
            if piece is not None and place(plan, piece, space):
                for chair in _chairs(kind, piece, room, random):
                    place(plan, chair, space)
                break


def place(plan: FloorPlan, piece: Piece, space: FreeSpace) -> bool:
    """Add a piece if it overlaps nothing and all rooms stay connected; return whether it did."""
    if any(_overlaps(piece, opening) for opening in plan.openings):
        return False
    if any(_distance(piece, other) < 0.02 for other in plan.pieces):
        return False
    free = space.with_piece(piece)
    if not space.is_connected(plan.rooms, free, OPEN_SHARE):
        return False
    plan.pieces.append(piece)
    space.keep(free)
    return True


def _drawn(kind: Kind, room: Room, random: Generator) -> Piece | None:
    """Return a piece at a random place of the room; None if it does not fit."""
    low, high, narrow, wide = kind.size
    length = random.uniform(low, high)
    width = length if kind.is_round else random.uniform(narrow, wide)
    x_min, y_min, x_max, y_max = (
        edge + sign * (WALL / 2.0 + 0.02)
        for edge, sign in zip(room.bounds, (1, 1, -1, -1), strict=True)
    )
    side = int(random.integers(4))
    along, angle = random.uniform(), random.uniform(-pi, pi)
    if kind.at_wall:
        dx, dy = (length, width) if side % 2 == 0 else (width, length)
        if x_max - x_min < dx or y_max - y_min < dy:
            return None
        x = x_min + dx / 2.0 + along * (x_max - x_min - dx)
        y = y_min + dy / 2.0 + along * (y_max - y_min - dy)
        if side % 2 == 0:
            y = y_min + dy / 2.0 if side == 0 else y_max - dy / 2.0
        else:
            x = x_min + dx / 2.0 if side == 3 else x_max - dx / 2.0
        heading = (0.0, pi / 2.0, pi, -pi / 2.0)[side]
    else:
        reach = np.hypot(length, width) / 2.0
        if min(x_max - x_min, y_max - y_min) < 2.0 * reach:
            return None
        x = random.uniform(x_min + reach, x_max - reach)
        y = random.uniform(y_min + reach, y_max - reach)
        # Most furniture is parallel to the walls; some stands at an angle.
        heading = 0.0 if along < 0.7 else angle
    radius = length / 2.0 if kind.is_round else 0.0
    return Piece(kind.name, Pose2D(x, y, heading), (length, width), kind.height, radius)


def _chairs(kind: Kind, piece: Piece, room: Room, random: Generator) -> list[Piece]:
    """Return the chairs around a piece that lie in the room."""
    half = piece.size[1] / 2.0 + 0.25
    if kind.chairs == 1:
        spots = [(random.uniform(-0.2, 0.2), half)]
    else:
        spots = [(side, sign * half) for sign in (-1, 1) for side in (-0.3, 0.3)][: kind.chairs]
    if piece.radius:
        spots = [(0.0, half), (0.0, -half)]
    x_min, y_min, x_max, y_max = room.bounds
    found = []
    for x, y in spots:
        at = piece.pose.compose(Pose2D(x + random.uniform(-0.08, 0.08), y))
        inside = x_min + 0.3 < at.x < x_max - 0.3 and y_min + 0.3 < at.y < y_max - 0.3
        if inside:
            found.append(Piece("chair", Pose2D(at.x, at.y), (0.4, 0.4), 0.9, 0.2))
    return found


def _overlaps(piece: Piece, opening: Opening) -> bool:
    return _gap(piece.extent, opening.zone(DOOR_DEPTH)) < 0.0


def _distance(one: Piece, other: Piece) -> float:
    """Distance of the bounding boxes, metres; negative if they overlap."""
    return _gap(one.extent, other.extent)


def _gap(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> float:
    return max(one[0] - other[2], other[0] - one[2], one[1] - other[3], other[1] - one[3])
