"""JSON Schemas (draft 2020-12) of world files and maps of markers, recorded from their readers.

The readers of single items (stack.sim.worlds.items) run on a section that records the keys they
read, so that a new key of a reader is in the schema at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from missions.editor.mission_schema import DRAFT
from missions.editor.value_schemas import (
    Schema,
    documented,
    of_declaration,
    parts,
    pose,
    section,
)
from stack.documents import Findings, Mark, Node, Section
from stack.mapping.marker_maps import board_entries, marker_entry
from stack.parameters import Declaration, declarations
from stack.sim.worlds import items
from stack.sim.worlds.people import people
from stack.sim.worlds.timeline import ACTIONS, event
from stack.sim.worlds.values import Reading, X, Y
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import EDGES

LISTS: dict[str, tuple[Callable[[Reading, Section], object], str]] = {
    "walls": (items.wall, "Walls: polylines with thickness and height."),
    "boxes": (items.box, "Upright boxes."),
    "cylinders": (items.cylinder, "Upright cylinders."),
    "doors": (items.door, "Doors: panels that close a gap, removed while open."),
    "markers": (items.marker, "Fiducial markers on walls."),
    "friction_zones": (items.friction_zone, "Rectangles with another floor friction."),
    "drops": (items.drop, "Rectangles without floor, such as a stairwell."),
    "lines": (items.line, "Lines painted on the floor, which only cameras see."),
    "posters": (items.poster, "Pictures on walls, which only cameras see."),
    "people": (people, "People who walk."),
    "docks": (items.dock, "Charging docks."),
    "timeline": (event, "World events; each entry happens once."),
}

EMPTY = Node("", "scalar", Mark(""))


def world_schema() -> Schema:
    """Return the schema of world files."""
    pose_or_place = {**pose(), "type": ["array", "string"]}
    keys = {
        "world": documented({"type": "string"}, "Name of the world."),
        "format": documented({"enum": [1]}, "Version of world files: `1`."),
        "doc": documented({"type": "string"}, "Description."),
        "bounds": documented(parts(EDGES), "Area of the map: [x_min, y_min, x_max, y_max]."),
        "start": documented(pose_or_place, "Default start pose of the robot."),
        **{
            name: of_declaration(declared, references=False)
            for name, declared in declarations(World).items()
        },
        "places": documented(
            {"type": "object", "additionalProperties": pose()},
            "Named poses that missions can use.",
        ),
    }
    for key, (read, text) in LISTS.items():
        keys[key] = documented({"type": "array", "items": _schema_of(read)}, text)
    _require_by_model(keys["people"]["items"])
    _require_one_action(keys["timeline"]["items"])
    return {"$schema": DRAFT, "title": "treepilot world, format 1", **section(keys, ["world"])}


def marker_map_schema() -> Schema:
    """Return the schema of maps of markers."""
    entries: dict[str, tuple[Callable[[Reading, Section], object], str]] = {
        "markers": (lambda _, section: marker_entry(section, _ignore), "Single markers."),
        "boards": (
            lambda _, section: board_entries(section, _ignore),
            "Boards: grids of markers, numbered row by row from the top left one.",
        ),
    }
    keys = {
        "format": documented({"enum": [1]}, "Version of maps of markers: `1`."),
        "doc": documented({"type": "string"}, "Description."),
    }
    for key, (read, text) in entries.items():
        keys[key] = documented({"type": "array", "items": _schema_of(read)}, text)
    return {"$schema": DRAFT, "title": "treepilot map of markers, format 1", **section(keys)}


def _ignore(*_: object) -> None:
    """Drop the number of a marker: a schema does not compare entries."""


def _require_by_model(entry: Schema) -> None:
    """Require a track of recorded people, and waypoints of all others."""
    entry["required"] = ["name"]
    entry["properties"]["waypoints"]["minItems"] = 1
    entry["if"] = {"properties": {"model": {"const": "recorded"}}, "required": ["model"]}
    entry["then"], entry["else"] = {"required": ["track"]}, {"required": ["waypoints"]}


def _require_one_action(entry: Schema) -> None:
    entry["minProperties"] = 2
    for action in ACTIONS:
        others = [other for other in ACTIONS if other != action]
        entry.setdefault("dependentSchemas", {})[action] = {
            "propertyNames": {"not": {"enum": others}}
        }


def _schema_of(read: Callable[[Reading, Section], object]) -> Schema:
    recorder = _SchemaRecorder()
    read(_RecordingReading(Findings()), recorder)
    return section(recorder.keys, recorder.required)


class _AnyKey(Node):
    """A mapping that contains every key."""

    def get(self, key: str) -> Node:
        """Return an empty text."""
        return EMPTY


class _SchemaRecorder(Section):
    """An empty section that records the keys a reader reads.

    Attributes:
        keys: key -> schema.
        required: required keys.
    """

    def __init__(self) -> None:
        super().__init__(_AnyKey([], "mapping", EMPTY.mark), Findings(), "", "")
        self.keys: dict[str, Schema] = {}
        self.required: list[str] = []

    def record(self, key: str, schema: Schema, *, required: bool = False) -> None:
        """Add to the schema of a key."""
        self.keys[key] = {**self.keys.get(key, {}), **schema}
        if required and key not in self.required:
            self.required.append(key)

    def node_of(self, key: str, *, required: bool = False) -> Node:
        """Return an empty text, so that the reader continues and declares the value."""
        self.record(key, {}, required=required)
        return EMPTY

    def value(self, declared: Declaration) -> Any:
        """Record the declaration."""
        schema = of_declaration(declared, references=False)
        self.record(declared.name, schema, required=declared.required)

    def parts(self, name: str, node: Node, declared: Sequence[Declaration]) -> None:
        """Record a list of fixed length."""
        self.record(name, parts(declared))

    def section(self, key: str, *, required: bool = False) -> Section:
        """Record a section and return a recorder for its keys."""
        inner = _SchemaRecorder()
        schema = {**section({}), "properties": inner.keys}  # filled while the reader continues
        self.record(key, schema, required=required)
        return inner


class _RecordingReading(Reading):
    """Shared methods of the readers, which record the schemas of points and poses."""

    def point(self, section: Section, key: str) -> None:
        assert isinstance(section, _SchemaRecorder)
        section.record(key, parts((X, Y)), required=True)

    def points(self, section: Section, key: str, at_least: int = 2) -> None:
        assert isinstance(section, _SchemaRecorder)
        points = {"type": "array", "minItems": at_least, "items": parts((X, Y))}
        section.record(key, points, required=True)

    def pose(self, section: Section, key: str, node: Node) -> None:
        assert isinstance(section, _SchemaRecorder)
        section.record(key, pose())

    def pose_or_place(self, section: Section, key: str, node: Node) -> None:
        assert isinstance(section, _SchemaRecorder)
        section.record(key, {**pose(), "type": ["array", "string"]})
