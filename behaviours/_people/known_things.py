"""Which of the standing objects may be a person who was walking a moment ago.

A standing person and a bin look alike to a lidar. What stood there before the person was followed,
or while they were in sight elsewhere, is another thing, and so is what has another size.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import dist

from stack.types import StandingObject

SAME_PLACE = 0.4
"""Metres between two views of a thing that stands."""

SAME_SIZE = 0.1
"""Metres by which the radius of a person differs between views."""

SAME_AS_PERSON = 1.0
"""Metres from the person within which an object may be them: tracks that are lost are expected to
walk on, and the person has stopped."""


class KnownThings:
    """Places of objects that stood there while the person was in sight.

    Args:
        began: seconds, since when the person is followed.
    """

    def __init__(self, began: float) -> None:
        self._began = began
        self._places: list[tuple[float, float]] = []

    def note(self, standing: Iterable[StandingObject], person: tuple[float, float]) -> None:
        """Remember what stands while the person is in sight at a place, map frame."""
        for item in standing:
            if dist(item.position, person) > SAME_AS_PERSON and not self._is_known(item):
                self._places.append(item.position)

    def people(
        self, standing: Iterable[StandingObject], radius: float
    ) -> tuple[StandingObject, ...]:
        """Return the unknown objects of the size of a person, who has this radius in metres."""
        return tuple(
            item for item in standing
            if abs(item.radius - radius) <= SAME_SIZE and not self._is_known(item)
        )  # fmt: skip

    def _is_known(self, item: StandingObject) -> bool:
        return item.since < self._began or any(
            dist(item.position, place) <= SAME_PLACE for place in self._places
        )
