"""Generated places for the localisation: flats, offices and warehouses with unmapped furniture.

A place is drawn at 1 cm (tests/stack/localisation/drawn_office.py); its map has 5 cm cells. People
walk about. The true pose follows straight lines between points that see each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin

import numpy as np

from stack.types import Pose2D, Scan, wrap_angle
from tests.stack.localisation.drawn_office import Drifting, Place, drawn, mapped, uneven

Rectangle = tuple[float, float, float, float]
KINDS = ("flat", "office", "warehouse")
AMBIGUOUS = ("hotel", "corridor")
"""Places in which a pose cannot always be known: equal rooms, and 40 m without features."""
PERIOD = 0.1
"""Seconds between two scans."""

WALL, DOOR = 0.1, 0.9
_GONE = 0.05


def place(kind: str, seed: int, unmapped: float = 0.3) -> Place:
    """Return a random place; the share `unmapped` of its furniture is not on the map.

    The share _GONE of all pieces is on the map but gone.
    """
    generator = np.random.default_rng([seed, (*KINDS, *AMBIGUOUS).index(kind)])
    build = {
        "flat": _flat, "office": _office, "warehouse": _warehouse, "hotel": _hotel,
        "corridor": _corridor,
    }[kind]  # fmt: skip
    walls, rooms, width, depth = build(generator)
    pieces = [piece for room in rooms for piece in _furniture(room, kind, generator)]
    fate = generator.random(len(pieces))
    pieces = [_off_grid(piece) for piece in pieces]
    known = [piece for piece, one in zip(pieces, fate, strict=True) if one >= unmapped]
    there = [p for p, one in zip(pieces, fate, strict=True) if one < 1.0 - _GONE]
    walls = uneven(walls)
    return Place(
        drawn([*walls, *there], width, depth), mapped(drawn([*walls, *known], width, depth))
    )


def _off_grid(piece: Rectangle) -> Rectangle:
    return tuple(round(side, 2) for side in piece)  # type: ignore[return-value]


def _outer(width: float, depth: float) -> list[Rectangle]:
    return [
        (0.0, 0.0, width, WALL), (0.0, depth - WALL, width, depth),
        (0.0, 0.0, WALL, depth), (width - WALL, 0.0, width, depth),
    ]  # fmt: skip


def _flat(
    generator: np.random.Generator,
) -> tuple[list[Rectangle], list[Rectangle], float, float]:
    """Rooms by binary partition, a door in each wall."""
    width, depth = (round(float(generator.uniform(*s)), 1) for s in ((9.0, 13.0), (7.0, 10.0)))
    walls, rooms, todo = _outer(width, depth), [], [(0.0, 0.0, width, depth)]
    while todo:
        x0, y0, x1, y1 = todo.pop()
        across = x1 - x0 > y1 - y0
        long = max(x1 - x0, y1 - y0)
        if long < 5.0 or (long < 6.0 and generator.random() < 0.5):
            rooms.append((x0, y0, x1, y1))
            continue
        cut = float(generator.uniform(2.4, long - 2.4))
        low, high = (y0, y1) if across else (x0, x1)
        at = float(generator.uniform(low + 0.3, high - 0.3 - DOOR))
        parts = [(low, at), (at + DOOR, high)]
        if across:
            walls += [(x0 + cut, a, x0 + cut + WALL, b) for a, b in parts]
            todo += [(x0, y0, x0 + cut, y1), (x0 + cut, y0, x1, y1)]
        else:
            walls += [(a, y0 + cut, b, y0 + cut + WALL) for a, b in parts]
            todo += [(x0, y0, x1, y0 + cut), (x0, y0 + cut, x1, y1)]
    return walls, rooms, width, depth


def _office(
    generator: np.random.Generator,
) -> tuple[list[Rectangle], list[Rectangle], float, float]:
    """Rooms of different widths on both sides of a corridor."""
    width, depth, low, high = 20.0, 12.0, 5.0, 6.8
    walls, rooms = _outer(width, depth), []
    for y0, y1, side in ((0.0, low, low), (high, depth, high - WALL)):
        x = 0.0
        while x < width - 0.1:
            end = x + float(generator.uniform(2.8, 5.0))
            end = width if end > width - 2.8 else end
            rooms.append((x, y0, end, y1))
            door = float(generator.uniform(x + 0.3, end - 0.3 - DOOR))
            walls += [(x, side, door, side + WALL), (door + DOOR, side, end, side + WALL)]
            walls.append((end - WALL, y0, end, y1))
            x = end
    rooms.append((0.0, low, width, high))
    return walls, rooms, width, depth


def _warehouse(
    generator: np.random.Generator,
) -> tuple[list[Rectangle], list[Rectangle], float, float]:
    """Rows of shelves with gaps, pallets as furniture."""
    width, depth = 24.0, 16.0
    walls = _outer(width, depth)
    y = 2.2
    while y < depth - 2.5:
        x = 2.0
        while x < width - 3.0:
            length = float(generator.uniform(2.0, 6.0))
            walls.append((x, y, min(x + length, width - 2.0), y + 1.0))
            x += length + float(generator.choice([0.0, 1.5, 2.0]))
        y += float(generator.uniform(2.6, 3.4))
    return walls, [(0.0, 0.0, width, depth)], width, depth


def _hotel(
    generator: np.random.Generator,
) -> tuple[list[Rectangle], list[Rectangle], float, float]:
    """Three to five rooms with the same walls and furniture on a corridor."""
    count, wide = int(generator.integers(3, 6)), float(generator.uniform(3.3, 4.0))
    width, low, depth = count * wide + WALL, 1.8, 6.2
    walls, door = _outer(width, depth), float(generator.uniform(0.4, wide - 0.5 - DOOR))
    for n in range(count):
        x = n * wide
        walls += [
            (x, low, x + door, low + WALL), (x + door + DOOR, low, x + wide, low + WALL),
            (x + wide, low, x + wide + WALL, depth),
            (x + 0.3, depth - 1.7, x + 2.0, depth),
            (x + wide - 0.6, low + 1.4, x + wide, low + 2.4),
        ]  # fmt: skip
    return walls, [(0.0, 0.0, width, low)], width, depth


def _corridor(
    generator: np.random.Generator,
) -> tuple[list[Rectangle], list[Rectangle], float, float]:
    """40 m between walls; the lidar sees 12 m."""
    width, depth = 40.0, float(generator.uniform(1.8, 2.4))
    return _outer(width, round(depth, 2)), [], width, round(depth, 2)


def _furniture(room: Rectangle, kind: str, generator: np.random.Generator) -> Iterator[Rectangle]:
    x0, y0, x1, y1 = room
    area = (x1 - x0) * (y1 - y0)
    corridor = min(x1 - x0, y1 - y0) < 2.0
    count = generator.poisson(area / (40.0 if kind == "warehouse" else 15.0 if corridor else 4.0))
    for _ in range(count):
        a, b = generator.uniform(0.3, 0.5 if corridor else 1.8), generator.uniform(0.3, 0.7)
        if generator.random() < 0.5:
            a, b = b, a
        a, b = min(a, 0.5 * (x1 - x0)), min(b, 0.5 * (y1 - y0))
        x = generator.uniform(x0, x1 - a)
        y = generator.choice([y0, y1 - b]) if corridor else generator.uniform(y0, y1 - b)
        if generator.random() < 0.6 and not corridor:  # along a wall
            x = x0 if generator.random() < 0.5 else x1 - a
        yield float(x), float(y), float(x + a), float(y + b)


@dataclass
class Walker:
    """A person who walks to and fro on a line."""

    start: tuple[float, float]
    heading: float
    length: float
    speed: float
    radius: float = 0.2

    def at(self, time: float) -> tuple[float, float, float]:
        """Return (x, y, radius) at a time."""
        along = self.length * (0.5 - 0.5 * cos(self.speed * time / max(self.length, 0.1) * 2.0))
        x, y = self.start
        return x + along * cos(self.heading), y + along * sin(self.heading), self.radius


class Wanderer:
    """A robot that drives from point to point, with drifting odometry.

    Attributes:
        pose: true pose.
        odometry: dead reckoning.
        time: seconds.
        crowd: people who keep near the robot, so that they hide beams.
    """

    def __init__(self, place: Place, generator: np.random.Generator, people: int, crowd: int = 0):
        self.place, self.generator = place, generator
        self.pose, self.odometry = place.free_pose(generator), Drifting(generator)
        self.time, self.still = 0.0, 0.0
        self._target: Pose2D | None = None
        starts = [place.free_pose(generator) for _ in range(people)]
        self._people = [
            Walker((p.x, p.y), p.heading, float(generator.uniform(0.0, 4.0)), 1.0) for p in starts
        ]
        self._crowd = [
            (float(generator.uniform(0.5, 1.5)), float(generator.uniform(-pi, pi)),
             float(generator.uniform(-0.3, 0.3)))
            for _ in range(crowd)
        ]  # fmt: skip

    def step(self, speed: float = 0.5) -> Scan:
        """Drive for PERIOD; return the scan there."""
        self.time += PERIOD
        moved = Pose2D(0.0, 0.0)
        if self.still > 0.0:
            self.still -= PERIOD
        else:
            moved = self._towards(speed)
        self.pose = self.pose.compose(moved)
        self.odometry.move(moved, PERIOD)
        return self.scan()

    def scan(self) -> Scan:
        """Return a scan at the true pose."""
        self.place.people = [p.at(self.time) for p in self._people]
        for distance, bearing, rate in self._crowd:
            angle = bearing + rate * self.time
            self.place.people.append(
                (self.pose.x + distance * cos(angle), self.pose.y + distance * sin(angle), 0.2)
            )
        self.place.people = [p for p in self.place.people if self._is_apart(p)]
        return self.place.scan(self.pose, self.time, self.generator)

    def push(self, distance: float, angle: float) -> None:
        """Shove the robot by a distance into a free direction, and turn it; no wheel turns."""
        for _ in range(300):
            bearing = float(self.generator.uniform(-pi, pi))
            x, y = self.pose.x + distance * cos(bearing), self.pose.y + distance * sin(bearing)
            if self.place.is_clear(x, y) and self._is_free_line(x, y, 0.2):
                break
        else:
            x, y = self.pose.x, self.pose.y
        self.pose = Pose2D(x, y, wrap_angle(self.pose.heading + angle))
        self._target = None

    def kidnap(self) -> None:
        """Lift the robot to another place, at least 2 m away."""
        before = self.pose
        while self.pose.distance_to(before) < 2.0:
            self.pose = self.place.free_pose(self.generator)
        self._target = None

    def _is_apart(self, person: tuple[float, float, float]) -> bool:
        return hypot(person[0] - self.pose.x, person[1] - self.pose.y) > 0.45

    def _is_free_line(self, x: float, y: float, radius: float) -> bool:
        dx, dy = x - self.pose.x, y - self.pose.y
        count = max(2, int(hypot(dx, dy) / 0.1))
        return all(
            self.place.is_clear(self.pose.x + dx * k / count, self.pose.y + dy * k / count, radius)
            for k in range(count + 1)
        )

    def _towards(self, speed: float) -> Pose2D:
        if self._target is None or self.pose.distance_to(self._target) < 0.1:
            self._choose()
        if self._target is None:
            return Pose2D(0.0, 0.0, 0.05)
        dx, dy = self._target.x - self.pose.x, self._target.y - self.pose.y
        off = wrap_angle(atan2(dy, dx) - self.pose.heading)
        turn = float(np.clip(off, -PERIOD, PERIOD))
        return Pose2D(speed * PERIOD if abs(off) < 0.3 else 0.0, 0.0, turn)

    def _choose(self) -> None:
        self._target = None
        for _ in range(60):
            point = self.place.free_pose(self.generator)
            if self.pose.distance_to(point) > 0.8 and self._is_free_line(point.x, point.y, 0.25):
                self._target = point
                return
