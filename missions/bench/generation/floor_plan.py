"""Floor plans: rooms, walls with openings, furniture, people and places; written as world files."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos, degrees, sin
from typing import Any

import numpy as np

from stack.types import FloatArray, Pose2D

WALL = 0.1
"""Thickness of walls, metres."""

START_CLEARANCE = 1.5
"""Metres between the robot and everybody at the start."""

LEAST_CLEARANCE = 1.0
"""Metres; nearer, a person may begin inside the robot."""


@dataclass(frozen=True)
class Room:
    """A rectangular room: name, kind of furniture, and x_min, y_min, x_max, y_max in metres."""

    name: str
    kind: str
    bounds: tuple[float, float, float, float]

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the room, metres."""
        x_min, y_min, x_max, y_max = self.bounds
        return (x_min + x_max) / 2.0, (y_min + y_max) / 2.0

    @property
    def area(self) -> float:
        """Square metres."""
        x_min, y_min, x_max, y_max = self.bounds
        return (x_max - x_min) * (y_max - y_min)


@dataclass(frozen=True)
class Opening:
    """A doorway without a leaf.

    Attributes:
        at: its middle, metres.
        width: metres.
        across: whether one passes it along y; otherwise along x.
    """

    at: tuple[float, float]
    width: float
    across: bool

    def zone(self, depth: float) -> tuple[float, float, float, float]:
        """Return the rectangle on both sides of the opening that furniture keeps clear."""
        (x, y), half = self.at, self.width / 2.0 + 0.15
        dx, dy = (half, depth) if self.across else (depth, half)
        return x - dx, y - dy, x + dx, y + dy


@dataclass(frozen=True)
class Piece:
    """A piece of furniture: a box, or a cylinder if it has a radius.

    Attributes:
        pose: of its centre.
        size: length and width, metres. height: metres.
        radius: of a cylinder, metres; 0 for a box.
        on_map: whether maps show it.
    """

    name: str
    pose: Pose2D
    size: tuple[float, float]
    height: float
    radius: float = 0.0
    on_map: bool = True

    @cached_property
    def corners(self) -> FloatArray:
        """Corners (4, 2) of its outline or of the square around a cylinder, metres."""
        length, width = self.size if not self.radius else (2.0 * self.radius, 2.0 * self.radius)
        signs = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        return self.pose.transform(signs * (length, width))

    @cached_property
    def extent(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of the corners, metres."""
        x, y = self.corners.T.tolist()
        return min(x), min(y), max(x), max(y)


@dataclass
class FloorPlan:
    """A generated world.

    Attributes:
        walls: centre lines, each from a point to a point, metres.
        pieces: the furniture.
        people: entries of the world file's `people`.
        places: name -> pose; the first is the start.
        bounds: of the map, metres.
    """

    name: str
    doc: str
    walls: list[tuple[tuple[float, float], tuple[float, float]]] = field(default_factory=list)
    rooms: list[Room] = field(default_factory=list)
    openings: list[Opening] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    people: list[dict[str, Any]] = field(default_factory=list)
    places: dict[str, Pose2D] = field(default_factory=dict)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds of the walls with half a metre around them, metres."""
        points = np.array(self.walls).reshape(-1, 2)
        (x_min, y_min), (x_max, y_max) = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
        return float(x_min), float(y_min), float(x_max), float(y_max)

    def wall(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Add a wall along x or y, with the gaps of the openings that lie on it."""
        along_x = begin[1] == end[1]
        axis = 0 if along_x else 1
        line = begin[1 - axis]
        gaps = sorted(
            (opening.at[axis] - opening.width / 2.0, opening.at[axis] + opening.width / 2.0)
            for opening in self.openings
            if opening.across is along_x
            and abs(opening.at[1 - axis] - line) < 1e-6
            and begin[axis] < opening.at[axis] < end[axis]
        )
        here = begin[axis]
        for low, high in [*gaps, (end[axis], end[axis])]:
            if low - here > 1e-6:
                first, last = (here, line), (low, line)
                self.walls.append((first, last) if along_x else (first[::-1], last[::-1]))
            here = high

    def hide(self, share: float, random: np.random.Generator) -> None:
        """Leave a share of the furniture out of maps, chosen at random."""
        count = round(share * len(self.pieces))
        for number in random.permutation(len(self.pieces))[:count]:
            self.pieces[number] = replace(self.pieces[number], on_map=False)

    def keep_clear(self, at: Pose2D) -> None:
        """Let everybody begin at least START_CLEARANCE from a pose, or as far as their way leads.

        Who stays within LEAST_CLEARANCE all the way is left out.
        """
        kept = []
        for person in self.people:
            shares = (person["start"] + np.arange(10) / 10.0) % 1.0
            points = _along(np.array(person["waypoints"], dtype=np.float64), shares)
            away = np.hypot(points[:, 0] - at.x, points[:, 1] - at.y)
            clear = away >= START_CLEARANCE
            chosen = np.argmax(clear) if clear.any() else np.argmax(away)
            if away[chosen] >= LEAST_CLEARANCE:
                kept.append({**person, "start": round(float(shares[chosen]), 2)})
        self.people = kept

    def turned(self, quarter: int) -> FloorPlan:
        """Return the plan turned by quarters about the origin, without people."""
        angle = quarter % 4 * np.pi / 2.0
        c, s = round(cos(angle)), round(sin(angle))

        def point(at: tuple[float, float]) -> tuple[float, float]:
            return c * at[0] - s * at[1], s * at[0] + c * at[1]

        def pose(at: Pose2D) -> Pose2D:
            return Pose2D(0.0, 0.0, angle).compose(at)

        def rectangle(room: Room) -> Room:
            (a, b), (d, e) = point(room.bounds[:2]), point(room.bounds[2:])
            return replace(room, bounds=(min(a, d), min(b, e), max(a, d), max(b, e)))

        return FloorPlan(
            self.name, self.doc,
            [(point(begin), point(end)) for begin, end in self.walls],
            [rectangle(room) for room in self.rooms],
            [
                Opening(point(o.at), o.width, o.across if quarter % 2 == 0 else not o.across)
                for o in self.openings
            ],
            [replace(piece, pose=pose(piece.pose)) for piece in self.pieces],
            [],
            {name: pose(at) for name, at in self.places.items()},
        )  # fmt: skip

    def text(self, start: str = "") -> str:
        """Return the world file; the robot starts at a place, or else at the first one."""
        document: dict[str, Any] = {
            "world": self.name,
            "format": 1,
            "doc": self.doc,
            "bounds": [round(edge, 3) for edge in self.bounds],
            "start": start or next(iter(self.places)),
            "places": {name: _pose(at) for name, at in self.places.items()},
            "walls": [
                {"points": [_point(begin), _point(end)], "thickness": WALL}
                for begin, end in self.walls
            ],
            "boxes": [_box(piece) for piece in self.pieces if not piece.radius],
            "cylinders": [_cylinder(piece) for piece in self.pieces if piece.radius],
            "people": self.people,
        }
        return world_text(document)


def world_text(document: dict[str, Any]) -> str:
    """Return a world file with one line for each place and each thing."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            lines += [f"{key}:", *(f"  - {json.dumps(item)}" for item in value)]
        elif isinstance(value, dict):
            lines += [f"{key}:", *(f"  {name}: {json.dumps(at)}" for name, at in value.items())]
        else:
            lines.append(f"{key}: {json.dumps(value)}")
    return "\n".join(lines) + "\n"


def _along(loop: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the points (k, 2) at shares of the length of a closed polyline (n, 2)."""
    closed = np.vstack([loop, loop[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    return np.column_stack([np.interp(shares * length[-1], length, closed[:, i]) for i in (0, 1)])


def _point(at: tuple[float, float]) -> list[float]:
    return [round(at[0], 3), round(at[1], 3)]


def _pose(at: Pose2D) -> list[Any]:
    return [round(at.x, 3), round(at.y, 3), f"{degrees(at.heading):.2f} deg"]


def _box(piece: Piece) -> dict[str, Any]:
    length, width = piece.size
    return {
        "name": piece.name, "at": _pose(piece.pose),
        "size": [round(length, 3), round(width, 3), piece.height], "on_map": piece.on_map,
    }  # fmt: skip


def _cylinder(piece: Piece) -> dict[str, Any]:
    return {
        "name": piece.name, "at": _point((piece.pose.x, piece.pose.y)),
        "radius": round(piece.radius, 3), "height": piece.height, "on_map": piece.on_map,
    }  # fmt: skip
