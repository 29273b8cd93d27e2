"""Progress along a path that may change its driving direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate
from math import pi

import numpy as np

from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Path, Pose2D


@dataclass(frozen=True, slots=True)
class DirectedPath:
    """Part of a path that is driven in one direction.

    Attributes:
        path: poses with the robot's headings.
        backward: whether the robot reverses along it.
    """

    path: Path
    backward: bool


class PathProgress:
    """Where the robot is on its path: the segment, the metres driven and the metres left.

    A path that reverses folds back on itself. It is driven segment by segment, so that points
    beyond a cusp count only after the cusp has been reached.

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
        whole = (DirectedPath(path, backward=False),)
        self._parts = split_at_cusps(path) if directional else whole
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

    def advance(self, pose: Pose2D) -> None:
        """Update the progress to the point of the segment nearest to a pose of the map frame."""
        self.segment.advance(pose)

    def begin_next(self, pose: Pose2D) -> None:
        """Begin the next segment; the robot stands at the cusp."""
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
    heading of a path may be those of the robot and the goal, so only the inner one counts there.
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
    before, after = (
        np.einsum("nk,nk->n", steps, ahead[:-1]),
        np.einsum("nk,nk->n", steps, ahead[1:]),
    )
    if len(steps) > 1:
        before[0], after[-1] = after[0], before[-1]
    found: FloatArray = (before < 0.0) & (after < 0.0)
    return found


def turned(path: Path) -> Path:
    """Return a path with its headings rotated by 180 degrees."""
    return Path(path.points + np.array([0.0, 0.0, pi]))
