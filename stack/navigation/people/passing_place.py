"""Search for a place beside a way, where the robot lets a person pass."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, hypot

import numpy as np
from numpy.typing import NDArray

from stack.types import INSCRIBED_COST, CostGrid, FloatArray, Footprint, Pose2D, TrackedObject

REACH = 6.0
"""Half the side of the square that is searched, metres."""

LONGEST_WAY = 8.0
"""Length of the longest way to a place, metres."""

PASSING_ROOM = 0.15
"""Metres between the robot and who passes, besides their radii."""

LEAST_BODY = 0.25
"""Least radius that is expected of a person, metres."""

PLACES_APART = 1.0
"""Metres between a place that did not help and another one."""

WAY_CONTINUED = 2.0
"""Metres for which the way of a person is continued if it is not known."""


def way_of(person: TrackedObject, pose: Pose2D, trail: FloatArray) -> FloatArray:
    """Return the way that a person who faces the robot is expected to want, (n, 2), map frame.

    It leads to the robot and then where the robot came from.

    Args:
        person: who is in the way.
        pose: of the robot.
        trail: (k, 2) positions of the robot, oldest first.
    """
    here, there = np.array([pose.x, pose.y]), np.array(person.position)
    back = trail[::-1]
    length = float(np.hypot(*np.diff(back, axis=0).T).sum()) if len(back) > 1 else 0.0
    if length < WAY_CONTINUED:
        away = (here - there) / max(hypot(*(here - there)), 1e-6)
        back = np.concatenate([back, [here + WAY_CONTINUED * away]])
    return np.concatenate([[there, here], back])


def find_passing_place(  # noqa: PLR0913 - of one robot at one place
    costs: CostGrid, pose: Pose2D, ways: Sequence[FloatArray], outline: Footprint, *,
    people: Sequence[TrackedObject], tried: Sequence[Pose2D] = (),
) -> Pose2D | None:  # fmt: skip
    """Return the nearest place at which the robot leaves ways free; None without one.

    Args:
        costs: costmap, map frame.
        pose: of the robot.
        ways: (n, 2) to leave free, each.
        outline: of the robot.
        people: whom the robot must not meet on its way, map frame.
        tried: places that did not help.
    """
    import cv2

    from stack.geometry.travel.kernels import travel_distances

    step = costs.resolution
    row, column = costs.cell_at(pose.x, pose.y)
    half = round(REACH / step)
    top, left = max(row - half, 0), max(column - half, 0)
    cells = costs.cells[top : row + half + 1, left : column + half + 1]
    corner = np.array(costs.origin) + step * np.array([left, top])
    passable = (cells < INSCRIBED_COST).astype(np.uint8)
    radius = max([LEAST_BODY, *(person.radius for person in people)])
    for person in people:
        _fill(passable, person.position, corner, step, person.radius + outline.inscribed_radius)
    row, column = row - top, column - left
    if not (0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]):
        return None
    passable[row, column] = 1
    travel: NDArray[np.int32] = travel_distances(passable, row, column)
    canvas = np.full(cells.shape, 255, np.uint8)
    pixels = [np.rint((way - corner) / step - 0.5).astype(np.int32) for way in ways]
    cv2.polylines(canvas, pixels, False, 0)
    beside = np.asarray(cv2.distanceTransform(canvas, cv2.DIST_L2, 5)) * step
    enough = beside >= radius + outline.circumscribed_radius + PASSING_ROOM
    for place in tried:
        enough &= _away(cells.shape, (place.x, place.y), corner, step) > PLACES_APART
    fits = enough & (travel <= round(10.0 * LONGEST_WAY / step))
    if not fits.any():
        return None
    price = np.where(fits, travel + 20 * (cells > 0), np.iinfo(np.int32).max)
    best = np.unravel_index(int(np.argmin(price)), price.shape)
    x, y = (corner + step * (np.array([best[1], best[0]]) + 0.5)).tolist()
    return Pose2D(x, y, atan2(y - pose.y, x - pose.x))


def _away(
    shape: tuple[int, ...], at: tuple[float, float], corner: FloatArray, step: float
) -> FloatArray:
    """Return the distances of all cells from a point, metres."""
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    x, y = (np.array(at) - corner) / step - 0.5
    found: FloatArray = step * np.hypot(columns - x, rows - y)
    return found


def _fill(
    passable: NDArray[np.uint8], at: tuple[float, float], corner: FloatArray, step: float,
    radius: float,
) -> None:  # fmt: skip
    import cv2

    column, row = np.rint((np.array(at) - corner) / step - 0.5).astype(int).tolist()
    cv2.circle(passable, (column, row), round(radius / step), 0, -1)
