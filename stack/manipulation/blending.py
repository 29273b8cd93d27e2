"""Paths through waypoints whose corners are rounded by arcs of circles.

At each corner an arc touches both lines; it leaves the corner by `tolerance` at most and uses at
most half of each line (Kunz, Stilman, RSS 2012). The path is parameterised by its length in joint
space. Where it turns back it cannot be rounded: it is divided there, and the arm stops.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.types import FloatArray

LINE_PARTS = 0.03
"""Radians of joint space between two points of the grid on a line."""

ARC_PARTS = 8
"""Least parts of an arc."""

SHARPEST = np.cos(np.deg2rad(170.0))
"""Cosine of the turn from which on a corner is a stop."""

STRAIGHT = 1e-5
"""Radians: corners that turn less are no corners."""


@dataclass(frozen=True)
class Section:
    """A part of a path between two stops, on a grid of its length.

    Attributes:
        lengths: (k + 1,) from 0, radians of joint space.
        positions: (k + 1, n).
        tangents: (k + 1, n) first derivative by the length.
        curvatures: (k, n) second derivative in each part.
    """

    lengths: FloatArray
    positions: FloatArray
    tangents: FloatArray
    curvatures: FloatArray


def blended(waypoints: FloatArray, tolerance: float) -> list[Section]:
    """Return the sections of the rounded path.

    Args:
        waypoints: (k, n) without repetitions.
        tolerance: radians of joint space between a corner and its arc at most; 0: the arm stops
            at each corner.
    """
    sections, pieces = [], _Pieces(waypoints[0])
    for before, corner, after in zip(waypoints, waypoints[1:], waypoints[2:], strict=False):
        first, second = _direction(before, corner), _direction(corner, after)
        cosine = float(np.clip(first @ second, -1.0, 1.0))
        turn = float(np.arccos(cosine))
        if turn < STRAIGHT:
            pieces.line_to(corner)
        elif tolerance == 0.0 or cosine < SHARPEST:
            pieces.line_to(corner)
            sections.append(pieces.section())
            pieces = _Pieces(corner)
        else:
            room = min(np.linalg.norm(corner - before), np.linalg.norm(after - corner)) / 2.0
            wide = tolerance * np.sin(turn / 2.0) / (1.0 - np.cos(turn / 2.0))
            cut = min(float(room), float(wide))
            pieces.line_to(corner - cut * first)
            pieces.arc(corner, first, second, turn, cut)
    pieces.line_to(waypoints[-1])
    return [*sections, pieces.section()]


class _Pieces:
    """A section that grows by lines and arcs."""

    def __init__(self, start: FloatArray) -> None:
        self._positions = [start]
        self._tangents: list[FloatArray] = []
        self._curvatures: list[FloatArray] = []
        self._steps: list[float] = []

    def line_to(self, end: FloatArray) -> None:
        begin = self._positions[-1]
        length = float(np.linalg.norm(end - begin))
        if length < 1e-9:
            return
        count = max(2, int(np.ceil(length / LINE_PARTS)))
        direction = (end - begin) / length
        self._begin_with(direction)
        for part in range(1, count + 1):
            self._add(begin + (end - begin) * (part / count), direction, 0.0 * direction)
            self._steps.append(length / count)

    def arc(
        self, corner: FloatArray, first: FloatArray, second: FloatArray, turn: float, cut: float
    ) -> None:
        """Add the arc that touches both lines at the distance `cut` from the corner."""
        radius = cut / np.tan(turn / 2.0)
        inward = second - np.cos(turn) * first
        inward /= np.linalg.norm(inward)
        centre = corner - cut * first + radius * inward
        self._begin_with(first)
        count = max(ARC_PARTS, int(np.ceil(radius * turn / LINE_PARTS)))
        for part in range(1, count + 1):
            angle, middle = turn * part / count, turn * (part - 0.5) / count
            self._add(
                centre + radius * (np.sin(angle) * first - np.cos(angle) * inward),
                np.cos(angle) * first + np.sin(angle) * inward,
                (np.cos(middle) * inward - np.sin(middle) * first) / radius,
            )
            self._steps.append(radius * turn / count)

    def section(self) -> Section:
        return Section(
            np.concatenate(([0.0], np.cumsum(self._steps))),
            np.array(self._positions),
            np.array(self._tangents),
            np.array(self._curvatures),
        )

    def _begin_with(self, direction: FloatArray) -> None:
        if not self._tangents:
            self._tangents.append(direction)

    def _add(self, position: FloatArray, tangent: FloatArray, curvature: FloatArray) -> None:
        self._positions.append(position)
        self._tangents.append(tangent)
        self._curvatures.append(curvature)


def _direction(begin: FloatArray, end: FloatArray) -> FloatArray:
    way = end - begin
    direction: FloatArray = way / np.linalg.norm(way)
    return direction
