"""Pieces of a traced line without branches, and how they meet."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, hypot, sin
from typing import TypeVar

import numpy as np

from stack.types import FloatArray

H = TypeVar("H", float, float | None)

LEAST_BRANCH = 0.25
"""Metres of line beyond a junction that make a branch; shorter ones are arms of an end mark."""

TANGENT, SHORTEST_TANGENT = 0.15, 0.1
"""Metres of line that give its direction, and that are needed at least."""

BEYOND, FAN = 0.06, (-0.6, 0.0, 0.6)
"""Metres and radians ahead of the end of a line that must have been seen for it to end there."""

JUNCTION_WIDTH = 1.3
"""Fronts before a junction that are wider than this, in widths of the strand, are in it already;
their middle is off the line."""

BRANCH_TANGENT = (0.06, 0.26)
"""Metres along a branch between which its direction is measured, clear of the junction."""


@dataclass
class Strand:
    """A piece of line without branches, and what follows.

    Attributes:
        points: middles of its fronts, odom frame.
        widths: of its fronts, metres.
        length: metres.
        branches: at its end.
        is_open: it ends where nothing was seen.
    """

    points: list[FloatArray] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    length: float = 0.0
    branches: list[Strand] = field(default_factory=list)
    is_open: bool = False

    def add(self, point: FloatArray, width: float) -> None:
        if self.points:
            self.length += float(np.linalg.norm(point - self.points[-1]))
        self.points.append(point)
        self.widths.append(width)

    def prolong(self, after: Strand) -> None:
        """Go on with its only branch as one strand."""
        for point, width in zip(after.points, after.widths, strict=True):
            self.add(point, width)
        self.branches, self.is_open = after.branches, after.is_open

    @property
    def reach(self) -> float:
        """Length with the longest of its branches, metres."""
        return self.length + max((branch.reach for branch in self.branches), default=0.0)

    def farthest(self, point: FloatArray) -> float:
        """Return the largest distance of it and its branches from a point (2,), metres."""
        away = float(np.linalg.norm(np.array(self.points) - point, axis=1).max())
        return max([away, *(branch.farthest(point) for branch in self.branches)])

    @property
    def goes_on(self) -> bool:
        """Whether it is long enough for a branch, or may be."""
        if self.reach >= (SHORTEST_TANGENT if self.is_open else LEAST_BRANCH):
            return True
        return any(branch.goes_on for branch in self.branches)


def middles(strand: Strand) -> list[FloatArray]:
    """Return the points of a strand up to where it widens into a junction."""
    if len(strand.branches) < 2:
        return strand.points
    narrow = np.array(strand.widths) <= JUNCTION_WIDTH * np.median(strand.widths)
    return strand.points[: int(np.flatnonzero(narrow)[-1]) + 1]


def is_mark(branches: list[Strand], corner: FloatArray, heading: float, length: float) -> bool:
    """Return whether short arms on both sides make the mark at the end of a line.

    One of them may leave what was seen.
    """
    if max(one.reach for one in branches) >= LEAST_BRANCH or all(one.goes_on for one in branches):
        return False
    left = np.array([-sin(heading), cos(heading)])
    tips = np.array([(branch.points[-1] - corner) @ left for branch in branches])
    return bool(tips.max() >= length and tips.min() <= -length)


def heading_of(strand: Strand, otherwise: H) -> float | H:
    """Return the direction of the end of a strand, or another one if it is too short.

    Before a junction, its fronts reach into the branches and lie askew.
    """
    points = np.array(middles(strand))
    if len(strand.branches) > 1:
        clear = np.linalg.norm(points - strand.points[-1], axis=1) >= BRANCH_TANGENT[0]
        points = points[clear] if clear.any() else points
    away = np.linalg.norm(points - points[-1], axis=1)
    before = np.flatnonzero(away >= TANGENT)
    first = points[before[-1]] if len(before) else points[int(away.argmax())]
    x, y = points[-1] - first
    return otherwise if hypot(x, y) < SHORTEST_TANGENT else atan2(y, x)


def beyond(strand: Strand) -> FloatArray:
    """Return points (n, 2) close beyond the end of a strand."""
    last, first = strand.points[-1], strand.points[max(len(strand.points) - 6, 0)]
    ahead = atan2(last[1] - first[1], last[0] - first[0])
    return np.array([
        last + distance * np.array([cos(ahead + turn), sin(ahead + turn)])
        for turn in FAN for distance in (0.5 * BEYOND, BEYOND)
    ])  # fmt: skip


def beginning(branch: Strand) -> FloatArray:
    """Return two points (2, 2) of a branch that give its direction where it begins.

    Ragged paint may divide it again close behind the junction; it goes on with the longest part.
    """
    strand, parts, length = branch, list(branch.points), branch.length
    while strand.branches and length < BRANCH_TANGENT[1]:
        strand = max(strand.branches, key=lambda part: part.reach)
        parts += strand.points
        length += strand.length
    points = np.array(parts)
    if len(points) < 2:
        return np.array([points[0], points[0]])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    # between the points: behind a gap the next one may be far away
    at = [min(BRANCH_TANGENT[0], along[-2]), min(BRANCH_TANGENT[1], along[-1])]
    return np.column_stack([np.interp(at, along, axis) for axis in points.T])
