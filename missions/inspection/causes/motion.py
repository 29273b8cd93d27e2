"""What the wheels say of a motion against what the robot did: slip, and jumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from missions.inspection.causes.cause import BELIEVED, CERTAIN, TRULY, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence
from stack.telemetry.records import Snapshot
from stack.types import Pose2D, wrap_angle

COMMANDED = 0.5
"""Metres commanded from which on slip is judged over the whole time."""

SPAN = 1.0
"""Seconds over which wheels and robot are compared."""

SLID, UNTURNED = 0.3, 0.5
"""Metres in this time by which wheels and robot differ when they slip; radians not turned."""

JUMP, JUMP_SPEED = 0.5, 3.0
"""Metres between two snapshots, and metres per second, by which no floor makes a robot slide."""


@dataclass(frozen=True, slots=True)
class Jump:
    """A motion that no wheels made.

    Attributes:
        time: robot time after it, seconds.
        distance, wheels: metres moved, and metres that the wheels measured meanwhile.
        at: (x, y) after it in the map frame, metres.
    """

    time: float
    distance: float
    wheels: float
    at: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Slip:
    """How far wheels and robot disagreed in a time.

    Attributes:
        strength: share of the larger motion that the other one lacks.
        fact: with figures, time and place.
    """

    strength: float
    fact: Fact


def place_of(shot: Snapshot) -> Pose2D:
    """Return where the robot was: the truth of a simulation, else the pose matched to the map."""
    return shot.truth or shot.pose


def is_jump(one: Snapshot, other: Snapshot) -> bool:
    """Whether the robot, or the estimate of it, was set to another place between snapshots."""
    moved = place_of(one).distance_to(place_of(other))
    beyond = moved - one.odometry.distance_to(other.odometry)
    return beyond > max(JUMP, JUMP_SPEED * (other.time - one.time))


def jump_of(shots: Sequence[Snapshot]) -> Jump | None:
    """Return the last jump; None without one."""
    for one, other in reversed(list(pairwise(shots))):
        if is_jump(one, other):
            place = place_of(other)
            return Jump(
                other.time, place_of(one).distance_to(place),
                one.odometry.distance_to(other.odometry), (place.x, place.y),
            )  # fmt: skip
    return None


def wheel_slip(evidence: Evidence) -> Cause | None:
    """Wheels and robot disagree: one moves without the other, or a turn is not done."""
    slips = [slip for slip in (_not_driven(evidence), _apart(evidence)) if slip is not None]
    if not slips:
        return None
    worst = max(slips, key=lambda slip: slip.strength)
    touched = bool(evidence.told("contact", evidence.times[0]))
    facts = (
        *(slip.fact for slip in sorted(slips, key=lambda slip: -slip.strength)),
        *([Fact("the robot touched something meanwhile")] if touched else []),
    )
    return Cause(
        "wheel slip", CERTAIN * worst.strength * (0.6 if touched else 1.0),
        "the wheels slipped: the robot did not move as they turned", facts,
        "look at the floor, the tyres and what the robot may push against; drive slower there, and "
        "use odometry by scans (`odometry`)",
    )  # fmt: skip


def _apart(evidence: Evidence) -> Slip | None:
    """Return the second in which wheels and robot were furthest apart; None if they agreed."""
    shots, found = evidence.shots, list[Slip]()
    jumps = np.cumsum([0, *(is_jump(one, other) for one, other in pairwise(shots))])
    for last in range(1, len(shots)):
        first = int(np.searchsorted(evidence.times, evidence.times[last] - SPAN - 1e-6))
        first = min(first, last - 1)
        if jumps[first] == jumps[last]:
            found += _slips(shots[first : last + 1])
    return max(found, key=lambda slip: slip.strength, default=None)


def _slips(shots: Sequence[Snapshot]) -> list[Slip]:
    one, other = shots[0], shots[-1]
    start, end = place_of(one), place_of(other)
    wheels, moved = one.odometry.distance_to(other.odometry), start.distance_to(end)
    seconds = other.time - one.time
    found = []
    if abs(moved - wheels) > SLID:
        text = f"the robot moved {moved:.2f} m, and the wheels {wheels:.2f} m, in {seconds:.1f} s"
        missing = share(abs(moved - wheels), max(moved, wheels))
        found.append(Slip(missing, _fact(text, other)))
    asked = sum(
        min(a.commanded.angular, b.commanded.angular, key=abs) * (b.time - a.time)
        for a, b in pairwise(shots)
        if a.commanded.angular * b.commanded.angular > 0.0
    )
    turned = wrap_angle(end.heading - start.heading)
    missing = abs(asked) - max(0.0, turned * np.sign(asked))
    if missing > UNTURNED:
        text = f"{asked:+.2f} rad were commanded and {turned:+.2f} rad turned in {seconds:.1f} s"
        found.append(Slip(share(missing, abs(asked)), _fact(text, other)))
    return found


def _not_driven(evidence: Evidence) -> Slip | None:
    """Return what was commanded and not driven, in the whole time or in the standstill."""
    first, commanded, moved = max(
        (_driven(evidence, first) for first in (0, len(evidence.shots) - evidence.stalled)),
        key=lambda one: share(one[1] - one[2], one[1]),
    )
    if commanded < COMMANDED or moved > commanded:
        return None
    seconds = evidence.times[-1] - evidence.times[first]
    text = f"{commanded:.1f} m were commanded and {moved:.1f} m moved in the last {seconds:.0f} s"
    return Slip(share(commanded - moved, commanded), _fact(text, evidence.last))


def _fact(text: str, shot: Snapshot) -> Fact:
    """Return a fact with the place of the robot."""
    place = place_of(shot)
    return Fact(text, shot.time, (place.x, place.y), TRULY if shot.truth else BELIEVED)


def _driven(evidence: Evidence, first: int) -> tuple[int, float, float]:
    """Return the first snapshot, and the metres commanded and driven from it on.

    Only where two snapshots in turn command the same direction: a command that flickers, as before
    an obstacle, moves no robot.
    """
    shots = evidence.shots[first:]
    commanded = moved = 0.0
    for one, other in pairwise(shots):
        speeds = one.commanded.linear, other.commanded.linear
        if speeds[0] * speeds[1] > 0.0:
            commanded += min(map(abs, speeds)) * (other.time - one.time)
            moved += place_of(one).distance_to(place_of(other))
    return (first, commanded, moved) if commanded >= COMMANDED else (first, 0.0, 0.0)


CAUSES = (wheel_slip,)
