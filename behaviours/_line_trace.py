"""Centre line of a line on the floor, traced from a starting point through the cells of a picture.

A front moves along the line's cells, two cells at a time, as in a breadth-first search. The middles
of the fronts are the centre line; where a front splits, the line branches. This is the Reeb graph
of the distance along the line (S. Biasotti et al., "Reeb graphs for shape analysis and
applications", Theoretical Computer Science 392, 2008).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from math import atan2, cos, hypot, pi, sin
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, FloorLines, wrap_angle

Cells = NDArray[np.int64]
H = TypeVar("H", float, float | None)

STEP = 2
"""Cells by which a front moves; holes of one cell do not stop it."""

BRANCH = 0.25
"""Metres of line beyond a junction that make a branch; shorter ones are arms of an end mark."""

ARM = 0.03
"""Metres beyond the line's width that an end mark sticks out to each side, at least."""

REACH = 2.6
"""Metres of line that are traced."""

TANGENT, SHORTEST_TANGENT = 0.15, 0.1
"""Metres of line that give its direction, and that are needed at least."""

BEYOND, FAN = 0.06, (-0.6, 0.0, 0.6)
"""Metres and radians ahead of the end of a line that must have been seen for it to end there."""

BRIDGE_ANGLE = 0.45
"""Radians between the line before a gap and the way across it, at most (26 degrees)."""

ACROSS, ACROSS_RADIUS = 0.5, 0.15
"""Cosine of the angle between a direction and a line across it, at most; metres of line around a
point that give its direction there."""

NARROW = 1.2
"""Fronts that are narrower, in widths of the line, have one part."""

WIDENED = 1.3
"""Fronts before a junction that are wider than this, in widths of the strand, are in it already;
their middle is off the line."""

BACK = 0.25
"""Metres behind the starting point that are not traced."""


Choose = Callable[[FloatArray, FloatArray, FloatArray], int]
"""Returns the number of the branch to follow, from the position (2,) of a junction, the turns (k,)
of its branches against the line (radians, positive to the left), and a point (k, 2) on each."""

BRANCH_TANGENT = (0.06, 0.26)
"""Metres along a branch between which its direction is measured, clear of the junction."""


class LineEnd(Enum):
    """How a traced line ends."""

    OPEN = "open"
    """It leaves what was seen, or is longer than what is traced."""
    CLOSED = "closed"
    MARK = "mark"


@dataclass(frozen=True)
class Sector:
    """Where to look for a line, around a point and a direction.

    Attributes:
        reach: metres.
        half_angle: to both sides of the direction, radians.
        along: whether the line found must lead on in about the direction, not across it.
    """

    reach: float
    half_angle: float
    along: bool = True


@dataclass(frozen=True)
class LineTrace:
    """A centre line.

    Attributes:
        points: (n, 2) odom frame, metres, about 2 cm apart except across gaps.
        end: how it ends.
        junctions: (k, 2) where it branches, in order, odom frame.
    """

    points: FloatArray
    end: LineEnd
    junctions: FloatArray


@dataclass
class _Strand:
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
    branches: list[_Strand] = field(default_factory=list)
    is_open: bool = False

    def add(self, point: FloatArray, width: float) -> None:
        if self.points:
            self.length += float(np.linalg.norm(point - self.points[-1]))
        self.points.append(point)
        self.widths.append(width)

    @property
    def reach(self) -> float:
        """Length with the longest of its branches, metres."""
        return self.length + max((branch.reach for branch in self.branches), default=0.0)

    @property
    def goes_on(self) -> bool:
        """Whether it is long enough for a branch, or may be."""
        if self.reach >= BRANCH or self.is_open:
            return True
        return any(branch.goes_on for branch in self.branches)


class _Tracer:
    """Fronts on the cells of a grid, flattened, with a margin of cells without a line."""

    def __init__(self, lines: FloorLines, width: float, gap: float) -> None:
        self._lines, self._width, self._gap = lines, width, gap
        self._free = np.pad(lines.marked, STEP).ravel()
        self._columns = lines.marked.shape[1] + 2 * STEP
        around = np.arange(-STEP, STEP + 1)
        self._around = (self._columns * around[:, None] + around).ravel()

    def near(self, point: FloatArray, radius: float) -> Cells:
        """Return the cells with a line within a distance of a point, odom frame."""
        cells = self._all()
        near: Cells = cells[np.linalg.norm(self._points(cells) - point, axis=1) <= radius]
        return near

    def nearest(self, point: FloatArray, heading: float, sector: Sector) -> Cells:
        """Return the cells around the nearest one in a sector; empty if there is none."""
        cells = self._all()
        away = self._points(cells) - point
        distances = np.hypot(away[:, 0], away[:, 1])
        bearings = np.arctan2(away[:, 1], away[:, 0]) - heading
        bearings = np.abs((bearings + pi) % (2.0 * pi) - pi)
        within = (distances <= sector.reach) & (bearings <= sector.half_angle)
        if not within.any():
            return cells[:0]
        first = cells[within][np.argmin(distances[within])]
        middle = self._points(np.array([first]))[0]
        if sector.along and self._is_across(middle, heading):
            return cells[:0]
        return self.near(middle, 0.5 * self._width)

    def _is_across(self, point: FloatArray, heading: float) -> bool:
        """Return whether the line at a point runs across a direction."""
        around = self._points(self.near(point, ACROSS_RADIUS)) - point
        if len(around) < 3:
            return False
        _, axes = np.linalg.eigh(np.cov(around.T))
        return abs(float(axes[:, -1] @ [cos(heading), sin(heading)])) < ACROSS

    def remove(self, points: FloatArray, radius: float) -> None:
        """Take the line off the cells within a distance of points, odom frame."""
        cells = self._all()
        if len(cells) and len(points):
            away = self._points(cells)[:, None] - points
            self._free[cells[np.any((away**2).sum(axis=2) <= radius**2, axis=1)]] = False

    def remove_behind(self, point: FloatArray, heading: float) -> None:
        """Take the line off the cells close behind a point."""
        cells = self.near(point, BACK)
        ahead = (self._points(cells) - point) @ [cos(heading), sin(heading)]
        self._free[cells[ahead < -0.5 * self._lines.cell]] = False

    def grow(self, front: Cells, reach: float, heading: float | None) -> _Strand:
        """Return the strand from a front on, with all that branches from it.

        Args:
            front: cells.
            reach: metres of line to trace.
            heading: direction of a strand that is too short to have one, odom frame; None: such a
                strand ends at its end.
        """
        strand = _Strand()
        self._free[front] = False
        while True:
            strand.add(self._points(front).mean(axis=0), self._width_of(front))
            if strand.length > reach:
                strand.is_open = True
                return strand
            after = self._advanced(front)
            if not len(after):
                self._end(strand, reach - strand.length, heading)
                return strand
            parts = self._parts(after)
            if len(parts) > 1:
                strand.branches = [self.grow(part, reach - strand.length, None) for part in parts]
                return strand
            front = after

    def _end(self, strand: _Strand, reach: float, heading: float | None) -> None:
        """Look what is beyond a strand: unseen floor, a gap and more line, or floor."""
        last = strand.points[-1]
        if not self._is_seen(_beyond(strand)).all():
            strand.is_open = True
            return
        heading = _heading(strand, heading)
        if heading is None:
            return
        front = self.nearest(last, heading, Sector(self._gap, BRIDGE_ANGLE))
        if len(front):
            strand.branches = [self.grow(front, reach, heading)]

    def _is_seen(self, points: FloatArray) -> NDArray[np.bool_]:
        lines = self._lines
        columns, rows = np.floor((points - lines.corner) / lines.cell).astype(np.int64).T
        height, width = lines.seen.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        seen: NDArray[np.bool_] = (
            inside & lines.seen[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
        )
        return seen

    def _all(self) -> Cells:
        return np.flatnonzero(self._free)

    def _points(self, cells: Cells) -> FloatArray:
        rows, columns = np.divmod(cells, self._columns)
        return self._lines.points(np.column_stack([rows, columns]) - STEP)

    def _advanced(self, front: Cells) -> Cells:
        reached = (front[:, None] + self._around).ravel()
        after: Cells = np.unique(reached[self._free[reached]])
        self._free[after] = False
        return after

    def _width_of(self, front: Cells) -> float:
        rows, columns = np.divmod(front, self._columns)
        return float(self._lines.cell * (max(np.ptp(rows), np.ptp(columns)) + 1))

    def _parts(self, front: Cells) -> list[Cells]:
        """Return the connected parts of a front."""
        if self._width_of(front) <= NARROW * self._width:
            return [front]
        rows, columns = np.divmod(front, self._columns)
        touching = np.maximum(
            np.abs(rows[:, None] - rows), np.abs(columns[:, None] - columns)
        ) <= STEP  # fmt: skip
        labels = np.arange(len(front))
        while True:
            lowest = np.where(touching, labels, len(front)).min(axis=1)
            if np.array_equal(lowest, labels):
                break
            labels = lowest
        return [front[labels == label] for label in np.unique(labels)]


def trace_line(  # noqa: PLR0913 - where it begins, what it looks like, what is chosen
    lines: FloorLines, start: FloatArray, heading: float, sector: Sector,
    choose: Choose, *, width: float, gap: float,
    passed: FloatArray | None = None,
) -> LineTrace | None:  # fmt: skip
    """Return the line from a starting point on; None if there is none.

    Args:
        lines: cells around the robot.
        start: (2,) where the line is looked for, odom frame.
        heading: in which direction it is followed, odom frame, radians.
        sector: ahead of the start, where it is looked for if it is not at the start.
        choose: chooses a branch at each junction.
        width: of the line, metres.
        gap: longest gap that is bridged, metres.
        passed: (n, 2) line that is not followed again, odom frame.
    """
    tracer = _Tracer(lines, width, gap)
    if passed is not None:
        tracer.remove(passed, 1.5 * width)
    tracer.remove_behind(start, heading)
    front = tracer.near(start, 0.6 * width)
    if not len(front):
        front = tracer.nearest(start, heading, sector)
    if not len(front):
        return None
    return _followed(tracer.grow(front, REACH, heading), heading, choose, width)


def _followed(strand: _Strand, heading: float, choose: Choose, width: float) -> LineTrace:
    """Return the centre line through the branches that are chosen."""
    points = _middles(strand)
    junctions: list[FloatArray] = []
    while strand.branches:
        heading = _heading(strand, heading)
        corner = strand.points[-1]
        going = [n for n, branch in enumerate(strand.branches) if branch.goes_on]
        if not going:
            if _is_mark(strand.branches, corner, heading, width + ARM):
                return _trace([*points, corner], LineEnd.MARK, junctions)
            going = [int(np.argmax([branch.reach for branch in strand.branches]))]
        chosen = going[0]
        if len(going) > 1:
            junctions.append(corner)
            chords = np.array([_beginning(strand.branches[n]) for n in going])
            x, y = (chords[:, 1] - chords[:, 0]).T
            turns = np.array([wrap_angle(turn) for turn in np.arctan2(y, x) - heading])
            chosen = going[choose(corner, turns, chords[:, 1])]
        strand = strand.branches[chosen]
        points += _middles(strand)
    end = LineEnd.OPEN if strand.is_open else LineEnd.CLOSED
    return _trace(points or [strand.points[-1]], end, junctions)


def _middles(strand: _Strand) -> list[FloatArray]:
    """Return the points of a strand up to where it widens into a junction."""
    if len(strand.branches) < 2:
        return strand.points
    narrow = np.array(strand.widths) <= WIDENED * np.median(strand.widths)
    return strand.points[: int(np.flatnonzero(narrow)[-1]) + 1]


def _trace(points: list[FloatArray], end: LineEnd, junctions: list[FloatArray]) -> LineTrace:
    return LineTrace(np.array(points), end, np.array(junctions).reshape(-1, 2))


def _is_mark(branches: list[_Strand], corner: FloatArray, heading: float, length: float) -> bool:
    """Return whether short arms on both sides make the mark at the end of a line."""
    left = np.array([-sin(heading), cos(heading)])
    tips = np.array([(branch.points[-1] - corner) @ left for branch in branches])
    return bool(tips.max() >= length and tips.min() <= -length)


def _heading(strand: _Strand, otherwise: H) -> float | H:
    """Return the direction of the end of a strand, or another one if it is too short."""
    points = np.array(_middles(strand))
    away = np.linalg.norm(points - points[-1], axis=1)
    before = np.flatnonzero(away >= TANGENT)
    first = points[before[-1]] if len(before) else points[int(away.argmax())]
    x, y = points[-1] - first
    return otherwise if hypot(x, y) < SHORTEST_TANGENT else atan2(y, x)


def _beyond(strand: _Strand) -> FloatArray:
    """Return points (n, 2) close beyond the end of a strand."""
    last, first = strand.points[-1], strand.points[max(len(strand.points) - 6, 0)]
    ahead = atan2(last[1] - first[1], last[0] - first[0])
    return np.array([
        last + distance * np.array([cos(ahead + turn), sin(ahead + turn)])
        for turn in FAN for distance in (0.5 * BEYOND, BEYOND)
    ])  # fmt: skip


def _beginning(branch: _Strand) -> FloatArray:
    """Return two points (2, 2) of a branch that give its direction where it begins."""
    points = np.array(branch.points)
    if len(points) < 2:
        return np.array([points[0], points[0]])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    first, last = (min(int(np.searchsorted(along, at)), len(along) - 1) for at in BRANCH_TANGENT)
    return points[[min(first, len(along) - 2), last]]
