"""Centre line of a line on the floor, traced from a starting point through the cells of a picture.

A front moves along the line's cells, two cells at a time, as in a breadth-first search. The middles
of the fronts are the centre line; where a front splits, the line branches. This is the Reeb graph
of the distance along the line (S. Biasotti et al., "Reeb graphs for shape analysis and
applications", Theoretical Computer Science 392, 2008).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from behaviours._line.strand import Strand, beginning, beyond, heading_of, is_mark, middles
from stack.types import FloatArray, FloorLines, wrap_angle

Cells = NDArray[np.int64]

FRONT_STEP = 2
"""Cells by which a front moves; holes of one cell do not stop it."""

STUB = 1.0
"""Branches that keep this near to the junction, in widths of the line, are the ragged edge of the
paint."""

LEAST_ARM = 0.03
"""Metres beyond the line's width that an end mark sticks out to each side, at least."""

TRACED_LENGTH = 2.6
"""Metres of line that are traced."""

BRIDGE_ANGLE = 0.45
"""Radians between the line before a gap and the way across it, at most (26 degrees)."""

LONGEST_UNSEEN = 0.6
"""Metres of floor that no picture showed, at most, across which the line is expected to go on: at a
sharp turn a piece of the line stays below the pictures."""

ACROSS, ACROSS_RADIUS = 0.5, 0.15
"""Cosine of the angle between a direction and a line across it, at most; metres of line around a
point that give its direction there."""

ONE_PART_WIDTH = 1.2
"""Fronts that are narrower, in widths of the line, have one part."""

UNTRACED_BEHIND = 0.25
"""Metres behind the starting point that are not traced."""


Choose = Callable[[FloatArray, FloatArray, FloatArray], int]
"""Returns the number of the branch to follow, from the position (2,) of a junction, the turns (k,)
of its branches against the line (radians, positive to the left), and a point (k, 2) on each."""


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


class _Tracer:
    """Fronts on the cells of a grid, flattened, with a margin of cells without a line."""

    def __init__(self, lines: FloorLines, width: float, gap: float) -> None:
        self._lines, self._width, self._gap = lines, width, gap
        self._free = np.pad(lines.marked, FRONT_STEP).ravel()
        self._columns = lines.marked.shape[1] + 2 * FRONT_STEP
        around = np.arange(-FRONT_STEP, FRONT_STEP + 1)
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
        cells = self.near(point, UNTRACED_BEHIND)
        ahead = (self._points(cells) - point) @ [cos(heading), sin(heading)]
        self._free[cells[ahead < -0.5 * self._lines.cell]] = False

    def grow(self, front: Cells, reach: float, heading: float | None) -> Strand:
        """Return the strand from a front on, with all that branches from it.

        Args:
            front: cells.
            reach: metres of line to trace.
            heading: direction of a strand that is too short to have one, odom frame; None: such a
                strand ends at its end.
        """
        strand = Strand()
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
                grown = [self.grow(part, reach - strand.length, None) for part in parts]
                away = [one.farthest(strand.points[-1]) for one in grown]
                strand.branches = [
                    one for one, far in zip(grown, away, strict=True) if far > STUB * self._width
                ]
                if len(strand.branches) == 1:
                    strand.prolong(strand.branches[0])
                elif not strand.branches:
                    self._end(strand, reach - strand.length, heading)
                return strand
            front = after

    def _end(self, strand: Strand, reach: float, heading: float | None) -> None:
        """Look what is beyond a strand: a gap and more line, unseen floor, or floor."""
        last = strand.points[-1]
        is_unseen = not self._is_seen(beyond(strand)).all()
        heading = heading_of(strand, heading)
        if heading is not None:
            across = max(self._gap, LONGEST_UNSEEN) if is_unseen else self._gap
            front = self.nearest(last, heading, Sector(across, BRIDGE_ANGLE))
            if len(front):
                strand.branches = [self.grow(front, reach, heading)]
                return
        strand.is_open = is_unseen

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
        return self._lines.points(np.column_stack([rows, columns]) - FRONT_STEP)

    def _advanced(self, front: Cells) -> Cells:
        reached = (front[:, None] + self._around).ravel()
        after: Cells = np.unique(reached[self._free[reached]])
        self._free[after] = False
        return after

    def _width_of(self, front: Cells) -> float:
        rows, columns = np.divmod(front, self._columns)
        extent = max(rows[-1] - rows[0], columns.max() - columns.min())  # cells are in order
        return float(self._lines.cell * (extent + 1))

    def _parts(self, front: Cells) -> list[Cells]:
        """Return the connected parts of a front."""
        if self._width_of(front) <= ONE_PART_WIDTH * self._width:
            return [front]
        rows, columns = np.divmod(front, self._columns)
        touching = np.maximum(
            np.abs(rows[:, None] - rows), np.abs(columns[:, None] - columns)
        ) <= FRONT_STEP  # fmt: skip
        parts, left = [], np.ones(len(front), dtype=np.bool_)
        while left.any():
            part, size = touching[int(left.argmax())], 0
            while (count := int(np.count_nonzero(part))) > size:
                part, size = touching[part].any(axis=0), count
            parts.append(front[part])
            left &= ~part
        return parts


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
    return _followed(tracer.grow(front, TRACED_LENGTH, heading), heading, choose, width)


def _followed(strand: Strand, heading: float, choose: Choose, width: float) -> LineTrace:
    """Return the centre line through the branches that are chosen."""
    points = middles(strand)
    junctions: list[FloatArray] = []
    while strand.branches:
        heading = heading_of(strand, heading)
        corner = strand.points[-1]
        going = [n for n, branch in enumerate(strand.branches) if branch.goes_on]
        if is_mark(strand.branches, corner, heading, width + LEAST_ARM):
            return _trace([*points, corner], LineEnd.MARK, junctions)
        if not going:
            going = [int(np.argmax([branch.reach for branch in strand.branches]))]
        chosen = going[0]
        if len(going) > 1:
            junctions.append(corner)
            chords = np.array([beginning(strand.branches[n]) for n in going])
            x, y = (chords[:, 1] - chords[:, 0]).T
            turns = np.array([wrap_angle(turn) for turn in np.arctan2(y, x) - heading])
            chosen = going[choose(corner, turns, chords[:, 1])]
        strand = strand.branches[chosen]
        points += middles(strand)
    end = LineEnd.OPEN if strand.is_open else LineEnd.CLOSED
    return _trace(points or [strand.points[-1]], end, junctions)


def _trace(points: list[FloatArray], end: LineEnd, junctions: list[FloatArray]) -> LineTrace:
    return LineTrace(np.array(points), end, np.array(junctions).reshape(-1, 2))
