"""Memory of people who stood when they got out of sight: behind the robot, or behind something.

A track ends a second after its object was seen last. Who stood still is most likely there when the
robot looks again, and is then the same person and no new thing.
"""

from __future__ import annotations

from collections.abc import Iterable

from stack.perception.tracking.clusters import Disc
from stack.perception.tracking.object_filter import ObjectFilter
from stack.perception.tracking.view import View

RESTING_SPEED = 0.2
"""m/s below which an object stood when it was seen last."""

REMEMBERED = 60.0
"""Seconds for which who is out of sight is remembered."""

STEPPED = 0.4
"""Metres by which who stands may have moved while nobody looked."""

ABSENT = 2
"""Scans in a row that see through an object's place after which it is not there."""


class OutOfSight:
    """Moving objects at rest that no scan shows any more, until scans see through their places."""

    def __init__(self) -> None:
        self._items: list[ObjectFilter] = []

    @property
    def ids(self) -> frozenset[int]:
        """Ids of those who are remembered."""
        return frozenset(item.id for item in self._items)

    def clear(self) -> None:
        """Forget them all."""
        self._items = []

    def note(self, lost: Iterable[ObjectFilter]) -> None:
        """Remember those of the lost objects who stood and whose place nothing saw through."""
        self._items += [
            item for item in lost
            if item.has_moved and item.absent < ABSENT and item.speed <= RESTING_SPEED
        ]  # fmt: skip

    def look(self, view: View, time: float) -> None:
        """Forget those whose place two scans see through, and those of long ago."""
        for item in self._items:
            item.absent = item.absent + 1 if item.is_seen_through(view) else 0
        oldest = time - REMEMBERED
        self._items = [i for i in self._items if i.absent < ABSENT and i.seen_at >= oldest]

    def take(self, disc: Disc, stands_since: float) -> ObjectFilter | None:
        """Return whom a disc shows that nothing else explains, and forget them; None: nobody.

        Args:
            disc: in the newest scan.
            stands_since: when something was known to stand there first, seconds; inf: never.
        """
        near = [
            item for item in self._items
            if item.is_like(disc) and item.away(disc) <= STEPPED and item.seen_at < stands_since
        ]  # fmt: skip
        if not near:
            return None
        found = min(near, key=lambda item: item.away(disc))
        self._items.remove(found)
        return found
