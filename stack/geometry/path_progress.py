"""Progress along a path that may change its driving direction, or turn back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from math import atan2, cos, pi, radians

import numpy as np

from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Path, Pose2D

SHARP, TIGHT = 0.3, 1.1
"""Metres before and after a point between which a path may turn back: at a corner, and in a U-turn.

A U-turn between lanes up to 0.5 m apart is tight. Wider ones are driven without a stop.
"""

TURNS_BACK = cos(radians(140.0))
"""Cosine of the turn above which the robot stops first; it takes smaller ones while it drives."""

LEAST_PART = 0.1
"""Metres of path before and after a point at which a path may be cut for a turn."""


@dataclass(frozen=True, slots=True)
class DirectedPath:
    """Part of a path that is driven in one direction and does not turn back.

    Attributes:
        path: poses with the robot's headings.
        backward: whether the robot reverses along it.
    """

    path: Path
    backward: bool


class PathProgress:
    """Where the robot is on its path: the segment, the metres driven and the metres left.

    A path that reverses or turns back passes the same ground twice. It is driven segment by
    segment, so that points beyond a cusp or turn count only after it has been reached.

    Attributes:
        path: the whole path.
        length: metres.
        segment: the segment that the robot drives.
    """

    segment: PathSegment

    def __init__(self, path: Path, *, directional: bool = True, steered: bool = False) -> None:
        """Start at the beginning of a path.

        Args:
            path: to follow.
            directional: whether headings determine the driving direction; not for an
                omnidirectional robot, whose paths have no cusps.
            steered: for a car, which arrives with the path's final direction as its heading.
        """
        self.path, self.length = path, path.length
        self._parts = tuple(split_at_turns(path, directional=directional))
        self._begins = (0.0, *accumulate(part.path.length for part in self._parts[:-1]))
        steps = np.linalg.norm(np.diff(path.points[:, :2], axis=0), axis=1)
        self._lengths = np.concatenate([[0.0], np.cumsum(steps)])
        self._steered, self._index = steered, -1
        self._begin_next()

    @property
    def travelled(self) -> float:
        """Metres along the path; above `length` past its end."""
        segment = self.segment
        own = segment.travelled if segment.is_last else min(segment.travelled, segment.length)
        return self._begins[self._index] + own

    @property
    def remaining(self) -> float:
        """Remaining length of the path, metres; 0 at or past its end."""
        return max(0.0, self.length - self.travelled)

    @property
    def offset(self) -> float:
        """Distance between robot and segment at the last update, metres."""
        return self.segment.offset

    @property
    def reversals(self) -> int:
        """How often the robot has still to stop and change its direction."""
        return len(self._parts) - 1 - self._index

    def advance(self, pose: Pose2D) -> None:
        """Update the progress to the point of the segment nearest to a pose of the map frame."""
        self.segment.advance(pose)

    def begin_next(self, pose: Pose2D) -> None:
        """Begin the next segment; the robot stands at the end of this one."""
        self._begin_next()
        self.segment.advance(pose)

    def ahead(self, distance: float) -> FloatArray:
        """Return the (k, 2) points of the path in its next `distance` metres, map frame."""
        travelled = self.travelled
        first = self._lengths.searchsorted(travelled)
        last = self._lengths.searchsorted(travelled + distance)
        return self.path.points[first : last + 1, :2]

    @property
    def rest(self) -> Path:
        """The path from the point nearest to the robot on."""
        first = min(self._lengths.searchsorted(self.travelled), len(self._lengths) - 2)
        limits = self.path.speed_limits
        return replace(
            self.path, points=self.path.points[first:],
            speed_limits=None if limits is None else limits[first:],
        )  # fmt: skip

    def _begin_next(self) -> None:
        self._index += 1
        part = self._parts[self._index]
        self.segment = PathSegment(
            turned(part.path) if part.backward else part.path,
            backward=part.backward,
            is_last=self._index == len(self._parts) - 1,
            steered=self._steered,
        )


def split_at_cusps(path: Path) -> tuple[DirectedPath, ...]:
    """Split a path at its cusps; each segment begins where the one before ends.

    A step is backward when it leads against the headings at both its ends. The first and the last
    heading of a path may be those of the robot and the goal. The heading there does not count where
    the neighbouring step also leads against the inner one.
    """
    steps = np.diff(path.points[:, :2], axis=0)
    moves = np.flatnonzero(np.einsum("nk,nk->n", steps, steps) > 1e-12)
    if not len(moves):
        return (DirectedPath(path, backward=False),)
    reverse = _leads_backward(steps, path.points[:, 2])[moves]
    changes = np.flatnonzero(reverse[1:] != reverse[:-1]) + 1
    begins = [0, *(int(moves[change]) for change in changes)]
    ends = [*begins[1:], len(path.points) - 1]
    directions = [bool(reverse[0]), *(bool(reverse[change]) for change in changes)]
    return tuple(
        DirectedPath(Path(path.points[begin : end + 1]), backward)
        for begin, end, backward in zip(begins, ends, directions, strict=True)
    )


def _leads_backward(steps: FloatArray, headings: FloatArray) -> FloatArray:
    """Return (n - 1,) whether each step leads backward; `headings` (n,) are those of its ends."""
    ahead = np.column_stack([np.cos(headings), np.sin(headings)])
    against_first = np.einsum("nk,nk->n", steps, ahead[:-1]) < 0.0
    against_last = np.einsum("nk,nk->n", steps, ahead[1:]) < 0.0
    found: FloatArray = against_first & against_last
    if len(steps) > 1:
        found[0] = against_last[0] and (against_first[0] or against_first[1])
        found[-1] = against_first[-1] and (against_last[-1] or against_last[-2])
    return found


def split_at_turns(path: Path, *, directional: bool = True) -> Iterator[DirectedPath]:
    """Split a path at its cusps, and where it turns back without a cusp.

    There the robot stops, and turns in place if it can. The heading at a turn belongs to the part
    that begins there; the part before ends in its own direction, or as a robot whose heading is
    free has come.

    Args:
        path: to split.
        directional: whether headings determine the driving direction.
    """
    parts = split_at_cusps(path) if directional else (DirectedPath(path, backward=False),)
    for part in parts:
        pieces = _pieces(part.path.points)
        for piece in pieces[:-1]:
            points = _facing_its_end(piece, backward=part.backward, directional=directional)
            yield DirectedPath(Path(points), part.backward)
        yield DirectedPath(Path(pieces[-1]), part.backward) if len(pieces) > 1 else part


def _pieces(points: FloatArray) -> list[FloatArray]:
    """Cut poses (n, 3) where they turn back: first at corners, then in U-turns between them."""
    corners = _cut(points, _turns(points[:, :2], SHARP))
    return [piece for part in corners for piece in _cut(part, _turns(part[:, :2], TIGHT))]


def _cut(points: FloatArray, places: list[int]) -> list[FloatArray]:
    return [points[a : b + 1] for a, b in pairwise([0, *places, len(points) - 1])]


def _turns(points: FloatArray, span: float) -> list[int]:
    """Return the indices of the points (n, 2) at which a polyline turns back within a span.

    The directions compared are those of the chords over `span` metres before and after a point:
    corners that noise makes do not count. Of neighbours the one with the longest chords counts.
    """
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    inner = np.flatnonzero((lengths >= LEAST_PART) & (lengths <= lengths[-1] - LEAST_PART))
    if not len(inner):
        return []
    here, at = points[inner], lengths[inner]
    before, after = (
        np.column_stack([np.interp(at + shift, lengths, axis) for axis in points.T]) - here
        for shift in (-span, span)
    )
    alike = np.einsum("nk,nk->n", before, after)
    turns = np.flatnonzero(alike > -TURNS_BACK * np.hypot(*before.T) * np.hypot(*after.T))
    if not len(turns):
        return []
    apart = np.flatnonzero(np.diff(at[turns]) > 0.5 * span) + 1
    return [
        int(inner[near[np.argmax(alike[near] > alike[near].max() - 1e-9)]])
        for near in np.split(turns, apart)
    ]


def _facing_its_end(points: FloatArray, *, backward: bool, directional: bool) -> FloatArray:
    """Return poses (n, 3) of which the last one has the heading in which the robot gets there."""
    steps = np.diff(points[:, :2], axis=0)
    final = np.flatnonzero(np.hypot(*steps.T))[-1]
    x, y = steps[final]
    heading = atan2(y, x) + (pi if backward else 0.0) if directional else points[final, 2]
    return np.vstack([points[:-1], [*points[-1, :2], heading]])


def turned(path: Path) -> Path:
    """Return a path with its headings rotated by 180 degrees."""
    return Path(path.points + np.array([0.0, 0.0, pi]))
