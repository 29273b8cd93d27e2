"""Which keep-out zones close the way from one place to another."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from stack.geometry.connected import connected_to
from stack.geometry.distance_transform import distances_to_zero
from stack.types import LETHAL_COST, CostGrid, Pose2D


def closing_zones(
    zones: Sequence[str], is_open: Callable[[Collection[str]], bool]
) -> tuple[str, ...]:
    """Return the zones without which there would be a way; none if other things close it too.

    Args:
        zones: names of all zones.
        is_open: whether there is a way when these zones are left out.

    Returns:
        The zones each of which closes the way alone; all zones if only several together do.
    """
    if not zones or is_open(()) or not is_open(zones):
        return ()
    alone = tuple(name for name in zones if is_open((name,)))
    return alone or tuple(zones)


def zones_between(
    costs: CostGrid,
    ground: NDArray[np.uint8],
    zones: Mapping[str, NDArray[np.bool_]],
    ends: tuple[Pose2D, Pose2D],
    radius: float,
) -> tuple[str, ...]:
    """Return the zones of a costmap that close the way between two places.

    Args:
        costs: map frame.
        ground: (rows, columns) costs of the map alone: walls may stand in zones.
        zones: cells (rows, columns) of each zone, by name.
        ends: start and goal, map frame.
        radius: clearance of the robot's centre from lethal cells, metres.
    """
    start, goal = (costs.cell_at(pose.x, pose.y) for pose in ends)
    if not (costs.contains(*start) and costs.contains(*goal)):
        return ()
    lethal = costs.cells == LETHAL_COST
    for cells in zones.values():
        lethal &= ~cells
    lethal |= ground == LETHAL_COST

    def is_open(without: Collection[str]) -> bool:
        closed = lethal.copy()
        for name, cells in zones.items():
            if name not in without:
                closed |= cells
        free = distances_to_zero(~closed) * costs.resolution > radius + 1e-9
        return bool(free[start] and free[goal] and connected_to(free, [start])[goal])

    return closing_zones(tuple(zones), is_open)


def zone_words(names: Sequence[str]) -> str:
    """Return zones as words: `the keep-out zone 'a'`."""
    listed = " and ".join(repr(name) for name in names)
    return f"the keep-out zone {listed}" if len(names) == 1 else f"the keep-out zones {listed}"
