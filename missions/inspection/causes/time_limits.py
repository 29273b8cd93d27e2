"""Causes of nodes that ran out of time, although the robot got ahead."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import hypot

import numpy as np

from missions.inspection.causes.cause import BELIEVED, CERTAIN, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence
from missions.inspection.page.failed_nodes import FailedNode
from stack.telemetry.records import Snapshot
from stack.types import FailureCode
from stack.types.limitations import CAUSES as CAUSES_OF_LIMITS

HALTING, STEADY = 0.4, 0.8
"""Share of the time up to which a robot that moves is mostly held up by something else, and from
which on it gets ahead steadily: it also plans and starts."""

SPARE = 1.5
"""Factor of a time limit on the time that a drive needs."""

CRUISE = "controller.cruise_speed"

TOLD = 1.0
"""Seconds of loss from which on the cause of the slower speed is named."""


def time_limit(evidence: Evidence) -> Cause | None:
    """The time limit ran out while the robot got ahead all the time."""
    failed = evidence.failed
    if failed is None or failed.code != FailureCode.TIMED_OUT or evidence.is_stalled:
        return None
    inside = [shot for shot in evidence.shots if shot.time >= failed.begin]
    moving = sum(not shot.measured.stands for shot in inside) / len(inside)
    took, pose = failed.time - failed.begin, evidence.last.pose
    slowed = max(evidence.held_share(cause) for cause in CAUSES_OF_LIMITS)
    left, advice = _left(inside, failed)
    facts = (
        *left,
        Fact(f"it moved for {moving:.0%} of the {took:.1f} s of {failed.name}", failed.time,
             (pose.x, pose.y), BELIEVED),
        *_slower(evidence),
    )  # fmt: skip
    steady = share(moving - HALTING, STEADY - HALTING) * _straight(inside)
    gained = steady * (1.0 - max(slowed, _unused(evidence)))
    sentence = f"{failed.name} ended after {took:.1f} s, and the robot got ahead all the time"
    return Cause("time limit too short", CERTAIN * evidence.trust * gained, sentence, facts, advice)


def _left(inside: Sequence[Snapshot], failed: FailedNode) -> tuple[list[Fact], str]:
    """Return what was left of the last drive, and the advice that follows from it."""
    drive = _last_drive(inside)
    advice = f"allow more time at {failed.where}, or let it drive faster"
    if len(drive) < 2:
        return [], advice
    first, last = _way(drive[0]), _way(drive[-1])
    fact = Fact(f"{last:.1f} of {first:.1f} m to the goal were left", failed.time)
    took = drive[-1].time - drive[0].time
    if last < first:
        needed = failed.time - failed.begin + took * last / (first - last)
        advice = f"allow about {SPARE * needed:.0f} s at {failed.where}, or let it drive faster"
    return [fact], advice


def _straight(inside: Sequence[Snapshot]) -> float:
    """Return the share of the last drive's metres that brought the robot nearer; 1 without one."""
    drive = _last_drive(inside)
    driven = sum(one.odometry.distance_to(other.odometry) for one, other in pairwise(drive))
    return share(_way(drive[0]) - _way(drive[-1]), driven) if driven else 1.0


def _last_drive(inside: Sequence[Snapshot]) -> list[Snapshot]:
    """Return the snapshots of the drive to the last goal; empty without one."""
    goal = inside[-1].goal
    return [shot for shot in inside if goal is not None and shot.goal == goal]


def _way(shot: Snapshot) -> float:
    """Return the metres to the goal: on the path, or straight without one."""
    assert shot.goal is not None
    if shot.path is None or len(shot.path.points) < 2:
        return shot.pose.distance_to(shot.goal)
    points = shot.path.points[:, :2]
    here = int(np.hypot(points[:, 0] - shot.pose.x, points[:, 1] - shot.pose.y).argmin())
    rest = np.diff(points[here:], axis=0)
    return float(np.hypot(rest[:, 0], rest[:, 1]).sum()) + hypot(
        points[here, 0] - shot.pose.x, points[here, 1] - shot.pose.y
    )


def _slower(evidence: Evidence) -> list[Fact]:
    """Return what made the robot slower, and its top speed."""
    seconds: dict[str, float] = {}
    for shot, span in zip(evidence.shots, evidence.spans, strict=True):
        for one in shot.limitations:
            seconds[one.cause] = seconds.get(one.cause, 0.0) + float(span)
    facts = [
        Fact(f"limited for {length:.1f} s by: {cause}")
        for cause, length in seconds.items()
        if length >= TOLD
    ]
    speed, most = evidence.last.parameters.get(CRUISE), evidence.facts.linear_speed
    if speed is not None and most:
        facts.append(Fact(f"{CRUISE} {speed:g} m/s; the robot's limit {most:g} m/s"))
    return facts


def speed_low(evidence: Evidence) -> Cause | None:
    """The time ran out because the speed was set far below the robot's."""
    failed, unused = evidence.failed, _unused(evidence)
    if failed is None or failed.code != FailureCode.TIMED_OUT or not unused or evidence.is_stalled:
        return None
    return Cause(
        "setting does not fit", CERTAIN * unused,
        f"`{CRUISE}` is set to a small part of the robot's speed", tuple(_slower(evidence)),
        f"raise `{CRUISE}`, or allow more time at {failed.where}",
    )  # fmt: skip


def _unused(evidence: Evidence) -> float:
    """Return the share of the robot's speed that the mission does without by a setting."""
    speed, most = evidence.last.parameters.get(CRUISE), evidence.facts.linear_speed
    is_set = CRUISE in (evidence.facts.settings or {})
    if speed is None or not most or not is_set:
        return 0.0
    return 1.0 - share(float(speed), most)


CAUSES = (time_limit, speed_low)
