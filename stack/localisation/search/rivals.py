"""Rival poses: which matches of a global search remain beside the best one.

A single scan of a corridor with equal rooms fits several places. The matches with a share of the
probability become hypotheses of the particle filter, which follows and weighs them.

Places are compared by the unmapped and missing objects that each of them needs. How well the beams
end at the walls is no evidence for one place against another: a wall is anywhere within its cell,
so that of two equal rooms one fits every scan a little better, in all its beams at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log

from stack.errors import NavigationError
from stack.localisation.search.matches import GlobalMatch
from stack.types import FailureCode

RIVAL_DEAD_ZONE = 0.75
"""Difference of the evidence of two places that counts as none: cells of the map and noise."""
RIVAL_SHARE = 0.01
"""A place is a rival if its probability is at least this share of the best one's."""
EVIDENCE_CAP = 15.0
"""Largest evidence of one view against a place: one view may be wrong as a whole."""


def weighed(
    matches: Sequence[GlobalMatch], log_priors: Sequence[float] = ()
) -> list[tuple[GlobalMatch, float]]:
    """Return the matches with their log-weights, most probable first; equal ones by evidence.

    The weights are relative to the largest one.
    """
    least = min((match.cost for match in matches), default=0.0)
    pairs = [
        (match, prior - min(EVIDENCE_CAP, max(0.0, match.cost - least - RIVAL_DEAD_ZONE)))
        for match, prior in zip(matches, log_priors or [0.0] * len(matches), strict=True)
    ]
    top = max((weight for _, weight in pairs), default=0.0)
    pairs = [(match, weight - top) for match, weight in pairs]
    return sorted(pairs, key=lambda pair: (-pair[1], -pair[0].evidence))


def resolve(
    matches: Sequence[GlobalMatch], least_fit: float, log_priors: Sequence[float] = ()
) -> list[tuple[GlobalMatch, float]]:
    """Return the best match and its rivals with their log-weights, most probable first.

    Args:
        matches: distinct poses.
        least_fit: smallest accepted fit of the best one.
        log_priors: of each match, at most 0; empty: all are as probable.

    Raises:
        NavigationError: LOST if no match fits.
    """
    pairs = weighed(matches, log_priors)
    fit = pairs[0][0].fit if pairs else 0.0
    if not pairs or fit < least_fit:
        raise NavigationError(
            FailureCode.LOST,
            f"the best place on the map explains {fit:.0%} of the scan, below {least_fit:.0%}; "
            "drive to a place where more of the map is visible",
        )
    limit = log(RIVAL_SHARE)
    return [pair for pair in pairs if pair[1] >= limit]
