"""Predicts meetings in corridors too narrow for two.

A robot that waits before the corridor loses less time than one that has to back out of it. Doors do
not count: who comes is through one in a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
import numpy.typing as npt

from stack.navigation.people.passing_place import LEAST_BODY
from stack.types import LETHAL_COST, CostGrid, FloatArray, Footprint, TrackedObject

LOOKAHEAD = 10.0
"""Metres of the path ahead in which people are looked for."""

TOO_LATE_WITHIN = 1.5
"""Metres of path to a person below which it is too late to wait: the drive faces them."""

WALKS_ALONG_WITHIN = 0.6
"""Metres from the path within which a person walks along it."""

COMING_SPEED = 0.3
"""m/s against the path from which a person comes towards the robot."""

OWN_SPEED = 0.4
"""Least speed in m/s with which the robot is expected to go on."""

WIDE_AROUND_MEETING = 0.5
"""Metres of path before and after the meeting that must be wide enough."""

CORRIDOR_LENGTH = 1.0
"""Length in metres from which a narrow part of the path is a corridor; a door is shorter."""

PASSING_ROOM = 0.3
"""Metres of width besides the two bodies: two who pass keep off each other and the walls."""

WIDTH_SPACING = 0.05
"""Metres between the points at which the width is measured."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """A person who comes along the path.

    Attributes:
        person: who comes, map frame.
        way: (n, 2) path between them and the robot, from them to the robot, map frame.
        seconds: until they are where the robot is now.
    """

    person: TrackedObject
    way: FloatArray
    seconds: float


def find_narrow_meeting(
    costs: CostGrid, path: FloatArray, people: Sequence[TrackedObject], speed: float,
    outline: Footprint,
) -> Meeting | None:  # fmt: skip
    """Return the first meeting on a path at a place where the robot and a person cannot pass.

    Args:
        costs: costmap, map frame.
        path: (n, 2) ahead, from the robot on, map frame.
        people: tracked, map frame.
        speed: of the robot along its path, m/s.
        outline: of the robot.
    """
    if len(path) < 2 or not people:
        return None
    places = [(person, _nearest(path, person)) for person in people]
    beside = [(person, nearest) for person, (nearest, away) in places if away <= WALKS_ALONG_WITHIN]
    if not beside:
        return None
    steps = path[1:] - path[:-1]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    found: list[Meeting] = []
    for person, nearest in beside:
        if along[nearest] < TOO_LATE_WITHIN:
            continue
        onward = steps[min(nearest, len(steps) - 1)]
        coming = -float(onward @ person.velocity) / max(float(hypot(*onward)), 1e-9)
        if coming < max(COMING_SPEED, 0.7 * person.speed):
            continue
        own = max(speed, OWN_SPEED)
        at = float(along[nearest]) * own / (own + coming)
        reach = WIDE_AROUND_MEETING + CORRIDOR_LENGTH
        samples = np.arange(at - reach, at + reach, WIDTH_SPACING)
        points = np.interp(samples, along, np.arange(len(path)))
        enough = 2.0 * (max(person.radius, LEAST_BODY) + outline.inscribed_radius) + PASSING_ROOM
        on_path = (samples >= 0.0) & (samples <= along[-1])
        if _is_corridor((widths_across(costs, path, points, enough) < enough) & on_path):
            way = path[: nearest + 1][::-1]
            found.append(Meeting(person, way, float(along[nearest]) / coming))
    return min(found, key=lambda meeting: meeting.seconds, default=None)


def _is_corridor(narrow: npt.NDArray[np.bool_]) -> bool:
    """Whether a corridor is near the middle of samples (n,) along a path, each narrow or not."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], narrow, [0]])))
    first, last = ends[::2], ends[1::2]  # of each narrow part
    middle, around = len(narrow) / 2.0, WIDE_AROUND_MEETING / WIDTH_SPACING
    near = (first < middle + around) & (last > middle - around)
    return bool((near & ((last - first) * WIDTH_SPACING >= CORRIDOR_LENGTH - WIDTH_SPACING)).any())


def _nearest(path: FloatArray, person: TrackedObject) -> tuple[int, float]:
    """Return the number of the point of a path nearest to a person, and its distance, metres."""
    x, y = person.position
    away = np.hypot(path[:, 0] - x, path[:, 1] - y)
    nearest = int(away.argmin())
    return nearest, float(away[nearest])


def widths_across(costs: CostGrid, path: FloatArray, at: FloatArray, enough: float) -> FloatArray:
    """Return the widths (k,) between lethal cells across a path, metres; at most `enough`.

    Args:
        costs: costmap, map frame.
        path: (n, 2) map frame.
        at: (k,) indices into the path, with fractions.
        enough: metres.
    """
    first = np.clip(at.astype(int), 0, len(path) - 2)
    steps = path[first + 1] - path[first]
    places = path[first] + (at - first)[:, None] * steps
    left = np.column_stack([-steps[:, 1], steps[:, 0]])
    left /= np.maximum(np.hypot(*left.T), 1e-9)[:, None]
    sideways = np.arange(0.0, enough, costs.resolution)
    widths = np.zeros(len(at))
    for side in (1.0, -1.0):
        points = places[:, None] + side * sideways[None, :, None] * left[:, None]
        cells = np.floor((points - costs.origin) / costs.resolution).astype(int)
        rows, columns = costs.cells.shape
        inside = (cells >= 0).all(axis=2) & (cells[..., 0] < columns) & (cells[..., 1] < rows)
        lethal = np.zeros(inside.shape, dtype=np.bool_)
        lethal[inside] = costs.cells[cells[inside][:, 1], cells[inside][:, 0]] == LETHAL_COST
        hit = lethal.any(axis=1)
        widths += np.where(hit, sideways[np.argmax(lethal, axis=1)], enough)
    return np.minimum(widths, enough)
