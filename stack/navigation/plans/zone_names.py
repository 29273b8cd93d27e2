"""Names the keep-out zones that are why a plan failed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from stack.costmap.costmap import Costmap
from stack.types import Failure, FailureCode, Pose2D

CLOSED_BY_ZONE = frozenset(
    {FailureCode.START_OCCUPIED, FailureCode.GOAL_OCCUPIED, FailureCode.NO_VALID_PATH}
)
"""Failures of a plan that a zone can cause."""


def zones_closing(
    failure: Failure, costmap: Costmap, pose: Pose2D, goals: Sequence[Pose2D]
) -> tuple[str, ...]:
    """Return the names of the zones that close the way of a plan that failed.

    Args:
        failure: of the plan.
        costmap: that it was made on.
        pose: its start, map frame.
        goals: in turn, map frame.
    """
    if failure.code not in CLOSED_BY_ZONE:
        return ()
    for start, goal in pairwise((costmap.way_out or pose, *goals)):
        names = costmap.zones_between(start, goal)
        if names:
            return names
    return ()
