"""What has held the robot, and for how long: events, and a sentence for failures.

A limitation holds the robot in a step if it takes more than half of the wanted velocity; a robot
that must stand loses all of it. A hold-up lasts from its first to its last step: all that is told
of a run's hold-ups comes from their events (`holds_of`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import inf
from typing import Any

from stack.navigation.landmarks import Landmarks
from stack.telemetry.records import Event
from stack.types import Limitation, Pose2D
from stack.types.limitations import SLOWER, STOPPED

TOLD_AFTER = 1.0
"""Seconds for which the robot is held by one cause before an event tells it."""

HELD_BELOW = 0.5
"""Share of the wanted velocity below which a robot is held by what makes it slower."""

GAP = 0.5
"""Seconds for which a cause may be absent and still count as one: it flickers with each scan."""

REMEMBERED = 600.0
"""Seconds of which the history is kept, for the sentences of failures."""

Emit = Callable[..., Any]
"""emit(kind, text, source=…, **fields)"""


@dataclass(slots=True)
class Holdup:
    """A time in which the robot stood, or was held to less than half its velocity, by one cause.

    Attributes:
        effect: stopped | slower.
        cause: one of `stack.types.limitations.CAUSES`.
        begin: first step of it, seconds.
        last: last step of it.
        text: the newest sentence.
        place: the newest place of the cause, map frame; None if it is nowhere.
        is_told: whether an event has told its begin.
    """

    effect: str
    cause: str
    begin: float
    last: float
    text: str
    place: tuple[float, float] | None = None
    is_told: bool = False


class Holdups:
    """Follows what holds the robot.

    Args:
        emit: called for each hold-up that lasts.
        period: seconds between steps.
        landmarks: names of places, for sentences.
    """

    def __init__(self, emit: Emit, period: float, landmarks: Landmarks) -> None:
        self._emit, self._period, self._landmarks = emit, period, landmarks
        self._current: dict[tuple[str, str], Holdup] = {}
        self._past: deque[Holdup] = deque()

    def update(
        self, limitations: Iterable[Limitation], pose: Pose2D, now: float, kept: float
    ) -> None:
        """Take what limits the robot in this step.

        Args:
            limitations: of this step.
            pose: of the base, map frame.
            now: seconds.
            kept: share of the wanted velocity that is driven.
        """
        for limitation in limitations:
            if limitation.stands or kept < HELD_BELOW:
                self._add(limitation, pose, now)
        for key, holdup in list(self._current.items()):
            if holdup.last < now - GAP:
                del self._current[key]
                self._ended(holdup)

    def sentence(self, since: float, now: float) -> str:
        """What held the robot most since a time, as in: held 7.4 of 8 s by an obstacle 0.3 m ahead.

        Empty if nothing held it for a tenth of that time.
        """
        spans = [*self._past, *self._current.values()]
        inside = [span for span in spans if span.last >= since]
        by_cause = {
            cause: covered(
                (max(span.begin, since), min(span.last + self._period, now))
                for span in inside if span.cause == cause
            )
            for cause in {span.cause: None for span in inside}
        }  # fmt: skip
        if not by_cause:
            return ""
        cause = max(by_cause, key=lambda name: by_cause[name])
        length = now - since
        if by_cause[cause] < 0.1 * length:
            return ""
        newest = next(span for span in reversed(inside) if span.cause == cause)
        return f"held {by_cause[cause]:.1f} of {length:.1f} s: {self._told(newest)}"

    def _add(self, limitation: Limitation, pose: Pose2D, now: float) -> None:
        key = STOPPED if limitation.stands else SLOWER, limitation.cause
        holdup = self._current.get(key)
        if holdup is None:
            holdup = Holdup(*key, begin=now, last=now, text="")
            self._current[key] = holdup
        holdup.last, holdup.text = now, limitation.text
        if limitation.at is not None:
            there = pose.compose(Pose2D(*limitation.at))
            holdup.place = there.x, there.y
        if not holdup.is_told and now - holdup.begin >= TOLD_AFTER:
            holdup.is_told = True
            self._emit("held", self._told(holdup), **_fields(holdup))

    def _ended(self, holdup: Holdup) -> None:
        if holdup.is_told:
            seconds = holdup.last - holdup.begin + self._period
            text = f"no longer {holdup.effect} by: {holdup.cause}, after {seconds:.1f} s"
            self._emit("held_end", text, seconds=seconds, **_fields(holdup))
        self._past.append(holdup)
        while self._past and self._past[0].last < holdup.last - REMEMBERED:
            self._past.popleft()

    def _told(self, holdup: Holdup) -> str:
        """The sentence of a hold-up with its place on the map."""
        if holdup.place is None:
            return holdup.text
        return f"{holdup.text} at {self._landmarks.where(holdup.place)}"


def _fields(holdup: Holdup) -> dict[str, Any]:
    place = () if holdup.place is None else holdup.place
    return {
        "effect": holdup.effect, "cause": holdup.cause, "begin": holdup.begin, "place": list(place),
    }  # fmt: skip


def covered(spans: Iterable[tuple[float, float]]) -> float:
    """Return the seconds that times cover; what several of them cover counts once."""
    seconds, reached = 0.0, -inf
    for begin, end in sorted(spans):
        seconds += max(0.0, end - max(begin, reached))
        reached = max(reached, end)
    return seconds


@dataclass(frozen=True, slots=True)
class Hold:
    """A hold-up as the events of a run tell it: effect, cause, begin and end in seconds."""

    effect: str
    cause: str
    begin: float
    end: float


def holds_of(events: Iterable[Event], end: float) -> list[Hold]:
    """Return the hold-ups that events tell, in order of their ends.

    Args:
        events: of a run; others than `held` and `held_end` are ignored.
        end: of the run, seconds: until then a hold-up lasts that has not ended.
    """
    begun: dict[tuple[str, str], float] = {}
    found: list[Hold] = []
    for event in events:
        key = str(event.fields.get("effect", STOPPED)), str(event.fields.get("cause", ""))
        if event.kind == "held":
            begun[key] = _number(event.fields.get("begin"), event.time)
        elif event.kind == "held_end":
            begin = begun.pop(key, event.time)
            seconds = _number(event.fields.get("seconds"), event.time - begin)
            found.append(Hold(*key, begin, begin + seconds))
    return found + [Hold(*key, begin, max(begin, end)) for key, begin in begun.items()]


def held_seconds(holds: Iterable[Hold]) -> dict[str, dict[str, float]]:
    """Return the seconds of hold-ups: `stopped` | `slower` -> cause -> seconds."""
    found: dict[str, dict[str, float]] = {STOPPED: {}, SLOWER: {}}
    for hold in sorted(holds, key=lambda one: (one.effect, one.cause)):
        causes = found.setdefault(hold.effect, {})
        causes[hold.cause] = round(causes.get(hold.cause, 0.0) + hold.end - hold.begin, 3)
    return found


def _number(value: object, default: float) -> float:
    """A figure of an event; another version may have written something else."""
    return float(value) if isinstance(value, int | float) else default
