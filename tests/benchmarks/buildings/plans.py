"""Plans of buildings: corridors of 100 to 200 m with loops, rooms, recesses of doors, and glass.

A plan is a union of rectangles; its walls are the boundary. The twin wings have the same rooms in
the same places, so that scans of one fit the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stack.streams import stream
from stack.types import FloatArray

Rectangle = tuple[float, float, float, float]
"""Least x and y, largest x and y, metres."""
Corner = tuple[float, float]

KINDS = ("ring", "ladder", "twin wings", "grid", "bare ring")

DOOR, RECESS, WALL = 0.9, 0.15, 0.2
"""Metres: width of a door, depth of the recess of a closed one, thickness of a wall."""


@dataclass(frozen=True)
class Building:
    """A plan and a route.

    Attributes:
        kind: one of KINDS.
        walls: (n, 4) x and y of both ends, metres.
        glass: (n,) whether a wall is of glass.
        route: corners along the axes of the corridors.
    """

    kind: str
    walls: FloatArray
    glass: FloatArray
    route: tuple[Corner, ...]


def building(seed: int) -> Building:
    """Return the building of a seed; the kinds take turns."""
    rng, kind = stream(seed, "building"), KINDS[seed % len(KINDS)]
    width = float(rng.uniform(1.8, 2.8))
    axes, route = _LAYOUTS[kind](rng)
    corridors = [_corridor(one, other, width) for one, other in axes]
    bare = kind == "bare ring"
    if kind == "twin wings":  # the second wing is a copy of the first one
        wing, shift = axes[:4], axes[-1][1][0]
        niches = [n for axis in wing for n in _niches(rng, axis, width, corridors, bare)]
        niches += [(x + shift, y, to_x + shift, to_y) for x, y, to_x, to_y in niches]
        niches += _niches(rng, axes[-1], width, corridors, bare)
        niches = _apart(niches, corridors, width)
    else:
        niches = [n for axis in axes for n in _niches(rng, axis, width, corridors, bare)]
    walls = boundary([*corridors, *niches])
    long = np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 1.5
    glass = long & (rng.random(len(walls)) < rng.uniform(0.0, 0.2))
    return Building(kind, walls, glass, tuple(route))


Axis = tuple[Corner, Corner]


def _ring(rng: np.random.Generator) -> tuple[list[Axis], list[Corner]]:
    length, width = float(rng.uniform(35.0, 60.0)), float(rng.uniform(14.0, 28.0))
    a, b, c, d = (0.0, 0.0), (length, 0.0), (length, width), (0.0, width)
    return [(a, b), (b, c), (d, c), (a, d)], [a, b, c, d, a, b, (length, 0.5 * width)]


def _ladder(rng: np.random.Generator) -> tuple[list[Axis], list[Corner]]:
    half, width = float(rng.uniform(20.0, 32.0)), float(rng.uniform(12.0, 20.0))
    low = [(0.0, 0.0), (half, 0.0), (2.0 * half, 0.0)]
    high = [(x, width) for x, _ in low]
    axes = [*pairwise(low), *pairwise(high), *zip(low, high, strict=True)]
    route = [low[0], low[2], high[2], high[1], low[1], low[0], high[0], high[1], high[2], low[2]]
    return axes, route


def _twins(rng: np.random.Generator) -> tuple[list[Axis], list[Corner]]:
    length, width = float(rng.uniform(16.0, 24.0)), float(rng.uniform(12.0, 18.0))
    shift = length + float(rng.uniform(25.0, 40.0))
    a, b, c, d = (0.0, 0.0), (length, 0.0), (length, width), (0.0, width)
    wing = [(a, b), (b, c), (d, c), (a, d)]
    e, f, g, h = ((x + shift, y) for x, y in (a, b, c, d))
    other = [(e, f), (f, g), (h, g), (e, h)]
    route = [b, a, d, c, b, e, f, g, h, e, f, e, b, a, d]
    return [*wing, *other, (b, e)], route


def _grid(rng: np.random.Generator) -> tuple[list[Axis], list[Corner]]:
    side, width = float(rng.uniform(16.0, 24.0)), float(rng.uniform(12.0, 16.0))
    at = [[(i * side, j * width) for i in range(3)] for j in range(3)]
    rows = [axis for row in at for axis in pairwise(row)]
    columns = [axis for column in zip(*at, strict=True) for axis in pairwise(column)]
    route = [at[0][0], at[0][2], at[1][2], at[1][0], at[0][0], at[0][1], at[2][1], at[2][2],
             at[1][2], at[1][1]]  # fmt: skip
    return [*rows, *columns], route


_LAYOUTS = {"ring": _ring, "ladder": _ladder, "twin wings": _twins, "grid": _grid,
            "bare ring": _ring}  # fmt: skip


def _corridor(one: Corner, other: Corner, width: float) -> Rectangle:
    half = 0.5 * width
    return one[0] - half, one[1] - half, other[0] + half, other[1] + half


def _niches(
    rng: np.random.Generator, axis: Axis, width: float, corridors: list[Rectangle], bare: bool
) -> list[Rectangle]:
    """Return recesses of doors, and rooms with their doors, on both sides of a corridor."""
    (x, y), (to_x, to_y) = axis
    length, along = max(to_x - x, to_y - y), to_x - x > to_y - y
    found: list[Rectangle] = []
    for side in (-1.0, 1.0):
        at = width + float(rng.uniform(0.0, 4.0))
        while at < length - width - DOOR:
            is_room = not bare and rng.random() < 0.4
            door = (at, 0.5 * width, at + DOOR, 0.5 * width + (WALL if is_room else RECESS))
            parts = [door]
            size = rng.uniform(2.5, 6.0, 2)
            if is_room:
                left = at - float(rng.uniform(0.0, size[0] - DOOR))
                parts.append((left, door[3], left + size[0], door[3] + size[1]))
            placed = [_placed(part, x, y, side, along) for part in parts]
            if all(_is_clear(part, corridors) for part in placed[1:]):
                found += placed
            else:
                found += [_placed((at, door[1], door[2], door[1] + RECESS), x, y, side, along)]
            at += (float(size[0]) if is_room else DOOR) + float(
                rng.uniform(6.0, 14.0) if bare else rng.uniform(1.5, 6.0)
            )
    return _apart(found, corridors, width)


def _placed(part: Rectangle, x: float, y: float, side: float, along: bool) -> Rectangle:
    """Return a rectangle given along and across a corridor, in the plan."""
    low, high = sorted((side * part[1], side * part[3]))
    if along:
        return x + part[0], y + low, x + part[2], y + high
    return x + low, y + part[0], x + high, y + part[2]


def _is_clear(part: Rectangle, others: list[Rectangle]) -> bool:
    """Return whether a wall fits between a rectangle and all others."""
    return all(
        part[0] > o[2] + WALL - 1e-6 or part[2] < o[0] - WALL + 1e-6
        or part[1] > o[3] + WALL - 1e-6 or part[3] < o[1] - WALL + 1e-6
        for o in others
    )  # fmt: skip


def _apart(niches: list[Rectangle], corridors: list[Rectangle], width: float) -> list[Rectangle]:
    """Return the niches without rooms that meet an earlier one or another corridor."""
    kept: list[Rectangle] = []
    for part in niches:
        is_room = min(part[2] - part[0], part[3] - part[1]) > DOOR + 0.1
        rooms = [o for o in kept if min(o[2] - o[0], o[3] - o[1]) > DOOR + 0.1]
        if not is_room or _is_clear(part, [*corridors, *rooms]):
            kept.append(part)
    return kept


def boundary(parts: list[Rectangle]) -> FloatArray:
    """Return the boundary (n, 4) of a union of rectangles, as long straight segments."""
    corners = np.round(np.array(parts), 4)
    xs, ys = np.unique(corners[:, [0, 2]]), np.unique(corners[:, [1, 3]])
    inside = np.zeros((len(ys) + 1, len(xs) + 1), np.bool_)  # with a border outside
    for x, y, to_x, to_y in corners.tolist():
        rows = slice(np.searchsorted(ys, y) + 1, np.searchsorted(ys, to_y) + 1)
        columns = slice(np.searchsorted(xs, x) + 1, np.searchsorted(xs, to_x) + 1)
        inside[rows, columns] = True
    across = [
        (xs[i], ys[j], xs[k], ys[j])
        for j, row in enumerate(inside[1:] != inside[:-1]) for i, k in _runs(row[1:-1])
    ]  # fmt: skip
    up = [
        (xs[i], ys[j], xs[i], ys[k])
        for i, column in enumerate((inside[:, 1:] != inside[:, :-1]).T)
        for j, k in _runs(column[1:-1])
    ]
    return np.array([*across, *up])


def _runs(marks: FloatArray) -> list[tuple[int, int]]:
    """Return the begins and ends of the runs of marks."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marks, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
