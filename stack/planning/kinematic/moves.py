"""Motion primitives: short arcs and straights, and the moves of a state lattice."""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, ceil, cos, hypot, pi, sin, sqrt, tan

import numpy as np

from stack.types import FloatArray, wrap_angle

HEADINGS = 72
"""Number of heading bins of the hybrid search: five degrees each."""

LATTICE_DIRECTIONS = (
    (1, 0), (2, 1), (1, 1), (1, 2), (0, 1), (-1, 2), (-1, 1), (-2, 1),
    (-1, 0), (-2, -1), (-1, -1), (-1, -2), (0, -1), (1, -2), (1, -1), (2, -1),
)  # fmt: skip
"""Steps in cells along the sixteen lattice headings: straight moves end at cell centres."""

IN_PLACE = 9
_PARTS = 1440  # entries of the table from direction to heading bin: a quarter of a degree
_TURN_STEP = 0.1  # rad between the poses of a turn in place
_REACH = 40  # cells; search radius for the end of a lattice arc


@dataclass(frozen=True)
class Penalties:
    """Cost penalties of motion primitives.

    Attributes:
        reverse: factor on metres driven backward.
        non_straight: factor on metres of arcs.
        change: metres added for a change of steering side or of driving direction.
        rotation: metres for each radian turned in place.
    """

    reverse: float
    non_straight: float
    change: float
    rotation: float = 0.0

    def of(self, length: float, kind: int) -> float:
        """Return the cost in metres of a move on free ground.

        Args:
            length: metres, or radians of a turn in place.
            kind: as `Move.kind`.
        """
        if kind == IN_PLACE:
            return length * self.rotation
        steering = kind - 3 if kind >= 2 else kind
        factor = self.reverse if kind >= 2 else 1.0
        return length * factor * (self.non_straight if steering else 1.0)


@dataclass(frozen=True)
class Move:
    """One motion primitive in the frame of its start pose.

    Attributes:
        poses: (n, 3) x, y in metres and heading, without the start pose.
        length: metres, or radians of a turn in place.
        kind: steering -1, 0, 1, plus 3 in reverse; or IN_PLACE.
    """

    poses: FloatArray
    length: float
    kind: int


def pack_moves(moves: list[list[Move]], penalties: Penalties, headings: FloatArray) -> object:
    """Return `kernels.Moves` with the moves of each heading.

    Args:
        moves: by heading; every heading has the same number of moves, of the same kinds.
        penalties: cost penalties.
        headings: (n,) radians.
    """
    from stack.planning.kinematic import kernels

    most = max(len(move.poses) for row in moves for move in row)
    poses = np.zeros((len(moves), len(moves[0]), most, 3))
    counts = np.zeros(poses.shape[:2], np.int64)
    costs = np.zeros(poses.shape[:2])
    for turn, row in enumerate(moves):
        for index, move in enumerate(row):
            counts[turn, index] = len(move.poses)
            poses[turn, index, : len(move.poses)] = move.poses
            costs[turn, index] = penalties.of(move.length, move.kind)
    middles = (np.arange(_PARTS) + 0.5) / _PARTS * 2.0 * pi - pi
    apart = np.abs(np.angle(np.exp(1j * (middles[:, None] - headings[None, :]))))
    kinds = np.array([move.kind for move in moves[0]], dtype=np.int64)
    return kernels.Moves(
        poses, counts, costs, kinds, np.argmin(apart, axis=1).astype(np.int64), penalties.change
    )


def steering_moves(radius: float, resolution: float, reverse: bool) -> list[Move]:
    """Return moves left, straight and right, long enough to leave the cell and the heading bin.

    Args:
        radius: minimum turning radius, metres.
        resolution: side of a cell, metres.
        reverse: also return the same moves backward.
    """
    angle = 2.0 * asin(min(1.0, sqrt(2.0) * resolution / (2.0 * radius)))
    bin_size = 2.0 * pi / HEADINGS
    length = radius * bin_size * ceil(angle / bin_size - 1e-9)
    moves = []
    for direction in (1, -1) if reverse else (1,):
        for steering in (0, 1, -1):
            kind = steering if direction > 0 else steering + 3
            poses = arc(steering / radius, direction * length, resolution)
            moves.append(Move(poses, length, kind))
    return moves


def arc(curvature: float, length: float, spacing: float) -> FloatArray:
    """Return poses (n, 3) along an arc from the origin; a negative length is driven backward."""
    along = np.linspace(0.0, length, ceil(abs(length) / spacing - 1e-9) + 1)[1:]
    turn = curvature * along
    chord = along if curvature == 0.0 else 2.0 / curvature * np.sin(0.5 * turn)
    return np.column_stack([chord * np.cos(0.5 * turn), chord * np.sin(0.5 * turn), turn])


def lattice_headings() -> FloatArray:
    """Return the (16,) lattice headings, radians."""
    return np.array([atan2(rise, run) for run, rise in LATTICE_DIRECTIONS])


def lattice_moves(radius: float, resolution: float, reverse: bool) -> list[list[Move]]:
    """Return the moves of a differential robot by heading: straights, arcs, turns in place.

    From a cell centre at a lattice heading, every move ends at a cell centre and lattice heading.

    Args:
        radius: minimum radius of arcs, metres.
        resolution: side of a cell, metres.
        reverse: also return a straight move backward.
    """
    return [_moves_from(turn, radius, resolution, reverse) for turn in range(16)]


def _moves_from(turn: int, radius: float, resolution: float, reverse: bool) -> list[Move]:
    headings = lattice_headings()
    step = hypot(*LATTICE_DIRECTIONS[turn]) * resolution
    short = step * ceil(1.5 * resolution / step)
    long = step * max(1, round(8.0 * resolution / step))
    moves = [Move(arc(0.0, length, resolution), length, 0) for length in (short, long)]
    if reverse:
        moves.append(Move(arc(0.0, -short, resolution), short, 3))
    for side in (1, -1):
        other = (turn + side) % 16
        poses, length = _bend(turn, other, radius, resolution)
        moves.append(Move(poses, length, side))
        angle = wrap_angle(float(headings[other] - headings[turn]))
        moves.append(Move(turned(np.zeros(3), angle), abs(angle), IN_PLACE))
    return moves


def _bend(turn: int, other: int, radius: float, resolution: float) -> tuple[FloatArray, float]:
    """Return the shortest arc plus straight line between two headings, from cell centre to centre.

    The lines along both headings meet in a corner. An arc is tangent to both at equal distances;
    the straight line is the rest of the longer side (Pivtoraiko and Kelly 2005).

    Returns:
        (poses (n, 3) in the frame of the start, length in metres).
    """
    (run, rise), (next_run, next_rise) = LATTICE_DIRECTIONS[turn], LATTICE_DIRECTIONS[other]
    start = atan2(rise, run)
    angle = wrap_angle(atan2(next_rise, next_run) - start)
    bend = tan(0.5 * abs(angle))
    best: tuple[float, float, float] | None = None
    for before in range(1, _REACH):
        for after in range(1, _REACH):
            first = before * hypot(run, rise) * resolution
            last = after * hypot(next_run, next_rise) * resolution
            tangent = min(first, last)
            if tangent / bend < radius - 1e-9:
                continue
            length = first + last - 2.0 * tangent + tangent / bend * abs(angle)
            if best is None or length < best[0] - 1e-9:
                best = (length, first, last)
    if best is None:
        raise AssertionError(f"no lattice arc of radius {radius:g} m within {_REACH} cells")
    length, first, last = best
    tangent = min(first, last)
    straight, curved = (arc(0.0, rest, resolution) for rest in (first - tangent, last - tangent))
    bent = arc(angle / abs(angle) * bend / tangent, tangent / bend * abs(angle), resolution)
    return _chained([straight, bent, curved]), length


def _chained(pieces: list[FloatArray]) -> FloatArray:
    """Concatenate pose sequences (n, 3) that each begin at the origin."""
    chain, x, y, heading = [], 0.0, 0.0, 0.0
    for piece in pieces:
        if not len(piece):
            continue
        c, s = cos(heading), sin(heading)
        moved = np.column_stack(
            [x + c * piece[:, 0] - s * piece[:, 1], y + s * piece[:, 0] + c * piece[:, 1],
             heading + piece[:, 2]]
        )  # fmt: skip
        chain.append(moved)
        x, y, heading = moved[-1]
    return np.vstack(chain)


def turned(pose: FloatArray, angle: float) -> FloatArray:
    """Return poses (n, 3) of a turn in place by an angle in radians, without the first pose."""
    steps = ceil(abs(angle) / _TURN_STEP - 1e-9)
    if steps == 0:
        return np.empty((0, 3))
    poses = np.repeat(pose[None], steps, axis=0)
    poses[:, 2] += angle * np.arange(1, steps + 1) / steps
    return poses
