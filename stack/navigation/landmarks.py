"""Names of places and doors, for sentences about what happened where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot

import numpy as np

from stack.planning.endpoints import xy_text
from stack.types import Pose2D

Point = tuple[float, float]

AT_PLACE, AT_DOOR = 0.05, 0.3
"""Metres within which a position is that of a place, and within which an obstacle is a door."""

NEAR = 10.0
"""Metres within which a place tells where something is."""


@dataclass(frozen=True, slots=True)
class Doorway:
    """A door that the map shows open: its name, and both ends, map frame, metres."""

    name: str
    start: Point
    end: Point

    def distance_to(self, at: Point) -> float:
        """Return the metres from a point to the closed door."""
        start, end = np.array(self.start), np.array(self.end)
        along = end - start
        share = float(np.dot(np.array(at) - start, along) / max(1e-9, float(np.dot(along, along))))
        x, y = start + min(1.0, max(0.0, share)) * along
        return hypot(at[0] - x, at[1] - y)


@dataclass(frozen=True)
class Landmarks:
    """Named places of a mission, and the doors of its map."""

    places: Mapping[str, Pose2D] = field(default_factory=dict)
    doors: Sequence[Doorway] = ()

    def name(self, pose: Pose2D) -> str:
        """Return a pose by the name of its place, as in 'dock' (0.60, 2.50)."""
        near = next((n for n, place in self._by_distance(pose.x, pose.y)
                     if place.distance_to(pose) <= AT_PLACE), None)  # fmt: skip
        return xy_text(pose) if near is None else f"{near!r} {xy_text(pose)}"

    def named(self, sentence: str, poses: Iterable[Pose2D]) -> str:
        """Return a sentence with the names of the poses of which it gives the positions."""
        for position, name in {xy_text(pose): self.name(pose) for pose in poses}.items():
            sentence = sentence.replace(position, name)
        return sentence

    def around(self, at: Point) -> str:
        """Return where a point is, as in: between 'west' and 'east'; empty without places near."""
        close = [(name, place) for name, place in self._by_distance(*at)
                 if hypot(place.x - at[0], place.y - at[1]) <= NEAR]  # fmt: skip
        if not close:
            return ""
        name, first = close[0]
        for other, place in close[1:]:
            here = (first.x - at[0]) * (place.x - at[0]) + (first.y - at[1]) * (place.y - at[1])
            if here < 0.0:  # seen from the point, on the other side
                return f"between {name!r} and {other!r}"
        return f"near {name!r}"

    def where(self, at: Point) -> str:
        """Return a point with where it is, as in: (6.5, 3.0), between 'west' and 'east'."""
        around = self.around(at)
        return f"({at[0]:.2f}, {at[1]:.2f})" + (f", {around}" if around else "")

    def door_at(self, at: Point) -> Doorway | None:
        """Return the door that an obstacle at a point is; None if it is none."""
        near = min(self.doors, key=lambda door: door.distance_to(at), default=None)
        return near if near is not None and near.distance_to(at) <= AT_DOOR else None

    def closed(self, at: Point) -> str:
        """Return what closes a way, as in: the way between 'a' and 'b' is closed at … by …"""
        around = self.around(at)
        return (
            f"the way {around}{' ' if around else ''}is closed at ({at[0]:.2f}, {at[1]:.2f}) by "
            f"{self.obstacle(at)}"
        )

    def obstacle(self, at: Point) -> str:
        """Return what is at a point where the map is free."""
        door = self.door_at(at)
        return "something that is not on the map" if door is None else f"the door {door.name!r}"

    def _by_distance(self, x: float, y: float) -> list[tuple[str, Pose2D]]:
        return sorted(
            self.places.items(), key=lambda item: hypot(item[1].x - x, item[1].y - y)
        )  # fmt: skip
