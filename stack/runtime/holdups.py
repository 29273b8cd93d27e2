"""What has held the robot, and for how long: events, seconds for the report, and a sentence."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from stack.navigation.landmarks import Landmarks
from stack.types import Limitation, Pose2D

TOLD_AFTER = 1.0
"""Seconds for which the robot is held by one cause before an event tells it."""

GAP = 0.5
"""Seconds for which a cause may be absent and still count as one: it flickers with each scan."""

REMEMBERED = 600.0
"""Seconds of which the history is kept, for the sentences of failures."""

Emit = Callable[..., Any]
"""emit(kind, text, source=…, **fields)"""


@dataclass(slots=True)
class Holdup:
    """A time in which the robot stood, or was slower, for one cause.

    Attributes:
        stands: whether it stood.
        cause: one of `stack.types.limitations.CAUSES`.
        begin: first step of it, seconds.
        last: last step of it.
        held: seconds of the steps of it.
        text: the newest sentence.
        place: the newest place of the cause, map frame; None if it is nowhere.
        is_told: whether an event has told its begin.
    """

    stands: bool
    cause: str
    begin: float
    last: float
    held: float
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
        self._seconds: defaultdict[tuple[str, str], float] = defaultdict(float)
        self._current: dict[tuple[bool, str], Holdup] = {}
        self._past: deque[Holdup] = deque()

    def seconds(self) -> dict[str, dict[str, float]]:
        """Seconds for which the robot was held: `stopped` | `slower` -> cause -> seconds."""
        found: dict[str, dict[str, float]] = {"stopped": {}, "slower": {}}
        for (effect, cause), seconds in sorted(self._seconds.items()):
            found[effect][cause] = round(seconds, 3)
        return found

    def update(self, limitations: Iterable[Limitation], pose: Pose2D, now: float) -> None:
        """Take what limits the robot in this step.

        Args:
            limitations: of this step.
            pose: of the base, map frame.
            now: seconds.
        """
        for limitation in limitations:
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
        inside = [
            (min(span.held, span.last - max(span.begin, since) + self._period), span)
            for span in spans
            if span.stands and span.last >= since
        ]
        by_cause: defaultdict[str, float] = defaultdict(float)
        for seconds, span in inside:
            by_cause[span.cause] += max(0.0, seconds)
        if not by_cause:
            return ""
        cause = max(by_cause, key=lambda name: by_cause[name])
        length = now - since
        if by_cause[cause] < 0.1 * length:
            return ""
        newest = next(span for _, span in reversed(inside) if span.cause == cause)
        return f"held {by_cause[cause]:.1f} of {length:.1f} s: {self._told(newest)}"

    def _add(self, limitation: Limitation, pose: Pose2D, now: float) -> None:
        effect = "stopped" if limitation.stands else "slower"
        self._seconds[effect, limitation.cause] += self._period
        key = limitation.stands, limitation.cause
        holdup = self._current.get(key)
        if holdup is None:
            holdup = Holdup(*key, begin=now, last=now, held=0.0, text="")
            self._current[key] = holdup
        holdup.last, holdup.text = now, limitation.text
        holdup.held += self._period
        if limitation.at is not None:
            there = pose.compose(Pose2D(*limitation.at))
            holdup.place = there.x, there.y
        if holdup.stands and not holdup.is_told and now - holdup.begin >= TOLD_AFTER:
            holdup.is_told = True
            self._emit("held", self._told(holdup), **_fields(holdup))

    def _ended(self, holdup: Holdup) -> None:
        if holdup.is_told:
            text = f"held no longer by {holdup.cause}, after {holdup.held:.1f} s"
            self._emit("held_end", text, seconds=holdup.held, **_fields(holdup))
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
    return {"cause": holdup.cause, "begin": holdup.begin, "place": list(place)}
