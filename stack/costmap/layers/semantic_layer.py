"""Semantic layer: costs around recognised things, by what they are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import floor, hypot
from typing import Any, ClassVar

import numpy as np

from stack.costmap.layer import (
    Box,
    Canvas,
    Layer,
    LayerUpdate,
    Region,
    joined,
)
from stack.errors import ParameterError
from stack.parameters import build, parameter
from stack.types import INSCRIBED_COST, PERSON, Footprint

SAME_PLACE = 0.5
"""Distance up to which a detection is a remembered thing of its label, m."""

FADING_STEPS = 10
"""Steps in which a remembered cost falls to 0; each repaints the cells around the thing."""

NEW_SHARE = 0.4
"""Weight of a new detection in the remembered position."""


@dataclass(frozen=True)
class ThingParameters:
    """Costs around things of a label."""

    label: str = parameter("", help="of detections; `person` also of tracks")
    radius: float = parameter(
        0.6, "m", above=0.0, at_most=5.0, help="distance at which the cost has fallen to 0"
    )
    cost: int = parameter(
        100, at_least=1, at_most=252, help="at the thing; falls with the distance"
    )
    memory: float = parameter(
        60.0, "s", above=0.0, help="time after the last sighting in which the cost falls to 0"
    )


DEFAULT_THINGS = (
    ThingParameters(PERSON, 1.2, 220, 5.0),
    ThingParameters("chair", 0.6, 120, 60.0),
    ThingParameters("door", 0.8, 80, 300.0),
)


@dataclass(frozen=True)
class SemanticParameters:
    """Labels that cost, and the memory of things."""

    things: tuple[Any, ...] = parameter(
        (), public=True,
        help="{label: chair, radius: 0.6 m, cost: 120, memory: 60 s}, …; default: that, person "
        "with 1.2 m, 220 and 5 s, and door with 0.8 m, 80 and 300 s",
    )  # fmt: skip

    def __post_init__(self) -> None:
        object.__setattr__(self, "things", _read_things(self.things))

    @property
    def by_label(self) -> dict[str, ThingParameters]:
        """The settings of each label."""
        return {thing.label: thing for thing in self.things or DEFAULT_THINGS}


def _read_things(raw: Iterable[Any]) -> tuple[ThingParameters, ...]:
    things: list[ThingParameters] = []
    for number, item in enumerate(raw, start=1):
        if isinstance(item, ThingParameters):
            things.append(item)
            continue
        if not isinstance(item, Mapping) or not item.get("label"):
            raise ParameterError(
                "things", f"thing {number}: expected {{label: text, …}}, got {item!r}"
            )
        try:
            things.append(build(ThingParameters, dict(item)))
        except ParameterError as error:
            raise ParameterError("things", f"thing {number}: {error}", error.hint) from None
    labels = [thing.label for thing in things]
    for label in labels:
        if labels.count(label) > 1:
            raise ParameterError("things", f"the label {label!r} is listed twice")
    return tuple(things)


@dataclass(frozen=True, slots=True)
class _Thing:
    """A remembered thing.

    Attributes:
        label: what it is.
        x: metres, map frame.
        y: metres, map frame.
        seen_at: last sighting, seconds.
        track: id of the track; None for things from detections.
    """

    label: str
    x: float
    y: float
    seen_at: float
    track: int | None = None

    def distance_to(self, x: float, y: float) -> float:
        return hypot(self.x - x, self.y - y)


@dataclass(frozen=True, slots=True)
class _Spot:
    """A cost to paint: at its centre, falling linearly to 0 at the radius."""

    x: float
    y: float
    radius: float
    cost: float


class SemanticLayer(Layer):
    """Costs around people, chairs, doors and other things that the object detector recognises.

    A cell at distance d from a thing costs cost · (1 - d / radius); the highest cost counts. It is
    never lethal: what is in the way is an obstacle of the range sensors. A thing that is not seen
    any more keeps its place, and its cost falls to 0 over its `memory`. People are tracks that the
    detector or a depth camera recognised as such, and detections where no track is. The layer
    `social` adds costs along the predicted motion of everything that moves, and nothing around a
    person who stands; this one adds costs around where people are, also when they stand or were
    never seen to move.
    """

    needs = ("camera or depth_camera",)
    Parameters = SemanticParameters
    inflated: ClassVar[bool] = False
    needs_detections: ClassVar[bool] = True
    parameters: SemanticParameters

    def __init__(self, parameters: SemanticParameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._things: list[_Thing] = []
        self._spots: tuple[_Spot, ...] = ()
        self._time = 0.0

    def configure(self, parameters: SemanticParameters) -> None:
        """Apply new costs to the remembered things."""
        self.parameters = parameters
        self._spots = self._painted()

    def update(self, update: LayerUpdate) -> Box:
        """Remember new sightings and let old ones decay; return the box that changed."""
        self._time = update.time
        known = self.parameters.by_label
        for track in update.tracks or ():
            if track.label in known:
                x, y = track.position_after(update.time - track.stamp)
                self._follow(_Thing(track.label, x, y, update.time, track.id))
        for item in update.detections or ():
            if item.label in known:
                self._remember(_Thing(item.label, *item.position, item.stamp))
        self._things = [
            thing for thing in self._things
            if thing.label in known and update.time - thing.seen_at < known[thing.label].memory
        ]  # fmt: skip
        return self._renew()

    def paint(self, canvas: Canvas) -> None:
        """Raise the cost of cells that are known and below INSCRIBED_COST."""
        for spot in self._spots:
            box, cells = canvas.within(self._box(spot))
            x, y = self.frame.middles(box)
            away = np.hypot(x - spot.x, y - spot.y)
            cost = np.rint(np.maximum(spot.cost * (1.0 - away / spot.radius), 0.0)).astype(np.uint8)
            np.copyto(cells, cost, where=(cells < INSCRIBED_COST) & (cost > cells))

    def clear(self, region: Region | None) -> Box:
        if region is None:
            self._things = []
        else:
            self._things = [thing for thing in self._things if not self._is_in(thing, region)]
        return self._renew()

    def _follow(self, seen: _Thing) -> None:
        """Move a tracked thing; what was remembered at its place before is the same one."""
        self._things = [
            thing for thing in self._things
            if thing.track != seen.track
            and not (thing.seen_at < seen.seen_at and self._are_same(thing, seen))
        ]  # fmt: skip
        self._things.append(seen)

    def _remember(self, seen: _Thing) -> None:
        """Add a detection to the nearest remembered thing of its label, or as a new one."""
        near = [thing for thing in self._things if self._are_same(thing, seen)]
        if not near:
            self._things.append(seen)
            return
        known = min(near, key=lambda thing: thing.distance_to(seen.x, seen.y))
        index = self._things.index(known)
        newest = max(known.seen_at, seen.seen_at)
        if known.track is not None:  # the track says where it is while it lasts
            self._things[index] = replace(known, seen_at=newest)
            return
        x, y = known.x + NEW_SHARE * (seen.x - known.x), known.y + NEW_SHARE * (seen.y - known.y)
        self._things[index] = replace(known, x=x, y=y, seen_at=newest)

    def _are_same(self, thing: _Thing, other: _Thing) -> bool:
        near = thing.distance_to(other.x, other.y) <= SAME_PLACE
        return thing.label == other.label and near

    def _is_in(self, thing: _Thing, region: Region) -> bool:
        (x, y), side = self.frame.origin, self.frame.resolution
        row, column = floor((thing.y - y) / side), floor((thing.x - x) / side)
        top, bottom, left, right = region.box
        inside = top <= row < bottom and left <= column < right
        return inside and bool(region.inside[row - top, column - left])

    def _renew(self) -> Box:
        """Compute what is painted; return the box of the differences."""
        before, self._spots = self._spots, self._painted()
        changed = set(before) ^ set(self._spots)
        return joined(map(self._box, changed))

    def _painted(self) -> tuple[_Spot, ...]:
        known, spots = self.parameters.by_label, []
        for thing in self._things:
            settings = known.get(thing.label)
            if settings is None:
                continue
            left = 1.0 - max(self._time - thing.seen_at, 0.0) / settings.memory
            level = -floor(-left * FADING_STEPS) / FADING_STEPS  # rounded up
            if level > 0.0:
                spot = _Spot(thing.x, thing.y, settings.radius, settings.cost * level)
                spots.append(spot)
        return tuple(spots)

    def _box(self, spot: _Spot) -> Box:
        """The cells whose cost a thing raises."""
        r = spot.radius
        return self.frame.box_around((spot.x - r, spot.y - r), (spot.x + r, spot.y + r))
