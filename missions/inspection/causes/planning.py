"""Causes in plans and settings: a slow planner, and parameters that do not fit the robot."""

from __future__ import annotations

from math import hypot

from missions.inspection.causes.cause import CERTAIN, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence
from stack.safety.parameters import SafetyParameters
from stack.types import FailureCode
from stack.types.limitations import OBSTACLE

FRUITLESS = frozenset(
    {FailureCode.NO_VALID_PATH, FailureCode.START_OCCUPIED, FailureCode.GOAL_OCCUPIED,
     FailureCode.START_OUTSIDE_MAP, FailureCode.GOAL_OUTSIDE_MAP}
)  # fmt: skip
"""Failures of plans that were computed."""

TIMEOUT = "timeout"
"""Kind of the node that limits time."""

NAMED, OTHER = 0.97, 0.5
"""Strength of a warning about the line that failed, which explains what it led to, and about
another line."""

OF_SETTINGS = frozenset({"W126", "W141", "W142", "W144", "W145", "W148", "W149"})
"""Warnings that compare settings with the robot and with each other; others are about places."""


def planner_slow(evidence: Evidence) -> Cause | None:
    """The planner gave up, or the robot waited for its plans."""
    failed = evidence.failed
    if failed is None or failed.code in FRUITLESS:
        return None
    gave_up = failed.code == FailureCode.TIMED_OUT and failed.kind != TIMEOUT
    waits = evidence.values(lambda shot: shot.goal is not None and shot.path is None)
    waited = float((waits * evidence.spans)[evidence.times >= failed.begin].sum())
    if not waited:
        return None
    strength = CERTAIN * (1.0 if gave_up else share(waited, failed.time - failed.begin))
    latency = evidence.last.parameters.get("navigator.planning_latency")
    facts = (
        *([Fact(failed.message, failed.time)] if gave_up else []),
        Fact(f"{waited:.1f} of {failed.time - failed.begin:.1f} s were spent without a path"),
        *([Fact(f"navigator.planning_latency: {latency:g} s")] if latency is not None else []),
    )
    return Cause(
        "planner too slow", strength, "the robot waited for a plan", facts,
        "use a faster planner or a coarser costmap (`costmap.map_resolution`), raise "
        "`planner.max_expansions`, or split the way with via poses",
    )  # fmt: skip


def setting_unfit(evidence: Evidence) -> Cause | None:
    """A setting does not fit the robot or another setting; `check` warned of it."""
    failed = evidence.failed
    if failed is None or failed.code in FRUITLESS:
        return None
    warned = sorted(
        (one for one in evidence.facts.warnings if one.code in OF_SETTINGS),
        key=lambda one: one.line != failed.line_number,
    )
    if not warned:
        return None
    is_named = warned[0].line == failed.line_number
    facts = tuple(Fact(f"{one.file}:{one.line} {one.code} {one.sentence}") for one in warned[:3])
    return Cause(
        "setting does not fit", NAMED if is_named else OTHER,
        f"a setting does not fit the robot or another setting: {warned[0].sentence}",
        facts, warned[0].hint or "follow the warnings of `treepilot check`",
    )  # fmt: skip


def padding_wide(evidence: Evidence) -> Cause | None:
    """Safety keeps a distance, set above its default, at which the robot cannot go on."""
    held = evidence.held_share(OBSTACLE)
    padding = evidence.last.parameters.get("safety.padding")
    if not held or padding is None or padding <= SafetyParameters().padding:
        return None
    away = [
        hypot(*one.at)
        for shot in evidence.shots[-evidence.stalled :]
        for one in shot.limitations
        if one.cause == OBSTACLE and one.at is not None
    ]
    room = min(away, default=0.0) - evidence.inscribed_radius
    default = SafetyParameters().padding
    facts = (
        Fact(f"safety.padding is {padding:g} m; default {default:g} m", evidence.end),
        Fact(f"the obstacle is {room:.2f} m from the robot"),
        *evidence.held_facts(OBSTACLE),
    )  # fmt: skip
    return Cause(
        "setting does not fit", CERTAIN * held * (1.0 if room > default else 0.5),
        "the distance that safety keeps (`safety.padding`) leaves no room", facts,
        "use a smaller `safety.padding`, or leave more room",
    )  # fmt: skip


CAUSES = (planner_slow, setting_unfit, padding_wide)
