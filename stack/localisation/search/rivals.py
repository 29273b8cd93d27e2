"""Rival poses: which candidates of a global search remain beside the best one.

A single scan of a corridor with equal rooms fits several places. The candidates with a share of the
probability become modes of the particle filter, which follows and weighs them.

Places are compared by the unmapped and missing objects that each of them needs. How well the beams
end at the walls is no evidence for one place against another: a wall is anywhere within its cell,
so that of two equal rooms one fits every scan a little better, in all its beams at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

from stack.errors import NavigationError
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.search.matches import GlobalMatch
from stack.types import FailureCode


@dataclass(frozen=True, slots=True)
class Resolution:
    """Result of a global search: where the robot probably is, and where else it may be.

    Attributes:
        best: the most probable pose.
        rivals: the others, most probable first.
        log_weights: of `best` and `rivals`, relative to the largest one.
    """

    best: GlobalMatch
    rivals: tuple[GlobalMatch, ...]
    log_weights: tuple[float, ...]


def weighed(
    matches: Sequence[GlobalMatch], parameters: LocaliserParameters,
    log_priors: Sequence[float] = (),
) -> list[tuple[GlobalMatch, float]]:  # fmt: skip
    """Return the matches with their log-weights, most probable first; equal ones by evidence.

    The weights are relative to the largest one.
    """
    p, least = parameters, min((match.cost for match in matches), default=0.0)
    pairs = [
        (match, prior - min(p.evidence_cap, max(0.0, match.cost - least - p.rival_dead_zone)))
        for match, prior in zip(matches, log_priors or [0.0] * len(matches), strict=True)
    ]
    top = max((weight for _, weight in pairs), default=0.0)
    pairs = [(match, weight - top) for match, weight in pairs]
    return sorted(pairs, key=lambda pair: (-pair[1], -pair[0].evidence))


def resolve(
    candidates: Sequence[GlobalMatch], least_fit: float, parameters: LocaliserParameters,
    log_priors: Sequence[float] = (),
) -> Resolution:  # fmt: skip
    """Return the best candidate and its rivals.

    Args:
        candidates: distinct poses.
        least_fit: smallest accepted fit of the best one.
        parameters: `rival_share`, `rival_dead_zone` and `evidence_cap`.
        log_priors: of each candidate, at most 0; empty: all are as probable.

    Raises:
        NavigationError: LOST if no candidate fits.
    """
    pairs = weighed(candidates, parameters, log_priors)
    fit = pairs[0][0].fit if pairs else 0.0
    if not pairs or fit < least_fit:
        raise NavigationError(
            FailureCode.LOST,
            f"the best place on the map explains {fit:.0%} of the scan, below {least_fit:.0%}; "
            "drive to a place where more of the map is visible",
        )
    limit = log(parameters.rival_share)
    kept = [pair for pair in pairs if pair[1] >= limit]
    best, *rivals = (match for match, _ in kept)
    return Resolution(best, tuple(rivals), tuple(weight for _, weight in kept))
