"""Expected meaning of a mission file, from its plain data, without the code under test."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from behaviours.kind import BehaviourKind
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import Symbol
from stack.documents import Mark

COMPOSITES = ("sequence", "reactive", "fallback", "reactive_fallback", "round_robin", "parallel")
BESIDE = (
    "name", "when", "finally", "on_failure", "while", "invert", "repeat", "recover", "retry",
    "timeout", "every", "with", "out", "do",
)  # fmt: skip
OUTER = (
    "every", "timeout", "retry", "recover", "repeat", "invert", "while", "on_failure", "finally",
    "when",
)  # fmt: skip
"""Modifiers from the node outwards, as docs/language.md orders them."""

LOOPS = ("for_each", "follow_waypoints")

Outline = tuple[str, list[Any]]


def outline(mission: dict[str, Any]) -> Outline:
    """Return the nested kinds of the nodes that `run` and `events` of the file describe."""
    trees = mission.get("trees") or {}
    return _with_events(mission, _node(mission["run"], trees), trees)


def _with_events(declared: dict[str, Any], root: Outline, trees: dict[str, Any]) -> Outline:
    events = declared.get("events") or []
    if not events:
        return root
    made = [("event", [_node(body["do"], trees)]) for event in events for body in event.values()]
    return "events", [*made, root]


def _node(node: Any, trees: dict[str, Any]) -> Outline:
    node = {node: None} if isinstance(node, str) else node
    (kind,) = (key for key in node if key not in BESIDE)
    made = _body(kind, node, trees)
    for word in OUTER:
        given = node.get(word)
        if given is None or (word == "on_failure" and (given == "fail" or kind in LOOPS)):
            continue
        if word == "invert" and not given:
            continue
        beside = given["round_robin"] if word == "recover" else [given] * (word == "finally")
        made = word, [made, *(_node(other, trees) for other in beside)]
    return made


def _body(kind: str, node: dict[str, Any], trees: dict[str, Any]) -> Outline:
    below = node[kind]
    if kind == "use":
        tree = trees[below]
        return "use", [_with_events(tree, _node(tree["do"], trees), trees)]
    if kind == "switch":
        nodes = [*below["cases"].values(), *filter(None, [below.get("default")])]
        return kind, [("case", [_node(case, trees)]) for case in nodes]
    if kind == "for_each":
        return "for_each", [_node(node["do"], trees)]
    if kind == "follow_waypoints":
        return kind, [_waypoint(node, trees)]
    if kind not in COMPOSITES:
        return kind, []
    children = below["do"] if isinstance(below, dict) else below
    return kind, [_node(child, trees) for child in children]


def _waypoint(node: dict[str, Any], trees: dict[str, Any]) -> Outline:
    """Return the drive to one waypoint and the task there."""
    given = node["follow_waypoints"]
    drive: Outline = ("navigate_to_pose", [])
    if isinstance(given, dict) and given.get("time_limit") is not None:
        drive = ("timeout", [drive])
    return ("sequence", [drive, _node(node["do"], trees)]) if "do" in node else drive


def compiled_outline(rows: Any) -> Outline:
    """Return the same for a compiled tree, from its rows."""
    made: dict[int, Outline] = {row.id: (row.kind, []) for row in rows}
    for row in rows:
        if row.parent >= 0:
            made[row.parent][1].append(made[row.id])
    return made[rows[0].id]


DEFAULTS = {"then": "resume", "map": "from_world", "initial_pose": "start", "parameters": []}
WITHOUT_EFFECT = ("format", "doc", "range")
"""Keys without an effect on the model: they are only checked, or are documentation."""


def told(data: Any) -> Any:
    """Return the data without default values and keys without effect."""
    if isinstance(data, dict):
        # A key may be a time, as below a test's `at`.
        said = {told(key): told(value) for key, value in data.items() if key not in WITHOUT_EFFECT}
        if "mission" in said and "world" not in said and said.get("map") == "none":
            del said["map"]  # without a world there is none by default
        return {key: value for key, value in said.items() if DEFAULTS.get(key) != value}
    if isinstance(data, list):
        return [told(item) for item in data]
    if data is None or data == {}:
        return {}
    if isinstance(data, str) and (found := re.fullmatch(r"(-?[\d.]*\d) *([a-z/²%]*)", data)):
        number, unit = float(found[1]), found[2]
        return number if unit in ("", "s", "m", "m/s") or number == 0 else (number, unit)
    return data


def meaning(value: Any) -> Any:
    """Return the content of a checked mission without positions."""
    if isinstance(value, BehaviourKind):
        return value.name
    if isinstance(value, CheckedExpression):
        return value.source
    if isinstance(value, Symbol):
        return value.name, str(value.role), str(value.type), str(value.value), value.one_of
    if isinstance(value, Mark | Path):
        return None
    if is_dataclass(value):
        skipped = ("source", "warnings", "doc")
        names = [field.name for field in fields(value) if field.name not in skipped]
        return type(value).__name__, [(name, meaning(getattr(value, name))) for name in names]
    if isinstance(value, dict):
        kept = {str(key): item for key, item in value.items() if not isinstance(item, Mark)}
        return [(key, meaning(kept[key])) for key in sorted(kept)]
    if isinstance(value, list | tuple):
        return [meaning(item) for item in value]
    return repr(value)
