"""Generated offices with posters on the walls, for the recognition of places."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from math import atan2, degrees
from pathlib import Path
from typing import Any

import numpy as np

from missions.bench.generation.floor_plan import WALL
from missions.bench.generation.free_space import CELL, FreeSpace
from missions.bench.generation.worlds import WorldOptions, generate
from missions.bench.goal_runs import Case
from missions.bench.layout import write_world
from stack.streams import stream
from stack.types import FloatArray, Pose2D

ROOMS = 6

SPACING = (0.8, 1.4)
"""Metres from the middle of a poster to that of the next on the same wall, least and largest."""

WIDTHS, SHAPE = (0.45, 0.8), 0.75
"""Widths of posters, metres, and their height as a share of the width."""

SPREAD, TOUR_CLEARANCE = 2.0, 0.35
"""Metres between the stops of a tour, and from a stop to the nearest obstacle."""

LEAST_HEIGHT = 0.6
"""Metres of furniture that carries posters."""

IN_FRONT, CLEARANCE_CHECKED = 0.3, 0.12
"""Metres in front of a poster at which the space is free, and how far round there."""

FEATURELESS = 0.1
"""Share of the posters that are left out, so that some walls show nothing."""


class PosterOffice:
    """An office with a picture on most walls; wallpaper and carpet are the same in all of them.

    Attributes:
        name: of the world.
        plan: walls and furniture.
        space: where the robot fits.
    """

    def __init__(self, seed: int) -> None:
        """Generate the office of a seed. Offices of different seeds share no picture."""
        self.plan = generate(WorldOptions("office", seed, rooms=ROOMS))
        self.name = f"poster_office_{seed}"
        self.space = FreeSpace(self.plan, 0.22)
        self._seed = seed

    def write(self, folder: Path) -> Case:
        """Write the world file into a folder and read it."""
        text = self.plan.text()
        for key, texture in (("walls", "wallpaper"), ("boxes", "wood")):
            for line in _lines_of(text, key):
                given = {**json.loads(line[4:]), "texture": texture}
                text = text.replace(line, f"  - {json.dumps(given)}")
        posters = "".join(f"  - {json.dumps(one)}\n" for one in self._posters())
        text += f"floor: carpet\nposters:\n{posters}"
        return write_world(text, self.name, folder / f"{self.name}.yaml")

    def poses(self, count: int, clearance: float) -> list[Pose2D]:
        """Return random poses with a distance to obstacles, metres, in random rooms."""
        random, rooms = stream(self._seed, "places asked"), self.plan.rooms
        areas = np.array([room.area for room in rooms])
        found: list[Pose2D] = []
        while len(found) < count:
            room = rooms[int(random.choice(len(rooms), p=areas / areas.sum()))]
            points = self.space.points_in(room, clearance)
            if len(points):
                x, y = points[int(random.integers(len(points)))].tolist()
                found.append(Pose2D(x, y, float(random.uniform(-np.pi, np.pi))))
        return found

    def clearance_at(self, point: Sequence[float] | FloatArray) -> float:
        """Return the distance of a point x, y to the nearest obstacle, metres."""
        x_min, y_min, _, _ = self.plan.bounds
        row, column = int((point[1] - y_min) / CELL), int((point[0] - x_min) / CELL)
        return float(self.space.clearance[row, column])

    def tour(self) -> list[Pose2D]:
        """Return poses that together show all rooms, room by room, about SPREAD apart."""
        poses = []
        for room in self.plan.rooms:
            points = self.space.points_in(room, TOUR_CLEARANCE)
            while len(points):
                x, y = points[0].tolist()
                poses.append(Pose2D(x, y, 0.0))
                points = points[np.hypot(*(points - points[0]).T) >= SPREAD]
        return poses

    def _posters(self) -> list[dict[str, Any]]:
        """Return posters on walls and on the sides of tall furniture, as a world file has them."""
        random = stream(self._seed, "posters")
        posters: list[dict[str, Any]] = []
        for begin, end, top in self._faces():
            along = end - begin
            length = float(np.hypot(*along))
            normal = np.array([-along[1], along[0]]) / length
            at = float(random.uniform(0.25, 0.6))
            while at < length - 0.25:
                room = min(WIDTHS[1], 2.0 * min(at, length - at) - 0.04, (top - 0.2) / SHAPE)
                width = round(min(float(random.uniform(*WIDTHS)), room), 2)
                middle = begin + along * at / length
                shown = width >= WIDTHS[0] - 0.1 and random.random() >= FEATURELESS
                if shown and self._is_free(middle, along / length, normal, width):
                    lowest, highest = SHAPE * width / 2.0 + 0.1, top - 0.02 - SHAPE * width / 2.0
                    height = float(random.uniform(lowest, highest))
                    posters.append(self._poster(len(posters), middle, normal, (width, height)))
                at += float(random.uniform(*SPACING))
        return posters

    def _faces(self) -> Iterator[tuple[FloatArray, FloatArray, float]]:
        """Yield the upright faces: both ends, the free side on the left, metres, and the height."""
        for begin, end in self.plan.walls:
            one, other = np.array(begin), np.array(end)
            along = (other - one) / np.hypot(*(other - one))
            aside = WALL / 2.0 * np.array([-along[1], along[0]])
            yield one + aside, other + aside, 1.0
            yield other - aside, one - aside, 1.0
        for piece in self.plan.pieces:
            if not piece.radius and piece.height >= LEAST_HEIGHT:
                corners = piece.corners  # anticlockwise: their left is inside
                for number in range(4):
                    yield corners[(number + 1) % 4], corners[number], piece.height

    def _is_free(
        self, middle: FloatArray, along: FloatArray, normal: FloatArray, width: float
    ) -> bool:
        """Whether the space before a poster is inside the rooms and free."""
        x_min, y_min, x_max, y_max = self.plan.bounds
        for share in (-0.5, 0.0, 0.5):
            x, y = middle + share * width * along + IN_FRONT * normal
            if not (x_min + 0.5 < x < x_max - 0.5 and y_min + 0.5 < y < y_max - 0.5):
                return False
            if self.clearance_at((x, y)) < CLEARANCE_CHECKED:
                return False
        return True

    def _poster(
        self, number: int, middle: FloatArray, normal: FloatArray, shape: tuple[float, float]
    ) -> dict[str, Any]:
        """Return a poster; shape: its width and the height of its centre, metres."""
        x, y = middle + 0.01 * normal
        width, height = shape
        return {
            "id": self._seed * 1000 % 900_000 + number, "at": [round(x, 3), round(y, 3)],
            "facing": f"{degrees(atan2(normal[1], normal[0])):.1f} deg",
            "height": round(height, 2), "size": [width, round(SHAPE * width, 2)],
        }  # fmt: skip


def _lines_of(text: str, key: str) -> list[str]:
    """Return the lines of a list of a world file that `FloorPlan.text` has written."""
    lines = text.splitlines()
    first = lines.index(f"{key}:") + 1
    count = next((n for n, line in enumerate(lines[first:]) if line[:2] != "  "), len(lines))
    return lines[first : first + count]
