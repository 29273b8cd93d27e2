"""Clock of a device, seen through a link with delays: its offset and drift against our clock.

A device stamps a measurement with its own clock; we note when the message came. The difference is
the offset of the two clocks plus a delay, and delays are never negative: the true relation is the
highest line below all points (stamp, arrival - stamp). That line is an edge of their lower convex
hull; late messages lie above it and have no influence (L. Zhang, Z. Liu, C. H. Xia, "Clock
synchronization algorithms for network measurements", INFOCOM 2002; A. Harrison, P. Newman,
"TICSync", ICRA 2011).

What no one-way message shows is the shortest delay of the link: stamps are late by that much.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from math import floor

BUCKET, BUCKETS = 1.0, 60
"""Seconds of the device's clock of which the quickest message is kept, and their number."""

MAX_DRIFT = 2e-4
"""Largest drift that is believed: quartz clocks are within 1e-4 of each other."""

SETTLED = 10.0
"""Seconds of messages before a drift is estimated; until then it is 0."""

STEP = 1.0
"""Seconds by which a message may be earlier or later than expected and still teach something."""

AGREEING = 5
"""Messages in turn that must agree on another offset before it is believed."""

LATE_FOR = 3.0
"""Seconds for which messages are late by more than STEP before the offset is believed to have
changed. What comes after a link has stalled comes at once, and is over sooner. A stamp that is
older than the newest by more than this is not of a message that was overtaken."""

SHIFT, SHIFTED = 0.1, 3
"""Seconds by which even the quickest messages of so many buckets in turn must be late before the
offset is believed to have changed: by less, a drift is estimated."""


class DeviceClock:
    """Converts stamps of a device to our clock; notices when the device was restarted.

    Attributes:
        restarts: how often the device's clock has been found to be another one.
    """

    def __init__(self) -> None:
        self.restarts = 0
        self._forget()

    def _forget(self) -> None:
        self._buckets: deque[tuple[int, float, float]] = deque(maxlen=BUCKETS)
        self._middle, self._offset, self._drift = 0.0, 0.0, 0.0
        self._strange: deque[tuple[float, float]] = deque(maxlen=AGREEING)
        self._strange_since, self._has_advanced = 0.0, False

    @property
    def drift(self) -> float:
        """Seconds that our clock gains on the device's in one of its seconds."""
        return self._drift

    @property
    def newest(self) -> float | None:
        """Newest stamp, seconds of the device's clock; None before the first message."""
        return self._buckets[-1][1] if self._buckets else None

    def offset_at(self, stamp: float) -> float:
        """Our clock minus the device's at a stamp, seconds; 0 before the first message."""
        return self._offset + self._drift * (stamp - self._middle)

    def convert(self, stamp: float, arrival: float) -> float | None:
        """Learn from a message; return its stamp on our clock, seconds; never after `arrival`.

        None if the stamp is not of the clock as it is known: the message is wrong, or the device
        was restarted; the next few messages will tell.

        Args:
            stamp: seconds of the device's clock.
            arrival: when the message came, seconds of our clock.
        """
        if not self._has_advanced and self._buckets and stamp == self._buckets[-1][1]:
            self._buckets.clear()  # a clock that does not run yet
        if not self._buckets:
            self._learn(stamp, arrival)
            return arrival
        self._has_advanced = True
        delay = arrival - stamp - self.offset_at(stamp)
        if abs(delay) <= STEP:
            self._strange.clear()
            self._learn(stamp, arrival)
            return min(arrival, stamp + self.offset_at(stamp))
        is_late = delay > 0.0 and stamp > self._buckets[-1][1] - LATE_FOR
        if self._believes(stamp, arrival, LATE_FOR if is_late else 0.0):
            return min(arrival, stamp + self.offset_at(stamp))
        return stamp + self.offset_at(stamp) if is_late else None

    def _believes(self, stamp: float, arrival: float, patience: float) -> bool:
        """Whether messages in turn agree on another clock, from which it then starts again.

        Every clock runs forwards: messages that overtake each other are late ones.
        """
        if self._strange and stamp < self._strange[-1][0]:
            self._strange.clear()
        if not self._strange:
            self._strange_since = arrival
        self._strange.append((stamp, arrival))
        offsets = [there - here for here, there in self._strange]
        if len(offsets) < AGREEING or max(offsets) - min(offsets) > STEP:
            return False
        if arrival - self._strange_since < patience:
            return False
        agreeing = list(self._strange)
        self._forget()
        self.restarts += 1
        for one in agreeing:
            self._learn(*one)
        return True

    def _learn(self, stamp: float, arrival: float) -> None:
        """Keep the quickest message of each bucket; those out of order teach nothing."""
        number, offset = floor(stamp / BUCKET), arrival - stamp
        last = self._buckets[-1] if self._buckets else None
        if last is not None and number <= last[0]:
            if number < last[0] or offset >= last[2]:
                return
            self._buckets.pop()
        elif self._is_shifted:
            self._buckets = deque(list(self._buckets)[-SHIFTED:], maxlen=BUCKETS)
        self._buckets.append((number, stamp, offset))
        self._fit()

    @property
    def _is_shifted(self) -> bool:
        """Whether the newest complete buckets are all later than the line."""
        newest = list(self._buckets)[-SHIFTED:]
        return len(newest) == SHIFTED and all(
            offset - self.offset_at(stamp) > SHIFT for _, stamp, offset in newest
        )

    def _fit(self) -> None:
        """Find the highest line below all points: the edge of their lower hull under the mean."""
        points = [(stamp, offset) for _, stamp, offset in self._buckets]
        first, last = points[0][0], points[-1][0]
        self._middle = sum(stamp for stamp, _ in points) / len(points)
        self._drift = 0.0
        if last - first >= SETTLED:
            before, after = _edge_at(_lower_hull(points), self._middle)
            slope = (after[1] - before[1]) / (after[0] - before[0])
            self._drift = min(max(slope, -MAX_DRIFT), MAX_DRIFT)
        self._offset = min(
            offset - self._drift * (stamp - self._middle) for stamp, offset in points
        )


Point = tuple[float, float]


def _lower_hull(points: list[Point]) -> list[Point]:
    """Corners of the lower convex hull of points in order of x (Andrew's monotone chain)."""
    hull: list[Point] = []
    for point in points:
        while len(hull) >= 2 and _turns_right(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    return hull


def _turns_right(a: Point, b: Point, c: Point) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) <= (b[1] - a[1]) * (c[0] - a[0])


def _edge_at(hull: list[Point], x: float) -> tuple[Point, Point]:
    """The edge over x, which is between the first and the last corner."""
    for before, after in pairwise(hull):
        if x <= after[0]:
            return before, after
    return hull[-2], hull[-1]
