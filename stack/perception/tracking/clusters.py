"""Clusters of neighbouring returns in a scan, and circles fitted to them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, floor, hypot, pi, sin
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.perception.tracking.arcs import LEAST_RETURNS, convex_parts, fit_arc
from stack.types import FloatArray, Pose2D, Scan

T = TypeVar("T", bound=np.generic)

NOT_ROUND = 0.12
"""Metres by which the distance of a circle from one beam differs from the mean if the cluster is no
circle, for example of two objects that touch."""

CONTINUES = 0.1
"""Largest step in metres from a run to an ignored beam that continues it."""


@dataclass(frozen=True, slots=True)
class Disc:
    """Circle fitted to a cluster of a scan.

    Attributes:
        x: of its centre, metres, frame of the pose argument.
        y: likewise.
        radius: metres.
        is_circle: False if something closer, or the border of the view, hides one of its sides, or
            if the cluster is not round, and the visible arc does not determine the circle; then
            radius and centre are biased.
        run: its beams, (first, last + 1), modulo the number of beams.
        deviation: of the centre of an arc, metres; 0 if the whole side is visible.
    """

    x: float
    y: float
    radius: float
    is_circle: bool
    run: tuple[int, int]
    deviation: float = 0.0


def clusters(
    ranges: FloatArray, increment: float, jump: float, valid: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Return the runs of valid beams whose neighbouring returns are at most a jump distance apart.

    The first and the last beam of a 360° scan are neighbours; the end index of such a run is above
    the number of beams.

    Args:
        ranges: (n,) metres.
        increment: radians from beam to beam.
        jump: metres.
        valid: (n,) beams to use.

    Returns:
        (first, last + 1) of each run; beam indices are modulo n.
    """
    n, safe = ranges.size, np.where(valid, ranges, 0.0)
    following = _rolled(safe, -1)
    apart = safe * safe + following * following - (2.0 * cos(increment)) * safe * following
    linked = valid & _rolled(valid, -1) & (apart <= jump * jump)
    if n * abs(increment) < 2.0 * pi - 1.5 * abs(increment):
        linked[-1] = False
    starts = np.flatnonzero(valid & ~_rolled(linked, 1))
    ends = np.flatnonzero(valid & ~linked) + 1
    if starts.size and ends[0] <= starts[0]:  # the run that ends first began last
        ends = np.append(ends[1:], ends[0] + n)
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _rolled(values: NDArray[T], by: int) -> NDArray[T]:
    """Return values (n,) as `np.roll` does, which takes five times as long."""
    return np.concatenate((values[-by:], values[:-by]))


def bridged(ranges: NDArray[np.float32], jump: float) -> NDArray[np.float32]:
    """Return the ranges with single lost beams replaced by the mean of their neighbours.

    A lost beam would divide what it hits into two objects.

    Args:
        ranges: (n,) metres; inf or nan: no return.
        jump: largest difference of the neighbours, metres.
    """
    before, after = _rolled(ranges, 1), _rolled(ranges, -1)
    with np.errstate(invalid="ignore"):  # inf - inf and nan compare as false
        same = ~np.isfinite(ranges) & (np.abs(before - after) <= jump)
    found: NDArray[np.float32] = np.where(same, np.float32(0.5) * (before + after), ranges)
    return found


def covers_full_turn(scan: Scan) -> bool:
    """Return whether the first beam is beside the last one; not if the robot turned meanwhile."""
    increment = abs(scan.angle_increment)
    beams = scan.angles
    gap = 2.0 * pi - abs(float(beams[-1] - beams[0]))
    return abs(gap - increment) <= 0.5 * increment


def bearings_of(scan: Scan, beams: NDArray[np.intp]) -> FloatArray:
    """Return (k,) directions in the sensor frame of neighbouring beams, radians, without jumps.

    Args:
        scan: deskewed or not.
        beams: (k,) numbers in order; those from n on are of the next turn.
    """
    turns, index = np.divmod(beams, scan.ranges.size)
    full = 2.0 * pi if scan.angle_increment > 0.0 else -2.0 * pi
    found: FloatArray = scan.angles[index] + full * turns
    return found


def beams_towards(scan: Scan, angles: FloatArray) -> NDArray[np.intp]:
    """Return (k,) the beams nearest to directions in the sensor frame, radians.

    A deskewed scan turns evenly enough that a beam's own offset from even spacing holds for its
    neighbours. Numbers outside 0 to n - 1 are outside the view.
    """
    even = np.rint((angles - scan.angle_min) / scan.angle_increment).astype(np.intp)
    if scan.bearings is None:
        return even
    n, increment = scan.ranges.size, scan.angle_increment
    round_turn = round(2.0 * pi / abs(increment))
    index = np.minimum(even % round_turn, n - 1)
    off = scan.bearings[index] - (scan.angle_min + increment * index)
    return np.rint((angles - off - scan.angle_min) / increment).astype(np.intp)


def disc_of(  # noqa: PLR0913 - of one run
    scan: Scan, pose: Pose2D, run: tuple[int, int], jump: float,
    ignored: NDArray[np.bool_] | None = None,
    *, is_part: bool = False,
) -> Disc | None:  # fmt: skip
    """Fit a circle to a run of beams; None if it covers half a turn or more.

    A circle of radius R at the distance D subtends the half angle a = asin(R / D); its range at
    the angle p from the centre is D · (cos p - sqrt(sin² a - sin² p)). The half angle is half of
    the run's angle, so each beam gives D; the result is the mean over the inner half of the run.

    Args:
        scan: the scan of the run, `bridged`.
        pose: of the base.
        run: (first, last + 1), modulo the number of beams.
        jump: metres by which a neighbouring return must be closer to hide a side.
        ignored: (n,) beams that were left out since they end on the map. One that continues the run
            may be a part of the object: then the disc is not whole.
        is_part: whether the run is a part of a cluster, so that its neighbours may hide a side.
    """
    ranges, n, (first, end) = scan.ranges, scan.ranges.size, run
    beams = np.arange(first, end)
    bearings = bearings_of(scan, beams)
    # the outer halves of the first and the last beam belong to the run
    spacing = abs(bearings[-1] - bearings[0]) / (end - first - 1) if end - first > 1 else 0.0
    half = 0.5 * (end - first) * (spacing or abs(scan.angle_increment))
    if half >= 0.5 * pi:
        return None
    centre = 0.5 * (bearings[0] + bearings[-1])
    # the inner half: at least the beam or the two beams in the middle
    middle = 0.5 * (first + end - 1)
    reach = max(0.25 * (end - first), 0.5 * ((end - first - 1) % 2)) + 1e-9
    inner = np.arange(ceil(middle - reach), floor(middle + reach) + 1)
    off = bearings[inner - first] - centre
    sines = np.sin(off)
    shape = np.cos(off) - np.sqrt(np.maximum(sin(half) ** 2 - sines * sines, 0.0))
    distances = ranges[inner % n] / shape
    distance = float(distances.sum()) / len(inner)
    is_round = float(np.abs(distances - distance).max()) <= NOT_ROUND
    sensor = pose.compose(scan.mount)
    heading = sensor.heading + centre
    near, far = float(ranges[first % n]), float(ranges[(end - 1) % n])
    sides = ((first - 1) % n, near), (end % n, far)
    at_border = (first == 0 or end >= n) and not covers_full_turn(scan)
    hidden = [
        float(ranges[beam]) < edge - jump
        or (ignored is not None and ignored[beam] and abs(float(ranges[beam]) - edge) < CONTINUES)
        for beam, edge in sides
    ]
    is_whole = is_round and not (is_part or at_border or any(hidden))
    arc = None if is_whole else fit_arc(returns_of(scan, beams, bearings))
    if arc is not None:
        x, y = sensor.transform(arc.centre[None])[0].tolist()
        return Disc(x, y, arc.radius, True, run, arc.deviation)
    return Disc(
        sensor.x + distance * cos(heading), sensor.y + distance * sin(heading),
        distance * sin(half), is_whole, run,
    )  # fmt: skip


def returns_of(scan: Scan, beams: NDArray[np.intp], bearings: FloatArray) -> FloatArray:
    """Return (k, 2) where beams end, sensor frame.

    Args:
        scan: of the beams.
        beams: (k,) that have returned; those from n on are of the next turn.
        bearings: (k,) of the beams.
    """
    ranges = scan.ranges[beams % scan.ranges.size].astype(np.float64)
    found: FloatArray = np.column_stack((np.cos(bearings), np.sin(bearings))) * ranges[:, None]
    return found


def parts_of(scan: Scan, run: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the runs of a cluster's bodies that touch or stand close together."""
    first, end = run
    if end - first < LEAST_RETURNS:
        return [run]
    beams = np.arange(first, end)
    parts = convex_parts(returns_of(scan, beams, bearings_of(scan, beams)))
    return [(first + begin, first + stop) for begin, stop in parts]


def spread_of(scan: Scan, run: tuple[int, int]) -> float:
    """Return the distance between the first and the last return of a run, metres."""
    n, (first, end) = scan.ranges.size, run
    near, far = float(scan.ranges[first % n]), float(scan.ranges[(end - 1) % n])
    angle = float(np.subtract(*bearings_of(scan, np.array([end - 1, first]))))
    return hypot(near - far * cos(angle), far * sin(angle))
