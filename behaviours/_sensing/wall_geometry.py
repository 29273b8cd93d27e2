"""Contour of a lidar scan, and the offset curve along a wall. Arrays in, arrays out.

A scan becomes a contour: chains of neighbouring returns, each return moved onto the line through
its neighbours (total least squares; moving least squares of Levin, 1998), doorways bridged. The
curve to drive is the path of the centre of a disc that rolls along the contour: it rounds outer
corners on an arc, turns before a wall ahead, and skips openings that are too narrow for the disc.

All points are (n, 2) float64, metres, in the base frame, in the order of the beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

CHAIN_GAP = 0.3
"""Metres; neighbouring returns closer than this belong to the same chain."""
MIN_RETURNS = 3
"""Number of returns; a shorter chain is noise, for example dust."""
SMOOTHING_RADIUS = 0.2
SMOOTHING_BEAMS = 14
CONTOUR_SPACING = 0.03
"""Metres between contour points; a distance of 0.2 m to the contour is then within 1 mm."""
JAMB_WIDTH = 0.15
"""Metres; a wall ends in a face about this wide, which is left out of the fit of its direction."""
FIT_LENGTH = 0.6
LINE_TOLERANCE = 0.12
CURVE_STEP = 0.05

Chains = list[FloatArray]


def chains_of(points: FloatArray) -> Chains:
    """Split returns into chains of neighbours; the last and the first return may be neighbours."""
    if len(points) < MIN_RETURNS:
        return []
    cuts = np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) > CHAIN_GAP) + 1
    chains = np.split(points, cuts)
    if len(chains) > 1 and np.linalg.norm(points[0] - points[-1]) <= CHAIN_GAP:
        chains = [np.vstack([chains[-1], chains[0]]), *chains[1:-1]]
    return [chain for chain in chains if len(chain) >= MIN_RETURNS]


def smoothed(chain: FloatArray) -> FloatArray:
    """Move each point onto the total-least-squares line through its neighbours in the chain."""
    count = len(chain)
    offsets = np.arange(-SMOOTHING_BEAMS, SMOOTHING_BEAMS + 1)
    index = np.arange(count)[:, None] + offsets
    inside = (index >= 0) & (index < count)
    near = chain[np.clip(index, 0, count - 1)]
    squares = ((near - chain[:, None, :]) ** 2).sum(axis=2)
    weights = np.where(inside, np.exp(-squares / (0.5 * SMOOTHING_RADIUS**2)), 0.0)
    total = weights.sum(axis=1)
    centre = np.einsum("nk,nkd->nd", weights, near) / total[:, None]
    spread = near - centre[:, None, :]
    xx, yy, xy = (
        np.einsum("nk,nk->n", weights, spread[:, :, a] * spread[:, :, b])
        for a, b in ((0, 0), (1, 1), (0, 1))
    )
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    line = np.column_stack([np.cos(angle), np.sin(angle)])
    share = np.einsum("nd,nd->n", chain - centre, line)
    moved: FloatArray = centre + share[:, None] * line
    return moved


def filled(chain: FloatArray) -> FloatArray:
    """Insert points so that neighbours are at most CONTOUR_SPACING apart."""
    if len(chain) < 2:
        return chain
    steps = np.diff(chain, axis=0)
    counts = np.maximum(1, np.ceil(np.linalg.norm(steps, axis=1) / CONTOUR_SPACING).astype(int))
    starts, steps = np.repeat(chain[:-1], counts, axis=0), np.repeat(steps, counts, axis=0)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    share = (np.arange(len(starts)) - first) / np.repeat(counts, counts)
    return np.vstack([starts + share[:, None] * steps, chain[-1:]])


def bridges(chains: Chains, gap: float) -> Chains:
    """Return straight segments across gaps, at most `gap` metres wide, within collinear walls."""
    found = []
    everything = np.vstack(chains) if chains else np.empty((0, 2))
    for chain in chains:
        for inwards in (chain, chain[::-1]):
            bridge = _bridge_from(inwards, everything, gap)
            if bridge is not None:
                found.append(bridge)
    return found


def _bridge_from(chain: FloatArray, everything: FloatArray, gap: float) -> FloatArray | None:
    """Bridge a gap before the chain's first point; None if no collinear wall is behind the gap."""
    end = chain[0]
    distances = np.linalg.norm(chain - end, axis=1)
    wall = chain[(distances >= JAMB_WIDTH) & (distances <= FIT_LENGTH)]
    if len(wall) < MIN_RETURNS:
        return None
    centre = wall.mean(axis=0)
    outwards = np.linalg.svd(wall - centre, full_matrices=False)[2][0]
    if outwards @ (end - centre) < 0.0:
        outwards = -outwards
    relative = everything - centre
    along = relative @ outwards
    across = outwards[0] * relative[:, 1] - outwards[1] * relative[:, 0]
    start = float((end - centre) @ outwards)
    ahead = along[(np.abs(across) <= LINE_TOLERANCE) & (along > start + CONTOUR_SPACING)]
    if not ahead.size or ahead.min() > start + gap:
        return None
    goes_on = ahead[ahead <= ahead.min() + FIT_LENGTH]
    if goes_on.max() - goes_on.min() < JAMB_WIDTH:
        return None
    bridge: FloatArray = centre + np.array([[start], [goes_on.min()]]) * outwards
    return bridge


def contour_of(points: FloatArray, gap: float) -> FloatArray:
    """Return the (n, 2) dense contour of a scan: smoothed, with gaps in walls bridged."""
    chains = [smoothed(chain) for chain in chains_of(points)]
    pieces = [filled(chain) for chain in chains + bridges(chains, gap)]
    return np.vstack(pieces) if pieces else np.empty((0, 2))


_SIN, _COS = sin(radians(20.0)), cos(radians(20.0))
"""Of the bearing, 20 degrees to the other side, from which on a point belongs to the wall."""
_PASSAGE_CHECKED = 0.4
"""Metres ahead in which a passage is checked before it is entered."""


@dataclass(frozen=True, slots=True)
class WallCourse:
    """Settings of wall following.

    Attributes:
        side: side of the wall: +1 left, -1 right.
        distance: wanted distance to the wall, metres.
        closest: least distance to any obstacle, metres. A passage narrower than twice this counts
            as closed; in one narrower than twice `distance` the robot drives along the middle.
    """

    side: int
    distance: float
    closest: float

    def along(self, towards_wall: FloatArray) -> FloatArray:
        """Return the (2,) direction of travel along a wall in direction `towards_wall` (2,)."""
        x, y = towards_wall
        return np.array([y, -x]) * self.side


@dataclass(frozen=True, slots=True)
class OffsetCurve:
    """The curve to drive along the wall.

    Attributes:
        points: (n, 2), the first next to the robot, CURVE_STEP metres apart on a straight wall.
        tangent: (2,) unit direction of travel at the first point.
        wall_distance: distance from the robot to the wall, metres.
        error: `wall_distance` minus the wanted distance, metres; in a narrow passage the wanted
            distance is that of its middle.
    """

    points: FloatArray
    tangent: FloatArray
    wall_distance: float
    error: float


@dataclass(frozen=True, slots=True)
class _Contact:
    """The point of the wall (2,) that the disc touches next, and the wanted distance to it."""

    point: FloatArray
    distance: float


def _contact(
    contour: FloatArray, position: FloatArray, tangent: FloatArray, course: WallCourse
) -> _Contact | None:
    """Return the nearest point ahead or on the wall's side, or the point that closes the passage.

    The wall's points have bearings from -20 to 160 degrees, positive towards the wall: a half
    plane. Those from -160 to -20 degrees are on the other side. They do not belong to the followed
    wall, but may reduce the room. None if there is no wall.

    Args:
        contour: (2, n) dense points, one row for x and one for y.
        position: (2,) centre of the disc.
        tangent: (2,) unit direction of travel.
        course: side and distances.
    """
    x, y = contour[0] - position[0], contour[1] - position[1]
    along = tangent[0] * x + tangent[1] * y
    across = (course.side * tangent[0]) * y - (course.side * tangent[1]) * x
    squares = x * x + y * y
    ahead, beside = _SIN * along, _COS * across
    on_side = ahead + beside >= 0.0
    wall = _nearest(squares, on_side)
    if wall is None:
        return None
    away = float(np.sqrt(squares[wall]))
    other = (ahead > beside) & ~on_side
    opposite = _nearest(squares, other)
    if opposite is None:
        return _Contact(contour[:, wall], course.distance)
    if across[wall] > along[wall]:  # its bearing is above 45 degrees
        near = other & (along > CONTOUR_SPACING) & (along <= _PASSAGE_CHECKED)
        closed_by = _nearest(squares, near & (away - across < 2 * course.closest))
        if closed_by is not None:
            return _Contact(contour[:, closed_by], course.distance)
    middle = 0.5 * (away + float(np.sqrt(squares[opposite])))
    return _Contact(contour[:, wall], min(course.distance, max(middle, course.closest)))


def _nearest(squares: FloatArray, eligible: NDArray[np.bool_]) -> int | None:
    """Return the index of the smallest eligible value; None if none is eligible."""
    if not len(squares):
        return None
    nearest = int(np.where(eligible, squares, np.inf).argmin())
    return nearest if eligible[nearest] else None


def offset_curve(
    contour: FloatArray, course: WallCourse, tangent: FloatArray, length: float = 1.2
) -> OffsetCurve | None:
    """Compute the curve along the wall, from a point next to the robot (the origin).

    Args:
        contour: (n, 2) dense points, from `contour_of`.
        course: side and distances.
        tangent: (2,) approximate direction of travel; selects the wall to follow.
        length: length of the curve, metres.

    Returns:
        The curve; None if there is no wall on that side.
    """
    columns = np.ascontiguousarray(contour.T)
    position, direction = np.zeros(2), tangent
    points: list[FloatArray] = []
    first: tuple[FloatArray, float, float] | None = None
    for _ in range(round(length / CURVE_STEP)):
        contact = _contact(columns, position, direction, course)
        if contact is None:
            break
        towards = contact.point - position
        away = float(np.linalg.norm(towards))
        if away < 1e-6:
            break
        towards = towards / away
        direction = course.along(towards)
        position = position + (away - contact.distance) * towards
        points.append(position)
        first = first or (direction, away, away - contact.distance)
        position = position + CURVE_STEP * direction
    if first is None:
        return None
    return OffsetCurve(np.array(points), *first)


def room_ahead(points: FloatArray, half_width: float) -> float:
    """Return the distance straight ahead to the first return in a lane, metres; inf if none."""
    lane = points[(points[:, 0] > 0.0) & (np.abs(points[:, 1]) <= half_width)]
    return float(lane[:, 0].min()) if len(lane) else float("inf")
