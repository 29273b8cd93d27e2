"""Rival poses: which candidates of a global search remain beside the best one.

A single scan of a corridor with equal rooms fits several places. The candidates with a share of the
probability become modes of the particle filter, which follows and weighs them (modes.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

from stack.errors import NavigationError
from stack.localisation.search.matches import GlobalMatch
from stack.types import FailureCode


@dataclass(frozen=True, slots=True)
class Resolution:
    """Result of a global search: where the robot probably is, and where else it may be.

    Attributes:
        best: the most probable pose.
        rivals: the others, most probable first.
    """

    best: GlobalMatch
    rivals: tuple[GlobalMatch, ...]


def resolve(candidates: Sequence[GlobalMatch], least_fit: float, least_share: float) -> Resolution:
    """Return the best candidate and its rivals.

    Args:
        candidates: distinct poses, best first.
        least_fit: smallest accepted fit of the best one.
        least_share: probability, relative to the best one, below which a candidate is no rival.

    Raises:
        NavigationError: LOST if no candidate fits.
    """
    if not candidates or candidates[0].fit < least_fit:
        fit = candidates[0].fit if candidates else 0.0
        raise NavigationError(
            FailureCode.LOST,
            f"the best place on the map explains {fit:.0%} of the scan, below {least_fit:.0%}; "
            "drive to a place where more of the map is visible",
        )
    best, *others = candidates
    limit = best.evidence + log(least_share)
    return Resolution(best, tuple(other for other in others if other.evidence >= limit))
