"""A directional segment of a path: nearest point, remaining length and points ahead."""

from __future__ import annotations

from bisect import bisect_right
from math import atan2, cos, hypot, inf, pi, sin, sqrt

import numpy as np

from stack.types import FloatArray, Path, Pose2D, wrap_angle

REACH = 0.5
"""Metres of path searched for the nearest point, besides the distance moved since the last search.

Short, so that a path that passes near itself (e.g. a patrol loop) is followed in order. A robot
that cuts a right-angled corner by 0.25 m still gets ahead.
"""

FEET_REACH = 1.0
"""Metres of path on which positions near the robot are projected."""

DETOUR = sqrt(2.0)
"""Length of path up to a point that the robot steers to, divided by the distance to it, at most.

In a right-angled corner it is reached. A longer path turns back before that point.
"""

HEADING_SPAN = 0.1
"""Metres of path before and after a point from which its heading is computed."""

OFF_PATH = 1.0
"""Offset in metres above which the whole remaining path is searched."""

ALIGNED_COSINE = 0.7
"""Minimum cosine of the angle between a path's last direction and its last heading at which the
heading is used as the direction."""

EXTENSION = 2.0
"""Metres by which the path is extended, so that lookahead points near the goal stay ahead."""

EXTENSION_STEP, ARC_SPAN = 0.05, 0.1
"""Metres: spacing of an arc that extends a path; end of a path from which its arc is computed."""

ON_ARC = 0.1
"""Radians: largest difference of a turn from twice the angle between chord and tangent."""


class PathSegment:
    """A part of a path that is driven in one direction, and how far the robot is along it.

    A controller steers along segments. For a backward segment it drives a robot that faces
    backward: the headings of `path` and all poses are turned by 180 degrees.

    The path is extended beyond its end, so that the lookahead point keeps its distance and the
    steering stays calm up to the goal. (With a lookahead point that stops at the goal the curvature
    grows, see Macenski et al. 2023.) The extension is straight. For a car it continues the arc in
    which the path ends: towards a straight one a car would steer back before the end of the arc,
    and arrive with half of the turn of a short segment between two cusps.

    Attributes:
        path: the part of the path, headings as driven forward.
        backward: whether the robot reverses along it.
        is_last: whether it ends at the goal, and not at a cusp.
        length: metres.
        travelled: metres along it; never decreases; above `length` past the end.
        offset: distance between robot and path at the last update, metres.
    """

    def __init__(
        self, path: Path, *, backward: bool = False, is_last: bool = True, steered: bool = False
    ) -> None:
        """Start at the beginning.

        Args:
            path: headings as driven forward.
            backward: whether the robot reverses along it.
            is_last: whether it ends at the goal.
            steered: for a car, which arrives with the path's final direction as its heading.
        """
        from stack.geometry import kernels

        self._kernels = kernels
        self.path, self.backward, self.is_last = path, backward, is_last
        self.length = path.length
        self._ends_in_arc = steered and _ends_as_it_looks(path, self.length)
        self._points = _extended(path, self.length, in_arc=self._ends_in_arc)
        steps = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        self._lengths = np.concatenate([[0.0], np.cumsum(steps)])
        self._vertices: list[tuple[float, float]] = list(map(tuple, self._points.tolist()))
        self._vertex_lengths: list[float] = self._lengths.tolist()
        self._vertex, self._aimed = 0, 0.0
        self._seen_at = self._vertices[0]
        self._steered = steered
        self.travelled, self.offset = 0.0, 0.0

    @property
    def arrival(self) -> Pose2D:
        """The goal pose; for a car, with the heading in which the path ends."""
        goal = self.path.goal
        if not self._steered or self._ends_in_arc:
            return goal
        dx, dy = self._points[-1] - self._points[-2]
        return Pose2D(goal.x, goal.y, atan2(dy, dx))

    @property
    def remaining(self) -> float:
        """Remaining length of the path, metres; 0 at or past its end."""
        return max(0.0, self.length - self.travelled)

    def ends_within(self, distance: float) -> bool:
        """Whether the path ends at the goal within a distance of the robot, and not a lap later.

        A path that ends in a bend may be longer than the straight line: twice as long.

        Args:
            distance: between robot and goal, metres.
        """
        return self.is_last and self.remaining <= 2.0 * distance

    def advance(self, pose: Pose2D) -> None:
        """Update the progress to the path point nearest to a pose; the navigator calls it."""
        x, y = self._seen_at
        vertex, travelled, offset = self._nearest(pose, REACH + hypot(pose.x - x, pose.y - y))
        if offset > OFF_PATH:
            vertex, travelled, offset = self._nearest(pose, inf)
        self._vertex, self._seen_at = vertex, (pose.x, pose.y)
        self.travelled, self.offset = max(self.travelled, travelled), offset

    def lookahead_point(self, pose: Pose2D, distance: float) -> tuple[float, float]:
        """Return the first path point ahead at a straight-line distance, map frame.

        Before the goal it never moves backward along the path. Otherwise a robot that slows down
        in a corner would get a nearer point, turn back to the corner that it has cut, and stop.
        """
        length = self._ahead_by(pose, distance)
        self._aimed = max(length, min(self._aimed, self.length))
        return self._point(self._aimed)

    def nearer_point(self, pose: Pose2D, distance: float) -> tuple[float, float]:
        """Return the first path point at a distance, regardless of earlier lookahead points."""
        return self._point(self._ahead_by(pose, distance))

    def _ahead_by(self, pose: Pose2D, distance: float) -> float:
        length: float = self._kernels.length_at_distance(
            self._points, self._lengths, pose.x, pose.y, self.travelled, distance
        )
        return min(length, self.travelled + DETOUR * distance + self.offset)

    def _point(self, length: float) -> tuple[float, float]:
        lengths, vertices = self._vertex_lengths, self._vertices
        after = bisect_right(lengths, length)
        if after == 0 or after == len(lengths):
            return vertices[max(0, after - 1)]
        begin, (x, y), (to_x, to_y) = lengths[after - 1], vertices[after - 1], vertices[after]
        step, along = lengths[after] - begin, length - begin
        return (to_x - x) / step * along + x, (to_y - y) / step * along + y

    def pose_ahead(self, distance: float) -> Pose2D:
        """The pose on the path `distance` metres ahead of the progress."""
        length = self.travelled + distance
        return Pose2D(*self._point(length), self._heading(length))

    def curvature_ahead(self, distance: float) -> float:
        """Curvature of the path `distance` metres ahead of the progress, 1/m."""
        half = HEADING_SPAN / 2.0
        length = max(self.travelled + distance, HEADING_SPAN + half)  # all points are on the path
        turn = self._heading(length + half) - self._heading(length - half)
        return wrap_angle(turn) / HEADING_SPAN

    def feet(self, positions: FloatArray) -> FloatArray:
        """Project positions (k, 2) near the robot onto the path.

        Returns:
            (k, 3) length along the path and offset from it, metres, and heading of the path there.
        """
        found: FloatArray = self._kernels.feet(
            self._points,
            self._lengths,
            positions,
            self._vertex,
            self.travelled + FEET_REACH,
            HEADING_SPAN,
        )
        return found

    def ahead(self, distance: float) -> FloatArray:
        """Return the (k, 2) points of the path in its next `distance` metres, map frame."""
        own = self._lengths[: len(self.path.points)]
        first = own.searchsorted(self.travelled)
        last = own.searchsorted(self.travelled + distance)
        return self.path.points[first : last + 1, :2]

    def sampled(self, distance: float, spacing: float, *, beyond: bool = False) -> FloatArray:
        """Return (k, 2) evenly spaced points of the next `distance` metres, map frame, k >= 1.

        The first point is the one nearest to the robot. The goal is the last one when it is within
        `distance`; with `beyond` the path continues straight after the goal. The points end where
        the path turns back: a motion to what comes after would leave the path.
        """
        if beyond:
            lengths = self.travelled + spacing * np.arange(int(distance / spacing + 1e-6) + 1)
        else:
            begin = min(self.travelled, self.length)
            span = min(distance, self.length - begin)
            lengths = begin + spacing * np.arange(int(span / spacing + 1e-6) + 1)
            if begin + span >= self.length and lengths[-1] < self.length - 0.2 * spacing:
                lengths = np.append(lengths, self.length)
        x, y = (np.interp(lengths, self._lengths, axis) for axis in self._points.T)
        robot_x, robot_y = self._seen_at
        reached = DETOUR * np.hypot(x - robot_x, y - robot_y) + self.offset + spacing
        back = lengths - self.travelled > reached
        end = int(back.argmax()) or len(back)
        return np.column_stack([x[:end], y[:end]])

    def _heading(self, length: float) -> float:
        (bx, by), (cx, cy) = self._point(length - HEADING_SPAN), self._point(length + HEADING_SPAN)
        return atan2(cy - by, cx - bx)

    def _nearest(self, pose: Pose2D, reach: float) -> tuple[int, float, float]:
        found: tuple[int, float, float] = self._kernels.project(
            self._points, self._lengths, pose.x, pose.y, self._vertex, self.travelled + reach
        )
        return found


def _extended(path: Path, length: float, *, in_arc: bool) -> FloatArray:
    """Return the path's positions with a straight extension, or one in its last arc, (n + k, 2)."""
    points = path.points[:, :2]
    straight = points[-1] + EXTENSION * _direction(path, length)
    return np.ascontiguousarray(np.vstack([points, _arc_from(path) if in_arc else straight]))


def _ends_as_it_looks(path: Path, length: float) -> bool:
    """Whether the last heading is about the direction in which the path ends.

    It is not where a path was planned without headings.
    """
    heading = float(path.points[-1, 2])
    looks = np.array([cos(heading), sin(heading)])
    return length >= 1e-3 and float(_direction(path, length) @ looks) > ALIGNED_COSINE


def _direction(path: Path, length: float) -> FloatArray:
    """Unit vector in which a path ends; of its heading if it has no length."""
    points = path.points[:, :2]
    if length < 1e-3:
        heading = float(path.points[-1, 2])
        return np.array([cos(heading), sin(heading)])
    away = np.linalg.norm(points - points[-1], axis=1)
    far = np.flatnonzero(away >= min(0.15, 0.5 * float(away.max())))
    direction: FloatArray = points[-1] - points[far[-1]]
    return direction / np.linalg.norm(direction)


def _arc_from(path: Path) -> FloatArray:
    """Continue the arc in which a path ends, by at most a quarter circle and then straight.

    Straight from the beginning where the last headings are not those of an arc.
    """
    points = path.points
    away = np.hypot(*(points[:, :2] - points[-1, :2]).T)
    first = int(np.flatnonzero(away >= min(ARC_SPAN, 0.99 * float(away.max())))[-1])
    chord, turn = points[-1] - points[first], wrap_angle(float(points[-1, 2] - points[first, 2]))
    half = wrap_angle(float(points[-1, 2]) - atan2(chord[1], chord[0]))
    curvature = turn / float(away[first]) if abs(turn - 2.0 * half) < ON_ARC else 0.0
    middles = EXTENSION_STEP * (np.arange(round(EXTENSION / EXTENSION_STEP)) + 0.5)
    headings = points[-1, 2] + np.clip(curvature * middles, -pi / 2.0, pi / 2.0)
    steps = EXTENSION_STEP * np.column_stack([np.cos(headings), np.sin(headings)])
    return points[-1, :2] + np.cumsum(steps, axis=0)
