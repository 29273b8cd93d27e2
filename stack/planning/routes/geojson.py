"""Route graphs from GeoJSON (RFC 7946): Point features are nodes, LineString features edges.

Coordinates are metres in the map frame. Properties of a node: `id`; of an edge: `id`, `from`, `to`,
`speed`, `weight`, `one_way`, `closed`; both may have a `name` for people. Files of Nav2's route
server are supported: an edge with `startid` and `endid` is one-way, as in Nav2. What Nav2 does not
read is a warning in such a file, not an error: unknown properties, equal ids of edges, and lines
that do not lead from node to node.

Codes: E430 file · E431 feature · E432 ids · W430 ignored or unused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import count
from math import hypot, inf
from pathlib import Path
from typing import Any

import numpy as np

from stack.documents import Findings, Mark
from stack.documents.files import decoded, read_input
from stack.errors import ParameterError
from stack.parameters import Declaration, read_quantity, suggestion
from stack.planning.routes.graph import RouteEdge, RouteGraph
from stack.planning.routes.line import Line
from stack.types import FloatArray

FILE, FEATURE, IDS, LEFT_OUT = "E430", "E431", "E432", "W430"

AT_NODE = 0.1
"""Metres; the end of a line within this distance of its node is moved to it."""

LARGEST_COORDINATE = 1e5
"""Metres; larger coordinates are rejected."""

SPEED_LIMIT = Declaration("speed", float, "speed limit", "m/s", above=0.0)
SPEED_SHARE = Declaration("speed", float, "share of the top speed", above=0.0, at_most=1.0)
WEIGHT = Declaration("weight", float, "factor on the cost", above=0.0, at_most=1e6)
FLAGS = {name: Declaration(name, bool) for name in ("one_way", "closed")}
_KNOWN = {
    "Point": ("id", "name"),
    "LineString": ("id", "name", "from", "to", "startid", "endid", "speed", "weight", *FLAGS),
}
_NAV2 = ("frame", "metadata", "operations", "overridable", "cost", "stroke", "stroke-width")
_FEATURE = re.compile(r'"type"\s*:\s*"Feature"')


@dataclass(frozen=True, slots=True)
class _Feature:
    """One GeoJSON feature with its position in the file."""

    number: int
    mark: Mark
    kind: str
    coordinates: Any
    properties: Mapping[str, Any]

    def __str__(self) -> str:
        return f"feature {self.number}"


@dataclass
class _Reading:
    """Nodes and edges read so far, with the findings.

    Attributes:
        nav2: whether the file is one of Nav2's route server.
    """

    findings: Findings
    nav2: bool
    nodes: dict[str, tuple[float, float]] = field(default_factory=dict)
    edges: dict[str, RouteEdge] = field(default_factory=dict)
    owners: dict[str, _Feature] = field(default_factory=dict)

    def wrong(self, feature: _Feature, sentence: str, hint: str = "", code: str = FEATURE) -> None:
        self.findings.add(code, feature.mark, f"{feature}: {sentence}", hint)

    def unread(
        self, feature: _Feature, sentence: str, instead: str, hint: str = "", code: str = FEATURE
    ) -> None:
        """Report what Nav2 does not read: `instead` says what a file of Nav2 gets."""
        if self.nav2:
            self.findings.add(LEFT_OUT, feature.mark, f"{feature}: {sentence}; {instead}")
        else:
            self.wrong(feature, sentence, hint, code)


def read_route_graph(path: Path) -> RouteGraph:
    """Read the route graph in a GeoJSON file.

    Raises:
        InputError: all findings, each with its line and the number of the feature, from 0.
    """
    return parse_route_graph(decoded(read_input(path, "route graph"), path), str(path))


def parse_route_graph(text: str, name: str) -> RouteGraph:
    """Read the route graph in a GeoJSON text; findings quote `name` as the file.

    Raises:
        InputError: as `read_route_graph`.
    """
    findings = Findings()
    features = _features(text, name, findings)
    reading = _Reading(findings, any("startid" in feature.properties for feature in features))
    for feature in features:
        if feature.kind == "Point":
            _read_node(feature, reading)
    for feature in features:
        if feature.kind == "LineString":
            _read_edge(feature, reading)
    if not findings.errors and not reading.edges:
        findings.add(FILE, Mark(name), "the graph has no edge", "add a LineString feature")
    findings.raise_errors()
    _warn_of_lone_nodes(reading)
    return RouteGraph(reading.nodes, reading.edges, name, tuple(findings.warnings))


def _features(text: str, name: str, findings: Findings) -> list[_Feature]:
    try:
        top = json.loads(text, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        mark = Mark(name, error.lineno, error.colno)
        findings.add(FILE, mark, f"not JSON: {error.msg}")
        return []
    except (ValueError, RecursionError) as error:
        findings.add(FILE, Mark(name), f"not JSON: {type(error).__name__} {error}")
        return []
    listed = top.get("features") if isinstance(top, dict) else None
    if not isinstance(listed, list) or top.get("type") != "FeatureCollection":
        hint = 'write {"type": "FeatureCollection", "features": […]}'
        findings.add(FILE, Mark(name), "not a GeoJSON FeatureCollection", hint)
        return []
    begins = [found.start() for found in _FEATURE.finditer(text)]
    if len(begins) != len(listed):  # the text occurs elsewhere too: the lines are unknown
        begins = [0] * len(listed)
    marks = [Mark(name, text.count("\n", 0, begin) + 1) for begin in begins]
    features = [_feature(n, mark, raw, findings) for n, (mark, raw) in
                enumerate(zip(marks, listed, strict=True))]  # fmt: skip
    return [feature for feature in features if feature is not None]


def _no_constant(word: str) -> float:
    raise ValueError(f"{word} is not a JSON number")


def _feature(number: int, mark: Mark, raw: Any, findings: Findings) -> _Feature | None:
    def refuse(sentence: str, hint: str) -> None:
        findings.add(FEATURE, mark, f"feature {number}: {sentence}", hint)

    if not isinstance(raw, dict) or raw.get("type") != "Feature":
        refuse("not a Feature", 'write {"type": "Feature", "geometry": …, "properties": …}')
        return None
    geometry, properties = raw.get("geometry"), raw.get("properties")
    properties = {} if properties is None else properties
    if not isinstance(properties, dict):
        refuse("`properties` is not an object", 'write {"id": …}')
        return None
    if "id" not in properties and isinstance(raw.get("id"), str | int):
        properties = {**properties, "id": raw["id"]}
    if geometry is None and ("from" in properties or "startid" in properties):
        return _Feature(number, mark, "LineString", None, properties)
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    coordinates = geometry.get("coordinates") if isinstance(geometry, dict) else None
    if kind == "MultiLineString" and isinstance(coordinates, list):
        kind = "LineString"
        coordinates = coordinates[0] if len(coordinates) == 1 else coordinates
    if not isinstance(kind, str) or kind not in _KNOWN:
        refuse(f"its geometry is {kind!r}", "a node is a Point, an edge a LineString")
        return None
    return _Feature(number, mark, kind, coordinates, properties)


def _read_node(feature: _Feature, reading: _Reading) -> None:
    name = _id(feature, "id", reading)
    place = _position(feature.coordinates)
    if place is None:
        reading.wrong(feature, f"{feature.coordinates!r:.60} is not a position", "write [x, y]")
    _check_keys(feature, reading)
    if name is None or place is None:
        return
    if name in reading.nodes:
        first = reading.owners[name].number
        reading.wrong(feature, f"feature {first} is also a node {name!r}", "rename one", IDS)
        return
    reading.nodes[name], reading.owners[name] = place, feature


def _read_edge(feature: _Feature, reading: _Reading) -> None:
    given = feature.properties
    nav2 = "startid" in given
    start = _node_id(feature, "startid" if nav2 else "from", reading)
    end = _node_id(feature, "endid" if nav2 else "to", reading)
    name = _id(feature, "id", reading)
    speed, share = _speed(feature, reading)
    weight = _value(feature, WEIGHT, 1.0, reading)
    flags = {
        key: _value(feature, declared, nav2 and key == "one_way", reading)
        for key, declared in FLAGS.items()
    }
    _check_keys(feature, reading)
    if name is None or start is None or end is None:
        return
    line = _line(feature, (start, end), reading)
    if name in reading.edges:
        sentence = f"feature {reading.edges[name].feature} is also an edge {name!r}"
        name = _free(name, reading.edges)
        reading.unread(feature, sentence, f"this one is {name!r}", "rename one", IDS)
    if line is not None:
        reading.edges[name] = RouteEdge(
            name, start, end, line, speed, share, weight, **flags, feature=feature.number
        )


def _free(name: str, used: Mapping[str, object]) -> str:
    """Return a name that is not used: `7_2` for the second edge 7."""
    return next(free for number in count(2) if (free := f"{name}_{number}") not in used)


def _id(feature: _Feature, key: str, reading: _Reading) -> str | None:
    raw = feature.properties.get(key)
    number = isinstance(raw, int) and not isinstance(raw, bool) and abs(raw) < 10**18
    if number or (isinstance(raw, str) and raw.isprintable() and 0 < len(raw) <= 100):
        return str(raw)
    got = "nothing" if raw is None else f"{raw!r:.60}"
    reading.wrong(feature, f"`{key}`: expected a word or an integer, got {got}")
    return None


def _node_id(feature: _Feature, key: str, reading: _Reading) -> str | None:
    name = _id(feature, key, reading)
    if name is None or name in reading.nodes:
        return name
    hint = suggestion(name, reading.nodes)
    reading.wrong(feature, f"`{key}`: there is no node {name!r}", hint, IDS)
    return None


def _value(feature: _Feature, declared: Declaration, default: Any, reading: _Reading) -> Any:
    raw = feature.properties.get(declared.name)
    if raw is None:
        return default
    try:
        return declared.read(raw)
    except ParameterError as error:
        reading.wrong(feature, f"{declared.name}: {error.sentence}", error.hint)
        return default


def _speed(feature: _Feature, reading: _Reading) -> tuple[float, float]:
    """Return the limit in m/s and the limit as a share of the top speed (a text ending in %)."""
    raw = feature.properties.get("speed")
    if not isinstance(raw, str) or not raw.strip().endswith("%"):
        return _value(feature, SPEED_LIMIT, inf, reading), 1.0
    try:
        share = read_quantity(raw, "")
        SPEED_SHARE.check(share)
    except ParameterError as error:
        reading.wrong(feature, f"speed: {error.sentence}", error.hint)
        return inf, 1.0
    return inf, share


def _check_keys(feature: _Feature, reading: _Reading) -> None:
    known = _KNOWN[feature.kind]
    left_out = [key for key in feature.properties if key in _NAV2]
    if left_out:
        sentence = f"{feature}: ignored: {', '.join(left_out)}"
        reading.findings.add(LEFT_OUT, feature.mark, sentence)
    for key in feature.properties:
        if key not in known and key not in _NAV2:
            sentence, hint = f"there is no property {key!r}", suggestion(key, known)
            reading.unread(feature, sentence, "it is ignored", hint)


def _position(raw: Any) -> tuple[float, float] | None:
    if not isinstance(raw, list) or len(raw) < 2:
        return None
    for number in raw[:2]:
        if isinstance(number, bool) or not isinstance(number, int | float):
            return None
        if not abs(number) <= LARGEST_COORDINATE:  # also rejects NaN and infinity
            return None
    return float(raw[0]), float(raw[1])


def _line(feature: _Feature, ends: tuple[str, str], reading: _Reading) -> Line | None:
    """Return the edge's line with its ends at its nodes; straight if it has no geometry."""
    places = [reading.nodes[name] for name in ends]
    drawn = places if feature.coordinates is None else _positions(feature)
    if drawn is None:
        sentence = f"{feature.coordinates!r:.60} is not a list of positions"
        hint = "write [[x, y], [x, y]]"
    else:
        sentence = _far_end(drawn, places, ends)
        hint = "move one of them, or swap `from` and `to`"
    if drawn is None or sentence:
        reading.unread(feature, sentence, "a straight line is used", hint)
        drawn = places
    line = _distinct(np.array([places[0], *drawn[1:-1], places[1]]))
    if len(line) < 2:
        reading.wrong(feature, "the line has no length", "give it two different positions")
        return None
    return Line(line)


def _far_end(
    drawn: list[tuple[float, float]], places: list[tuple[float, float]], ends: tuple[str, str]
) -> str:
    """Return a sentence about an end of a line that is not at its node; empty if both are."""
    for place, (x, y), name, word in zip(
        places, (drawn[0], drawn[-1]), ends, ("begins", "ends"), strict=True
    ):
        miss = hypot(place[0] - x, place[1] - y)
        if miss > AT_NODE:
            return (
                f"the line {word} at ({x:g}, {y:g}), but its node {name!r} is at "
                f"({place[0]:g}, {place[1]:g}), {miss:.2f} m away"
            )
    return ""


def _positions(feature: _Feature) -> list[tuple[float, float]] | None:
    """Return the positions of a line; None if it is not a list of at least two."""
    raw = feature.coordinates
    found = [_position(item) for item in raw] if isinstance(raw, list) else []
    known = [place for place in found if place is not None]
    return known if 2 <= len(known) == len(found) else None


def _distinct(points: FloatArray) -> FloatArray:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    distinct: FloatArray = points[np.concatenate([[True], steps > 1e-6])]
    return distinct


def _warn_of_lone_nodes(reading: _Reading) -> None:
    used = {name for edge in reading.edges.values() for name in (edge.start, edge.end)}
    for name in reading.nodes:
        if name not in used:
            feature = reading.owners[name]
            sentence = f"{feature}: the node {name!r} has no edge"
            reading.findings.add(LEFT_OUT, feature.mark, sentence)
