"""Where on a path the robot is: progress that only grows, and what lies ahead."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin

import numpy as np

from stack.types import FloatArray, Path, Pose2D

FIRST_REACH, REACH = 2.0, 1.0
"""Metres of path searched for the nearest place at first and from then on.

Short, so that a path that comes back near itself (a patrol that ends where it began) is driven in
order.
"""

HEADING_OVER = 0.1
"""Metres of path before and after a place that its heading there is taken over."""

LOST_TRACK = 1.0
"""Farther than this from the path, in metres, all of what is left of it is searched."""

CUSP_REACHED = 0.1
"""Metres before a cusp at which it counts as reached."""

LOOKS_ALONG = 0.7
"""Cosine of the angle to a path's last direction up to which its last heading belongs to it."""

RUN_OUT = 2.0
"""Metres by which the path is prolonged, so that a lookahead point near the goal stays far."""


class PathProgress:
    """A path being driven.

    Beyond its end the path goes on straight in its last direction: the lookahead point then stays
    at its distance and the steering calm up to the goal (Macenski et al. 2023 note the opposite,
    a growing curvature, for a lookahead point that waits at the goal).

    Where a path reverses it folds back on itself; beyond such a cusp nothing counts as reached
    before the cusp is.

    Attributes:
        path: as given.
        length: metres.
        travelled: metres of the path that lie behind; never shrinks; above `length` past the end.
        offset: metres between robot and path when last looked at.
    """

    def __init__(self, path: Path, cusps: Sequence[float] = (), *, steered: bool = False) -> None:
        """At the beginning of a path.

        Args:
            path: to drive.
            cusps: metres along it at which the direction of driving changes.
            steered: it was planned for a car, which arrives with the heading that it ends with.
        """
        from stack.control import kernels

        self._kernels = kernels
        self.path = path
        self.length = path.length
        self._points = _prolonged(path, self.length, steered=steered)
        steps = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        self._lengths = np.concatenate([[0.0], np.cumsum(steps)])
        self._segment, self._reach, self._aimed = 0, FIRST_REACH, 0.0
        self._cusps, self._steered = list(cusps), steered
        self.travelled, self.offset = 0.0, 0.0

    @property
    def arrival(self) -> Pose2D:
        """The goal; for a car with the heading that the path brings it to."""
        goal = self.path.goal
        if not self._steered:
            return goal
        dx, dy = self._points[-1] - self._points[-2]
        return Pose2D(goal.x, goal.y, atan2(dy, dx))

    @property
    def remaining(self) -> float:
        """Metres to the end along the path; 0 at or past it."""
        return max(0.0, self.length - self.travelled)

    def advance(self, pose: Pose2D) -> None:
        """Move on to the place of the path that is nearest to the pose now."""
        segment, travelled, offset = self._nearest(pose, self._up_to_cusp())
        if offset > LOST_TRACK:
            segment, travelled, offset = self._nearest(pose, np.inf)
        self._segment, self._reach = segment, REACH
        self.travelled, self.offset = max(self.travelled, travelled), offset
        while self._cusps and self.travelled >= self._cusps[0] - CUSP_REACHED:
            self._segment = int(np.searchsorted(self._lengths, self._cusps.pop(0) - 1e-6))

    def _up_to_cusp(self) -> float:
        """Metres of the path to search: none of those beyond the next cusp."""
        if not self._cusps:
            return self._reach
        left = self._cusps[0] - float(self._lengths[self._segment]) - 1e-3
        return max(0.0, min(self._reach, left))

    def lookahead_point(self, pose: Pose2D, distance: float) -> tuple[float, float]:
        """The first point ahead on the path at a straight-line distance, map frame.

        Never behind one that was aimed at before, short of the goal: in a corner a robot that
        slows down would else look less far, turn back to the leg it has cut and stop there.
        """
        length = self._ahead_by(pose, distance)
        self._aimed = max(length, min(self._aimed, self.length))
        return self._point(self._aimed)

    def nearer_point(self, pose: Pose2D, distance: float) -> tuple[float, float]:
        """The first point ahead at a distance, wherever was aimed before."""
        return self._point(self._ahead_by(pose, distance))

    def _ahead_by(self, pose: Pose2D, distance: float) -> float:
        length: float = self._kernels.length_at_distance(
            self._points, self._lengths, pose.x, pose.y, self.travelled, distance
        )
        return length

    def _point(self, length: float) -> tuple[float, float]:
        x, y = (float(np.interp(length, self._lengths, axis)) for axis in self._points.T)
        return x, y

    def pose_ahead(self, distance: float) -> Pose2D:
        """Where on the path the robot should be some metres on, looking along it."""
        length = self.travelled + distance
        return Pose2D(*self._point(length), self._heading(length))

    def foot(self, pose: Pose2D) -> tuple[float, float, float]:
        """Where on the path a pose near the robot belongs: length, offset, the path's heading."""
        _, length, offset = self._nearest(pose, REACH)
        return length, offset, self._heading(length)

    def ahead(self, distance: float) -> FloatArray:
        """(k, 2) the path's own points on its next metres, map frame."""
        own = self._lengths[: len(self.path.points)]
        first, last = np.searchsorted(own, [self.travelled, self.travelled + distance])
        return self.path.points[first : last + 1, :2]

    def sampled(self, distance: float, spacing: float, *, beyond: bool = False) -> FloatArray:
        """(k, 2) points evenly spaced on the next metres of the path, map frame, k >= 1.

        The first is the place of the path nearest to the robot; the goal is the last when it is
        that near, unless the way may go on straight `beyond` it.
        """
        if beyond:
            lengths = self.travelled + spacing * np.arange(int(distance / spacing + 1e-6) + 1)
        else:
            begin = min(self.travelled, self.length)
            span = min(distance, self.length - begin)
            lengths = begin + spacing * np.arange(int(span / spacing + 1e-6) + 1)
            if begin + span >= self.length and lengths[-1] < self.length - 0.2 * spacing:
                lengths = np.append(lengths, self.length)
        return np.column_stack([np.interp(lengths, self._lengths, axis) for axis in self._points.T])

    def _heading(self, length: float) -> float:
        (bx, by), (cx, cy) = self._point(length - HEADING_OVER), self._point(length + HEADING_OVER)
        return atan2(cy - by, cx - bx)

    def _nearest(self, pose: Pose2D, reach: float) -> tuple[int, float, float]:
        found: tuple[int, float, float] = self._kernels.project(
            self._points, self._lengths, pose.x, pose.y, self._segment, reach
        )
        return found


def _prolonged(path: Path, length: float, *, steered: bool) -> FloatArray:
    """The path's positions (n + 1, 2) with one more straight on.

    A car's path may end in an arc: straight on is then where it looks, unless it was planned
    without regard to headings.
    """
    points = path.points[:, :2]
    end = points[-1]
    heading = float(path.points[-1, 2])
    looks = np.array([cos(heading), sin(heading)])
    if length < 1e-3:
        direction = looks
    else:
        away = np.linalg.norm(points - end, axis=1)
        far = np.flatnonzero(away >= min(0.15, 0.5 * float(away.max())))
        direction = end - points[far[-1]]
        direction = direction / np.linalg.norm(direction)
        if steered and float(direction @ looks) > LOOKS_ALONG:
            direction = looks
    return np.ascontiguousarray(np.vstack([points, end + RUN_OUT * direction]))
