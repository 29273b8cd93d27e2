"""Readers of the entries of a world file: walls, boxes, doors, markers, people…

Each reads the mapping of one entry, reports what is wrong with it, and returns None if the entry
is unusable. docs/worlds.md lists the keys.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from stack.documents import Mark, Section
from stack.mapping.marker_maps import read_marker
from stack.mavlink.origin import HIGHEST_LATITUDE, GeoOrigin
from stack.parameters import Declaration
from stack.sim.worlds.polylines import rounded
from stack.sim.worlds.values import (
    BLOCK_NAME,
    CLOSED,
    COLOUR,
    CORNER_RADIUS,
    DOOR_NAME,
    FACING,
    FRICTION,
    POSTER_HEIGHT,
    POSTER_ID,
    POSTER_SIZE,
    RADIUS,
    SHAPE,
    SIZE,
    UNKNOWN_NAME,
    Reading,
    fields_of,
)  # fmt: skip
from stack.sim.worlds.world import (
    POSTER,
    Block,
    Box,
    Cylinder,
    Dock,
    Door,
    Drop,
    FloorLine,
    FrictionZone,
    Poster,
    Shadow,
    Wall,
)  # fmt: skip
from stack.types import Marker, wrap_angle


def _coloured_fields(section: Section, kind: type) -> dict[str, Any]:
    """The values of the declared fields of a kind of thing, and its colour."""
    values, node = fields_of(section, kind), section.node_of("colour")
    colour = None if node is None else section.parts("colour", node, COLOUR)
    default = next(item.default for item in fields(kind) if item.name == "colour")
    return {**values, "colour": colour or default}


def wall(reading: Reading, section: Section) -> Wall | None:
    """Read a wall; `closed: true` joins the last point to the first."""
    points, closed = reading.points(section, "points"), section.value(CLOSED)
    values = _coloured_fields(section, Wall)
    if values["glass"] and values["mirror"]:
        sentence = "a wall cannot be of `glass` and a `mirror`"
        hint = "remove one: light passes through glass and is reflected by a mirror"
        reading.findings.add(SHAPE, section.node.mark, sentence, hint)
    if points is None:
        return None
    return Wall(np.vstack([points, points[:1]]) if closed else points, **values)


def box(reading: Reading, section: Section) -> Box | None:
    """Read an upright box."""
    at = section.node_of("at", required=True)
    pose = None if at is None else reading.pose(section, "at", at)
    node = section.node_of("size", required=True)
    size = None if node is None else section.parts("size", node, SIZE)
    values = _coloured_fields(section, Box)
    if pose is None or size is None:
        return None
    return Box(pose, (size[0], size[1], size[2]), **values)


def block(reading: Reading, section: Section) -> Block | None:
    """Read a box that can be moved; its name is that of no other."""
    name, named = section.value(BLOCK_NAME), section.node.get("name")
    if name is not None and named is not None:
        reading.take("block", name, named.mark)
    at = section.node_of("at", required=True)
    pose = None if at is None else reading.pose(section, "at", at)
    node = section.node_of("size", required=True)
    size = None if node is None else section.parts("size", node, SIZE)
    values = _coloured_fields(section, Block)
    if name is None or pose is None or size is None:
        return None
    return Block(name, pose, (size[0], size[1], size[2]), **values)


def cylinder(reading: Reading, section: Section) -> Cylinder | None:
    """Read an upright cylinder."""
    at, radius = reading.point(section, "at"), section.value(RADIUS)
    values = _coloured_fields(section, Cylinder)
    return None if at is None or radius is None else Cylinder(*at, radius, **values)


def door(reading: Reading, section: Section) -> Door | None:
    """Read a door, which the timeline opens and closes."""
    name, named = section.value(DOOR_NAME), section.node.get("name")
    start, end = reading.point(section, "from"), reading.point(section, "to")
    values = _coloured_fields(section, Door)
    if name is not None and named is not None:
        reading.take("door", name, named.mark)
        reading.doors.append(name)
    if start is not None and start == end:
        sentence = f"`from` and `to` of the door are the same point {list(start)}"
        reading.findings.add(SHAPE, section.node.mark, sentence, "set `to` to its other end")
        return None
    if name is None or start is None or end is None:
        return None
    return Door(name, start, end, **values)


def marker(reading: Reading, section: Section) -> Marker | None:
    """Read a fiducial marker."""

    def take(dictionary: str, number: int, mark: Mark) -> None:
        reading.take(f"{dictionary} marker", number, mark)

    return read_marker(section, take, UNKNOWN_NAME)


def poster(reading: Reading, section: Section) -> Poster | None:
    """Read a poster; several may show the same picture."""
    number, at = section.value(POSTER_ID), reading.point(section, "at")
    height, facing = section.value(POSTER_HEIGHT), section.value(FACING)
    node = section.node_of("size")
    size = None if node is None else section.parts("size", node, POSTER_SIZE)
    if number is None or at is None or facing is None:
        return None
    width, tall = size or POSTER
    return Poster(number, (at[0], at[1], height), wrap_angle(facing), (width, tall))


def friction_zone(reading: Reading, section: Section) -> FrictionZone | None:
    """Read a friction zone: a rectangle between two opposite corners."""
    bounds, friction = _rectangle(reading, section, "zone"), section.value(FRICTION)
    return None if bounds is None or friction is None else FrictionZone(bounds, friction)


def drop(reading: Reading, section: Section) -> Drop | None:
    """Read a drop: a rectangle without floor."""
    bounds, values = _rectangle(reading, section, "drop"), fields_of(section, Drop)
    return None if bounds is None else Drop(bounds, **values)


def shadow(reading: Reading, section: Section) -> Shadow | None:
    """Read a shadow: a rectangle between two opposite corners."""
    bounds, values = _rectangle(reading, section, "shadow"), fields_of(section, Shadow)
    return None if bounds is None else Shadow(bounds, **values)


def line(reading: Reading, section: Section) -> FloorLine | None:
    """Read a painted line; `corner_radius` rounds its corners, `closed` joins its ends."""
    points, closed = reading.points(section, "points"), section.value(CLOSED)
    radius, values = section.value(CORNER_RADIUS), _coloured_fields(section, FloorLine)
    if points is None:
        return None
    return FloorLine(rounded(points, radius, closed=closed), **values)


ORIGIN = (
    Declaration(
        "latitude", float, "degrees, north positive", at_least=-HIGHEST_LATITUDE,
        at_most=HIGHEST_LATITUDE,
    ),
    Declaration("longitude", float, "degrees, east positive", at_least=-180.0, at_most=180.0),
    Declaration("altitude", float, "above the mean sea level", "m", default=0.0),
    Declaration(
        "east", float, "direction of east, anticlockwise from the x axis", "rad", default=0.0
    ),
)  # fmt: skip


def origin(section: Section | None) -> GeoOrigin | None:
    """Read the place of the world frame's origin on Earth; bare latitudes are degrees."""
    if section is None:
        return None
    latitude, longitude, altitude, east = (section.value(declared) for declared in ORIGIN)
    section.done()
    if latitude is None or longitude is None:
        return None
    return GeoOrigin(latitude, longitude, altitude, wrap_angle(east))


def _rectangle(
    reading: Reading, section: Section, what: str
) -> tuple[float, float, float, float] | None:
    """Read the opposite corners of a rectangle; return x_min, y_min, x_max, y_max."""
    one, other = reading.point(section, "from"), reading.point(section, "to")
    if one is None or other is None:
        return None
    (x_min, x_max), (y_min, y_max) = sorted((one[0], other[0])), sorted((one[1], other[1]))
    if x_min == x_max or y_min == y_max:
        sentence = f"the {what} from {list(one)} to {list(other)} has no area"
        reading.findings.add(
            SHAPE, section.node.mark, sentence, "`from` and `to` are opposite corners"
        )
    return x_min, y_min, x_max, y_max


def dock(reading: Reading, section: Section) -> Dock | None:
    """Read a dock, where the battery charges."""
    at, values = reading.point(section, "at"), fields_of(section, Dock)
    if at is None:
        return None
    if values["facing"] is not None:
        values["facing"] = wrap_angle(values["facing"])
    return Dock(*at, **values)
