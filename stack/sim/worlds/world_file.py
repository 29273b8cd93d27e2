"""Reader of world files (docs/worlds.md); reports all findings of a file at once.

Codes: E201 shape and values · E202 duplicate name · E203 unknown name ·
E204 placement · E205 too many · E206 empty.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain
from math import ceil, floor
from pathlib import Path

import numpy as np

from stack.documents import Findings, Mark, Node, Section, read_document
from stack.errors import InputError
from stack.mapping.limits import MAX_ITEMS
from stack.parameters import Declaration, likely, suggestion
from stack.sim.faults.planned import PlannedFault
from stack.sim.worlds import items
from stack.sim.worlds.outlines import Outline, outlines
from stack.sim.worlds.people import people
from stack.sim.worlds.timeline import event
from stack.sim.worlds.values import (
    EMPTY,
    PLACEMENT,
    SHAPE,
    TOO_MANY,
    Reading,
    coordinate,
    fields_of,
)  # fmt: skip
from stack.sim.worlds.world import World
from stack.types import Pose2D

MARGIN = 0.5
"""Margin of the default bounds around all obstacles and places, metres."""

KEYS = (
    "world", "walls", "boxes", "blocks", "places", "bounds", "cylinders", "doors", "markers",
    "people",
    "docks", "timeline", "start", "friction", "friction_zones", "drops", "lines", "posters",
    "floor", "light", "shadows", "origin", "faults", "format", "doc",
)  # fmt: skip
"""Of a world file; a file without any is of another kind."""

EDGES = tuple(coordinate(name) for name in ("x_min", "y_min", "x_max", "y_max"))
Bounds = tuple[float, float, float, float]


def find_world(name_or_path: str, beside: Path, shipped: Path) -> Path:
    """Return the path of a world file.

    Args:
        name_or_path: a name such as `office`, or a path (with a slash or a suffix) relative to
            the file that mentions it.
        beside: that file, or its folder.
        shipped: the folder in which names are looked up.

    Raises:
        InputError: there is no world of that name. A path is not checked here.
    """
    known = {file.stem: file for file in shipped.glob("*.yaml")}
    return named_file("world", name_or_path, beside, known, ".yaml")


def named_file(
    what: str, name_or_path: str, beside: Path, known: Mapping[str, Path], ending: str = ""
) -> Path:
    """Return a path, or the known file of a name; a path has a slash or a suffix.

    Args:
        what: kind of file, for messages.
        name_or_path: as written.
        beside: file that mentions it, or its folder, to which a path is relative.
        known: file of each name.
        ending: of a path, for messages.

    Raises:
        InputError: there is no file of that name. A path is not checked here.
    """
    if "/" in name_or_path or "\\" in name_or_path or Path(name_or_path).suffix:
        folder = beside.parent if beside.is_file() else beside
        return folder / Path(name_or_path).expanduser()
    if name_or_path not in known:
        hint = likely(name_or_path, known) or (
            f"{suggestion(name_or_path, known)}; a path has a slash: ./{name_or_path}{ending}"
        )
        raise InputError(f"there is no {what} {name_or_path!r}", hint)
    return known[name_or_path]


def read_world(path: Path, text: str | None = None) -> World:
    """Read a world from a file.

    Args:
        path: the file.
        text: unsaved content of an editor, read instead of the file.

    Raises:
        InputError: all findings, each with its position.
    """
    findings = Findings()
    document = read_document(path, "world file", text, KEYS)
    top = Section(document, findings, "a world file", SHAPE)
    reading = Reading(findings, folder=path.parent)
    name = top.name(Declaration("world", str, "name of the world"))
    top.value(
        Declaration("format", int, "version of the file format", default=1, at_least=1, at_most=1)
    )
    top.value(Declaration("doc", str, "description", default=""))
    _read_places(reading, top)
    world = World(
        name=name or path.stem,
        bounds=(0.0, 0.0, 0.0, 0.0),
        walls=reading.each(top, "walls", "a wall", items.wall),
        boxes=reading.each(top, "boxes", "a box", items.box),
        blocks=reading.each(top, "blocks", "a block", items.block),
        cylinders=reading.each(top, "cylinders", "a cylinder", items.cylinder),
        doors=reading.each(top, "doors", "a door", items.door),
        markers=reading.each(top, "markers", "a marker", items.marker),
        friction_zones=reading.each(top, "friction_zones", "a zone", items.friction_zone),
        drops=reading.each(top, "drops", "a drop", items.drop),
        shadows=reading.each(top, "shadows", "a shadow", items.shadow),
        lines=reading.each(top, "lines", "a line", items.line),
        posters=reading.each(top, "posters", "a poster", items.poster),
        people=tuple(chain.from_iterable(reading.each(top, "people", "a person", people))),
        docks=reading.each(top, "docks", "a dock", items.dock),
        timeline=reading.each(top, "timeline", "a timeline entry", event),
        places=reading.places,
        start=_start(reading, top),
        origin=items.origin(top.section("origin")),
        faults=_faults(reading, top),
        source=path,
        **fields_of(top, World),
    )
    docks = chain.from_iterable(dock.boxes() for dock in world.docks)
    world = replace(world, boxes=(*world.boxes, *docks))
    bounds = _bounds(top)
    top.done()
    findings.raise_errors()
    _check_size(top, reading, world)
    solid = outlines(world)
    world = replace(world, bounds=bounds or bounds_around(world, solid, MARGIN))
    _check_placement(top, world, solid)
    findings.raise_errors()
    return world


def _read_places(reading: Reading, top: Section) -> None:
    section = top.section("places")
    for key, node in section.node.entries if section is not None else ():
        reading.count += 1
        pose = reading.pose(top, str(key.value), node)
        if pose is not None:
            reading.places[str(key.value)] = pose


def _faults(reading: Reading, top: Section) -> tuple[PlannedFault, ...]:
    nodes = top.sequence("faults")
    if not nodes:
        return ()
    from stack.sim.faults.reading import read_faults

    return read_faults(nodes, reading.findings, reading.places)


def _start(reading: Reading, top: Section) -> Pose2D:
    node = top.node_of("start")
    pose = None if node is None else reading.pose_or_place(top, "start", node)
    return pose or Pose2D(0.0, 0.0)


def _bounds(top: Section) -> Bounds | None:
    node = top.node_of("bounds")
    edges = None if node is None else top.parts("bounds", node, EDGES)
    if node is None or edges is None:
        return None
    x_min, y_min, x_max, y_max = edges
    if not (x_min < x_max and y_min < y_max):
        sentence = f"bounds {list(edges)} enclose nothing"
        hint = "write [x_min, y_min, x_max, y_max] with x_min < x_max and y_min < y_max"
        top.findings.add(PLACEMENT, node.mark, sentence, hint)
    return x_min, y_min, x_max, y_max


def bounds_around(world: World, solid: list[Outline], margin: float) -> Bounds:
    """Return bounds around all solids, places and the start, plus a margin, in steps of 0.1 m."""
    poses = [world.start, *world.places.values()]
    extents = [outline.extent for outline in solid]
    extents += [(pose.x, pose.y, pose.x, pose.y) for pose in poses]
    low = np.min(np.array(extents)[:, :2], axis=0) - margin
    high = np.max(np.array(extents)[:, 2:], axis=0) + margin
    x_min, y_min = (floor(round(10 * float(value), 6)) / 10 for value in low)
    x_max, y_max = (ceil(round(10 * float(value), 6)) / 10 for value in high)
    return x_min, y_min, x_max, y_max


def _check_size(top: Section, reading: Reading, world: World) -> None:
    count = reading.count + sum(len(wall.points) for wall in world.walls)
    count += sum(len(line.points) for line in world.lines)
    if count > MAX_ITEMS:
        sentence = f"{count} items and wall points; a world may have at most {MAX_ITEMS}"
        top.findings.add(TOO_MANY, top.node.mark, sentence)
    if not (world.walls or world.boxes or world.cylinders):
        sentence = "this world is empty: a lidar would measure nothing"
        hint = "add walls, boxes or cylinders"
        top.findings.add(EMPTY, top.node.mark, sentence, hint)
    top.findings.raise_errors()


def _check_placement(top: Section, world: World, solid: list[Outline]) -> None:
    """Check that start, places, markers and posters are inside the bounds and in no solid."""
    x_min, y_min, x_max, y_max = world.bounds
    placed = list(_placed(top.node, world))
    points = np.array([(x, y) for _, _, x, y in placed])
    inside: dict[int, list[tuple[Outline, float]]] = {}
    for outline in solid:
        depths = -outline.distance_to(points)
        for number in np.flatnonzero(depths > 1e-3).tolist():
            inside.setdefault(number, []).append((outline, float(depths[number])))
    for number, (what, mark, x, y) in enumerate(placed):
        if not (x_min < x < x_max and y_min < y < y_max):
            sentence = f"{what} at [{x:g}, {y:g}] is outside the bounds {list(world.bounds)}"
            top.findings.add(PLACEMENT, mark, sentence)
        for outline, depth in inside.get(number, ()):
            sentence = f"{what} at [{x:g}, {y:g}] is {100 * depth:.1f} cm inside {outline.name}"
            top.findings.add(PLACEMENT, mark, sentence, "move it to a free position")


def _placed(node: Node, world: World) -> Iterator[tuple[str, Mark, float, float]]:
    """Yield name, position in the file, x and y of the start, places, markers and posters."""
    start = node.get("start")
    yield "the start", start.mark if start else node.mark, world.start.x, world.start.y
    places = node.get("places")
    for key, value in places.entries if places else ():
        pose = world.places[str(key.value)]
        yield f"the place {key.value!r}", value.mark, pose.x, pose.y
    markers = node.get("markers")
    for entry, marker in zip(markers.items if markers else (), world.markers, strict=True):
        at = entry.get("at")
        x, y, _ = marker.position
        yield f"marker {marker.number}", at.mark if at else entry.mark, x, y
    posters = node.get("posters")
    for entry, poster in zip(posters.items if posters else (), world.posters, strict=True):
        at = entry.get("at")
        x, y, _ = poster.position
        yield f"poster {poster.number}", at.mark if at else entry.mark, x, y
