"""The JSON Schema (draft 2020-12) of world files, learnt from their own readers.

The readers of single things (stack.sim.worlds.items) are run on a section that notes what they ask
for; so a key that a reader learns about is in the schema at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
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
from stack.parameters import Declaration
from stack.sim.worlds import items
from stack.sim.worlds.timeline import ACTIONS, event
from stack.sim.worlds.values import FRICTION, Reading, X, Y
from stack.sim.worlds.world_file import EDGES

LISTS: dict[str, tuple[Callable[[Reading, Section], object], str]] = {
    "walls": (items.wall, "Polylines of upright slabs."),
    "boxes": (items.box, "Upright boxes."),
    "cylinders": (items.cylinder, "Upright cylinders."),
    "doors": (items.door, "Slabs that close a gap and vanish when open."),
    "markers": (items.marker, "Fiducial boards on walls."),
    "friction_zones": (items.friction_zone, "Rectangles of other floor."),
    "people": (items.person, "They walk round a loop."),
    "docks": (items.dock, "Where a battery charges."),
    "timeline": (event, "What happens, each entry once."),
}

EMPTY = Node("", "scalar", Mark(""))


def world_schema() -> Schema:
    """The schema of world files."""
    pose_or_place = {**pose(), "type": ["array", "string"]}
    keys = {
        "world": documented({"type": "string"}, "Its name."),
        "format": documented({"enum": [1]}, "The version of world files; this is `1`."),
        "doc": documented({"type": "string"}, "What it is for."),
        "bounds": documented(parts(EDGES), "What a map covers: [x_min, y_min, x_max, y_max]."),
        "start": documented(pose_or_place, "Where a robot stands when the mission does not say."),
        "friction": of_declaration(replace(FRICTION, default=0.9), references=False),
        "places": documented(
            {"type": "object", "additionalProperties": pose()},
            "Poses by name, which missions may use.",
        ),
    }
    for key, (read, text) in LISTS.items():
        keys[key] = documented({"type": "array", "items": _asked_for(read)}, text)
    _timeline_does_one_thing(keys["timeline"]["items"])
    return {"$schema": DRAFT, "title": "treepilot world, format 1", **section(keys, ["world"])}


def _timeline_does_one_thing(entry: Schema) -> None:
    entry["minProperties"] = 2
    for action in ACTIONS:
        others = [other for other in ACTIONS if other != action]
        entry.setdefault("dependentSchemas", {})[action] = {
            "propertyNames": {"not": {"enum": others}}
        }


def _asked_for(read: Callable[[Reading, Section], object]) -> Schema:
    noted = _Noting()
    read(_NotingReading(Findings()), noted)
    return section(noted.keys, noted.required)


class _AnyKey(Node):
    """A mapping that has whatever key it is asked for."""

    def get(self, key: str) -> Node:
        """An empty text."""
        return EMPTY


class _Noting(Section):
    """A section that is empty and notes what is asked of it.

    Attributes:
        keys: schema by key.
        required: keys that must be there.
    """

    def __init__(self) -> None:
        super().__init__(_AnyKey([], "mapping", EMPTY.mark), Findings(), "", "")
        self.keys: dict[str, Schema] = {}
        self.required: list[str] = []

    def note(self, key: str, schema: Schema, *, required: bool = False) -> None:
        """What may stand under a key, as far as it is known by now."""
        self.keys[key] = {**self.keys.get(key, {}), **schema}
        if required and key not in self.required:
            self.required.append(key)

    def node_of(self, key: str, *, required: bool = False) -> Node:
        """An empty text, so that the reader goes on to say what it should be."""
        self.note(key, {}, required=required)
        return EMPTY

    def value(self, declared: Declaration) -> Any:
        """Note the declaration."""
        schema = of_declaration(declared, references=False)
        self.note(declared.name, schema, required=declared.required)

    def parts(self, name: str, node: Node, declared: Sequence[Declaration]) -> None:
        """Note a list of known length."""
        self.note(name, parts(declared))

    def section(self, key: str, *, required: bool = False) -> Section:
        """A section whose keys are noted in turn."""
        inner = _Noting()
        schema = {**section({}), "properties": inner.keys}  # filled while the reader goes on
        self.note(key, schema, required=required)
        return inner


class _NotingReading(Reading):
    """What the readers share; knows what points and poses look like."""

    def point(self, section: Section, key: str) -> None:
        assert isinstance(section, _Noting)
        section.note(key, parts((X, Y)), required=True)

    def points(self, section: Section, key: str) -> None:
        assert isinstance(section, _Noting)
        section.note(key, {"type": "array", "minItems": 2, "items": parts((X, Y))}, required=True)

    def pose(self, section: Section, key: str, node: Node) -> None:
        assert isinstance(section, _Noting)
        section.note(key, pose())

    def pose_or_place(self, section: Section, key: str, node: Node) -> None:
        assert isinstance(section, _Noting)
        section.note(key, {**pose(), "type": ["array", "string"]})
