"""Joining of lanes and connections into one path with rounded corners and speed limits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, inf, sin

import numpy as np

from stack.planning.routes.graph import RouteEdge
from stack.planning.routes.network import TOUCHING, blocked
from stack.planning.routes.search import RouteArc
from stack.planning.smoothing import POSE_SPACING, resampled, with_headings
from stack.types import CostGrid, FloatArray, Path, wrap_angle

_CORNER, _REVERSAL = 0.09, 2.6
"""Radians; a change of direction between these two values is rounded as a corner."""

_LOOK = 3  # points before and after a point between which its change of direction is measured


@dataclass(frozen=True, slots=True)
class RouteShape:
    """Shape of the joined path.

    Attributes:
        radius: of corners, metres; where there is no room, the radius is smaller or zero.
        top_speed: of the robot, m/s.
        keeps_connections: keep the headings of connections and do not round them, since a car may
            drive backward on them.
    """

    radius: float
    top_speed: float
    keeps_connections: bool


@dataclass(slots=True)
class _Piece:
    """Dense points, (n, 2) or (n, 3) with headings to keep, and (n,) speed limits in m/s."""

    points: FloatArray
    limits: FloatArray


def path_along(
    arcs: Sequence[RouteArc], costs: CostGrid, shape: RouteShape, heading: float
) -> Path:
    """Return the path along arcs, its poses POSE_SPACING apart; the last one has this heading."""
    parts = []
    for piece in _joined(_pieces(arcs, shape), shape):
        if piece.points.shape[1] == 3:
            parts.append((piece.points, piece.limits))
            continue
        points = _rounded(piece.points, costs, shape.radius)
        poses = with_headings(points, heading).points
        poses[-1, 2] = poses[-2, 2]  # only the last pose of the path has the requested heading
        parts.append((poses, piece.limits))
    poses = np.vstack([part[:-1] for part, _ in parts[:-1]] + [parts[-1][0]])
    limits = np.concatenate([part[:-1] for _, part in parts[:-1]] + [parts[-1][1]])
    poses[-1, 2] = heading
    return Path(poses, limits if bool(np.isfinite(limits).any()) else None)


def _pieces(arcs: Sequence[RouteArc], shape: RouteShape) -> Iterator[_Piece]:
    for number, arc in enumerate(arcs):
        if arc.edge is None:
            assert arc.path is not None
            points = arc.path.points if shape.keeps_connections else arc.path.points[:, :2]
            neighbours = [near.edge for near in arcs[max(0, number - 1) : number + 2] if near.edge]
            limits = _beside(points, neighbours, shape.top_speed)
        else:
            assert arc.points is not None
            points = _dense(arc.points)
            limits = np.full(len(points), arc.edge.limit(shape.top_speed))
        if len(points) > 1:
            yield _Piece(points, limits)


def _beside(points: FloatArray, lanes: Iterable[RouteEdge], top_speed: float) -> FloatArray:
    """Return (n,) speed limits of points off the lanes: a lane's limit within TOUCHING of it."""
    limits = np.full(len(points), inf)
    for lane in lanes:
        limit = lane.limit(top_speed)
        if limit < inf:
            away = np.array([lane.line.nearest(float(x), float(y))[1] for x, y in points[:, :2]])
            limits[away <= TOUCHING] = np.minimum(limits[away <= TOUCHING], limit)
    return limits


def _joined(pieces: Iterable[_Piece], shape: RouteShape) -> list[_Piece]:
    """Join successive pieces without headings; at the joint the limit of the second applies."""
    joined: list[_Piece] = []
    for piece in pieces:
        if joined and joined[-1].points.shape[1] == piece.points.shape[1] == 2:
            before = joined.pop()
            points = np.vstack([before.points[:-1], piece.points])
            limits = np.concatenate([before.limits[:-1], piece.limits])
            piece = _Piece(points, limits)
        joined.append(piece)
    return joined


def _dense(points: FloatArray) -> FloatArray:
    """Return points along a polyline, POSE_SPACING apart, including its own points."""
    parts = [resampled(np.array(pair), POSE_SPACING)[:-1] for pair in pairwise(points)]
    return np.vstack([*parts, points[-1:]])


def _rounded(points: FloatArray, costs: CostGrid, radius: float) -> FloatArray:
    """Return the points with every corner replaced by a parabola; their number is unchanged.

    A quadratic Bézier curve with the corner as control point and legs of t metres has the smallest
    radius t cos²(a/2) / sin(a/2) for a turn by a.
    """
    turns = _turns(points)
    corners = [0, *_corners(turns), len(points) - 1]
    rounded = points.copy()
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        half = 0.5 * abs(float(turns[corner]))
        legs = ceil(radius * sin(half) / cos(half) ** 2 / POSE_SPACING)
        # The ends of the path are not rounded: the full distance to them is available.
        room = min((corner - before) // (2 if before else 1),
                   (after - corner) // (2 if after < corners[-1] else 1))  # fmt: skip
        legs = min(legs, room)
        while legs > 1:
            curve = _parabola(points, corner, legs)
            if not blocked(costs, curve).any():
                rounded[corner - legs : corner + legs + 1] = curve
                break
            legs //= 2
    return rounded


def _parabola(points: FloatArray, corner: int, legs: int) -> FloatArray:
    share = np.linspace(0.0, 1.0, 2 * legs + 1)[:, None]
    first, middle, last = points[corner - legs], points[corner], points[corner + legs]
    curve: FloatArray = (
        (1 - share) ** 2 * first + 2 * share * (1 - share) * middle + share**2 * last
    )
    return curve


def _turns(points: FloatArray) -> FloatArray:
    """Return the (n,) change of direction at each point, radians."""
    turns = np.zeros(len(points))
    for at in range(1, len(points) - 1):
        back, on = points[max(0, at - _LOOK)], points[min(len(points) - 1, at + _LOOK)]
        (x, y), (u, v) = points[at] - back, on - points[at]
        turns[at] = wrap_angle(float(np.arctan2(v, u) - np.arctan2(y, x)))
    return turns


def _corners(turns: FloatArray) -> list[int]:
    """Return the indices of local maxima of the turn, more than _LOOK points apart."""
    sizes = np.abs(turns)
    return [
        at
        for at in range(1, len(turns) - 1)
        if _CORNER < sizes[at] < _REVERSAL
        and sizes[at] == sizes[max(0, at - _LOOK) : at + _LOOK + 1].max()
        and sizes[at] > sizes[max(0, at - _LOOK) : at].max(initial=0.0)
    ]
