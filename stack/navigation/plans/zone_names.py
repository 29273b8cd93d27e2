"""Names the keep-out zones that are why a plan failed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from stack.costmap.closing_zones import zone_words
from stack.costmap.costmap import Costmap
from stack.types import Failure, FailureCode, Pose2D

CLOSED_BY_ZONE = frozenset(
    {FailureCode.START_OCCUPIED, FailureCode.GOAL_OCCUPIED, FailureCode.NO_VALID_PATH}
)
"""Failures of a plan that a zone can cause."""


def with_zones(
    failure: Failure, costmap: Costmap, pose: Pose2D, goals: Sequence[Pose2D]
) -> Failure:
    """Return the failure of a plan, with the names of the zones that close the way.

    Args:
        failure: of the plan.
        costmap: that it was made on.
        pose: its start, map frame.
        goals: in turn, map frame.
    """
    if failure.code not in CLOSED_BY_ZONE:
        return failure
    for start, goal in pairwise((costmap.way_out or pose, *goals)):
        names = costmap.zones_between(start, goal)
        if names:
            verb = "closes" if len(names) == 1 else "close"
            sentence = f"{failure.sentence}; {zone_words(names)} {verb} the way"
            return replace(failure, sentence=sentence)
    return failure
