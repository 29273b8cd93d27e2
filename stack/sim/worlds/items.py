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
from stack.parameters import Declaration
from stack.sim.worlds.polylines import rounded
from stack.sim.worlds.values import (
    COLOUR,
    CORNER_RADIUS,
    ELEVATION,
    FRICTION,
    GLASS,
    HEIGHT,
    MIRROR,
    NAME,
    ON_MAP,
    POSTER_SIZE,
    RADIUS,
    SHAPE,
    SIZE,
    TEXTURE,
    THICKNESS,
    UNKNOWN_NAME,
    Reading,
    length,
)  # fmt: skip
from stack.sim.worlds.world import (
    POSTER,
    Box,
    Colour,
    Cylinder,
    Dock,
    Door,
    Drop,
    FloorLine,
    FrictionZone,
    Poster,
    Wall,
)  # fmt: skip
from stack.types import Marker, wrap_angle


def _colour(section: Section, kind: type) -> Colour:
    default: Any = next(item.default for item in fields(kind) if item.name == "colour")
    node = section.node_of("colour")
    values = None if node is None else section.parts("colour", node, COLOUR)
    colour: Colour = default if values is None else (values[0], values[1], values[2])
    return colour


def wall(reading: Reading, section: Section) -> Wall | None:
    """Read a wall; `closed: true` joins the last point to the first."""
    points = reading.points(section, "points")
    closed = section.value(
        Declaration("closed", bool, "join the last point to the first", default=False)
    )
    thickness, height = section.value(THICKNESS), section.value(HEIGHT)
    colour, on_map = _colour(section, Wall), section.value(ON_MAP)
    glass, texture, mirror = (section.value(item) for item in (GLASS, TEXTURE, MIRROR))
    if glass and mirror:
        sentence = "a wall cannot be of `glass` and a `mirror`"
        hint = "remove one: light passes through glass and is reflected by a mirror"
        reading.findings.add(SHAPE, section.node.mark, sentence, hint)
    if points is None:
        return None
    if closed:
        points = np.vstack([points, points[:1]])
    return Wall(points, thickness, height, colour, on_map, glass, texture, mirror)


def box(reading: Reading, section: Section) -> Box | None:
    """Read an upright box."""
    at = section.node_of("at", required=True)
    pose = None if at is None else reading.pose(section, "at", at)
    size_node = section.node_of("size", required=True)
    size = None if size_node is None else section.parts("size", size_node, SIZE)
    name, on_map = section.value(NAME), section.value(ON_MAP)
    colour, elevation = _colour(section, Box), section.value(ELEVATION)
    texture, mirror = section.value(TEXTURE), section.value(MIRROR)
    if pose is None or size is None:
        return None
    extent = (size[0], size[1], size[2])
    return Box(pose, extent, colour, on_map, name, elevation, texture, mirror)


def cylinder(reading: Reading, section: Section) -> Cylinder | None:
    """Read an upright cylinder."""
    at, radius = reading.point(section, "at"), section.value(RADIUS)
    height, name, on_map = section.value(HEIGHT), section.value(NAME), section.value(ON_MAP)
    colour = _colour(section, Cylinder)
    if at is None or radius is None:
        return None
    return Cylinder(at[0], at[1], radius, height, colour, on_map, name)


def door(reading: Reading, section: Section) -> Door | None:
    """Read a door, which the timeline opens and closes."""
    name = section.value(Declaration("name", str, "name for the timeline"))
    start, end = reading.point(section, "from"), reading.point(section, "to")
    closed = section.value(Declaration("closed", bool, "closed at time 0", default=False))
    thickness = section.value(
        length("thickness", "thickness of the slab", 0.08, at_least=0.01, at_most=1.0)
    )
    height, colour = section.value(HEIGHT), _colour(section, Door)
    named = section.node.get("name")
    if name is not None and named is not None:
        reading.take("door", name, named.mark)
        reading.doors.append(name)
    if start is not None and start == end:
        sentence = f"`from` and `to` of the door are the same point {list(start)}"
        reading.findings.add(SHAPE, section.node.mark, sentence, "set `to` to its other end")
        return None
    if name is None or start is None or end is None:
        return None
    return Door(name, start, end, closed, thickness, height, colour)


def marker(reading: Reading, section: Section) -> Marker | None:
    """Read a fiducial marker."""

    def take(dictionary: str, number: int, mark: Mark) -> None:
        reading.take(f"{dictionary} marker", number, mark)

    return read_marker(section, take, UNKNOWN_NAME)


def poster(reading: Reading, section: Section) -> Poster | None:
    """Read a poster; several may show the same picture."""
    number = section.value(
        Declaration("id", int, "number of its picture", at_least=0, at_most=999_999)
    )
    at = reading.point(section, "at")
    height = section.value(
        length("height", "height of its centre above the floor", 0.55, at_most=20.0)
    )
    facing = section.value(Declaration("facing", float, "direction it faces", "rad"))
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
    bounds, name = _rectangle(reading, section, "drop"), section.value(NAME)
    depth = section.value(length("depth", "depth below the floor", 0.2, at_most=20.0))
    return None if bounds is None else Drop(bounds, depth, name)


def line(reading: Reading, section: Section) -> FloorLine | None:
    """Read a painted line; `corner_radius` rounds its corners, `closed` joins its ends."""
    points = reading.points(section, "points")
    closed = section.value(
        Declaration("closed", bool, "join the last point to the first", default=False)
    )
    radius = section.value(CORNER_RADIUS)
    width = section.value(length("width", "width of the paint", 0.05, at_least=0.01, at_most=1.0))
    colour = _colour(section, FloorLine)
    if points is None:
        return None
    return FloorLine(rounded(points, radius, closed=closed), width, colour)


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
    at = reading.point(section, "at")
    radius = section.value(
        length("radius", "distance within which a robot charges", 0.35, at_most=5.0)
    )
    facing = section.value(
        Declaration("facing", float | None, "direction out of its face", "rad", default=None)
    )
    if at is None:
        return None
    return Dock(at[0], at[1], radius, None if facing is None else wrap_angle(facing))
