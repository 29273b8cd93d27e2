"""Finding codes, declarations and readers of points and poses that world files share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath
from typing import Any, TypeVar

import numpy as np

from stack.documents import Findings, Mark, Node, Section
from stack.mapping.limits import FARTHEST
from stack.parameters import REQUIRED, Declaration, declarations, suggestion
from stack.sim.worlds.world import World
from stack.types import FloatArray, Pose2D, wrap_angle

SHAPE = "E201"
TWICE = "E202"
UNKNOWN_NAME = "E203"
PLACEMENT = "E204"
TOO_MANY = "E205"
EMPTY = "E206"

T = TypeVar("T")


def length(name: str, help: str, default: Any = REQUIRED, **bounds: float | None) -> Declaration:
    """Declare a length in metres, by default above 0 and at most FARTHEST."""
    limits: dict[str, float | None] = {"above": 0.0, "at_most": FARTHEST, **bounds}
    return Declaration(name, float, help, "m", default, **limits)  # type: ignore[arg-type]


def coordinate(name: str) -> Declaration:
    """Declare a coordinate in the world frame."""
    return Declaration(name, float, "world frame", "m", at_least=-FARTHEST, at_most=FARTHEST)


X, Y = coordinate("x"), coordinate("y")
HEADING = Declaration("heading", float, "anticlockwise from the x axis", "rad")
FACING = Declaration("facing", float, "direction it faces", "rad")
RADIUS = length("radius", "radius of the circle")
SIZE = tuple(length(name, "") for name in ("length", "width", "height"))
POSTER_SIZE = tuple(length(name, "", at_most=20.0) for name in ("width", "height"))
POSTER_HEIGHT = length("height", "height of its centre above the floor", 0.55, at_most=20.0)
POSTER_ID = Declaration("id", int, "number of its picture", at_least=0, at_most=999_999)
COLOUR = tuple(
    Declaration(name, float, "0 to 1", at_least=0.0, at_most=1.0)
    for name in ("red", "green", "blue")
)
FRICTION = replace(declarations(World)["friction"], default=REQUIRED)
CORNER_RADIUS = length("corner_radius", "radius of the arcs at its corners", 0.0, above=None,
                       at_least=0.0)  # fmt: skip
CLOSED = Declaration("closed", bool, "join the last point to the first", default=False)
BLOCK_NAME = Declaration("name", str, "name in messages and displays")
DOOR_NAME = Declaration("name", str, "name for the timeline")


def fields_of(section: Section, kind: type) -> dict[str, Any]:
    """The values of the fields of a dataclass that have a declaration, by name."""
    return {name: section.value(declared) for name, declared in declarations(kind).items()}


@dataclass
class Reading:
    """State shared by the readers of one world file.

    Attributes:
        findings: the findings so far.
        taken: position of the first use of each (kind, name) that must be unique.
        doors: names of the doors read so far.
        places: the named poses.
        count: list entries and places read so far.
        folder: of the world file.
    """

    findings: Findings
    folder: FilePath = FilePath()
    taken: dict[tuple[str, Any], Mark] = field(default_factory=dict)
    doors: list[str] = field(default_factory=list)
    places: dict[str, Pose2D] = field(default_factory=dict)
    count: int = 0

    def take(self, kind: str, name: Any, mark: Mark) -> None:
        """Record a name as used; report an error if its kind has it already."""
        first = self.taken.setdefault((kind, name), mark)
        if first is not mark:
            self.findings.add(
                TWICE, mark, f"duplicate {kind} {name!r}", f"the first is in line {first.line}"
            )

    def point(self, section: Section, key: str) -> tuple[float, float] | None:
        """The required point [x, y] under a key."""
        node = section.node_of(key, required=True)
        return None if node is None else section.parts(key, node, (X, Y))

    def points(self, section: Section, key: str, at_least: int = 2) -> FloatArray | None:
        """The required points (n, 2) under a key; consecutive points must differ."""
        nodes = section.sequence(key, required=True)
        listed = section.node.get(key)
        points = [section.parts(f"{key}[{n}]", node, (X, Y)) for n, node in enumerate(nodes)]
        if listed is not None and listed.is_sequence and len(nodes) < at_least:
            wanted = "two points" if at_least == 2 else "one point"
            sentence = f"{key} needs at least {wanted} [x, y], got {len(nodes)}"
            self.findings.add(SHAPE, listed.mark, sentence)
            return None
        usable = bool(points)
        for before, point, node in zip(points[:-1], points[1:], nodes[1:], strict=True):
            if point is not None and point == before:
                sentence = f"{key}: the point {list(point)} is listed twice in a row"
                self.findings.add(SHAPE, node.mark, sentence, "remove one")
                usable = False
        if not usable or any(point is None for point in points):
            return None
        return np.array(points, dtype=np.float64)

    def pose(self, section: Section, key: str, node: Node) -> Pose2D | None:
        """A pose [x, y] or [x, y, heading]."""
        declared = (X, Y) if len(node.items) == 2 else (X, Y, HEADING)
        values = section.parts(key, node, declared)
        if values is None:
            return None
        return Pose2D(values[0], values[1], wrap_angle(values[2]) if len(values) == 3 else 0.0)

    def pose_or_place(self, section: Section, key: str, node: Node) -> Pose2D | None:
        """A pose, or the pose of a place of this file that is named."""
        if not isinstance(node.value, str):
            return self.pose(section, key, node)
        if node.value not in self.places:
            sentence = f"{key}: there is no place {node.value!r}"
            self.findings.add(
                UNKNOWN_NAME, node.mark, sentence, suggestion(node.value, self.places)
            )
        return self.places.get(node.value)

    def each(
        self, top: Section, key: str, what: str, read: Callable[[Reading, Section], T | None]
    ) -> tuple[T, ...]:
        """The items that `read` makes of the list under a key; without those it returns None for.

        Args:
            top: the mapping with the list.
            key: of the list.
            what: name of an entry for messages, such as "a wall".
            read: reader of one entry.
        """
        found = []
        for node in top.sequence(key):
            self.count += 1
            section = Section(node, self.findings, what, SHAPE)
            item = read(self, section) if node.is_mapping else None
            if node.is_mapping:
                section.done()
            if item is not None:
                found.append(item)
        return tuple(found)
