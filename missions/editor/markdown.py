"""Markdown about the words of mission files: what schemas, hovers and completions show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from behaviours.catalogue import BehaviourKind
from missions.language.reading.modifiers import MODIFIERS
from missions.language.reading.nodes import COMPOSITES
from stack.parameters import Declaration

TOP_KEYS: dict[str, str] = {
    "mission": "What the mission is called.",
    "format": "The version of the mission language; this is `1`.",
    "doc": "What the mission is for, in a sentence.",
    "robot": "A robot that comes with treepilot, or a path to a `robot.yaml`.",
    "world": "A world that comes with treepilot, or a path to a world file.",
    "start": "Where the robot truly begins: a place or `[x, y, heading]`.",
    "initial_pose": "Where the robot believes it begins: `start`, `unknown`, a place or a pose.",
    "map": "`from_world` (the default), `none`, or a ROS `map.yaml`.",
    "places": "Named poses in the map frame: `dock: [0, 0, 90 deg]`.",
    "parameters": "Parameter files, applied in order before `navigation`.",
    "navigation": "Components by name, and their parameters.",
    "plugins": "Folders, files or modules with behaviours, planners and controllers of your own.",
    "include": "Files whose `trees` and `places` this mission may use.",
    "arguments": "Typed inputs of the mission, set with `--set name=value`.",
    "blackboard": "Every key that nodes may read and write, typed.",
    "events": "Looked at on every tick, first wins; a triggered one pre-empts `run`.",
    "run": "The tree that is the mission.",
    "trees": "Trees that `use` runs, with what goes `in` and comes `out`.",
    "tests": "What `treepilot test` tries, without a simulator.",
}
"""Keys at the top of a mission file."""

TREE_KEYS: dict[str, str] = {
    "in": "What goes in: `{target: Pose, dwell: {type: duration, default: 3 s}}`.",
    "out": "What comes out of it: `{photo: path}`.",
    "doc": "What the tree does.",
    "do": "Its node.",
}


def declaration_text(declared: Declaration) -> str:
    """A port, output or parameter: its sentence, type, default and range."""
    facts = [declared.type_name()]
    if declared.required:
        facts.append("required")
    elif declared.default is not None:
        facts.append(f"default `{shown(declared)}`")
    if declared.range_text():
        facts.append(f"`{declared.range_text()}`")
    sentence = declared.help[:1].upper() + declared.help[1:]
    return f"{sentence}\n\n*{' · '.join(facts)}*" if sentence else f"*{' · '.join(facts)}*"


def shown(declared: Declaration) -> str:
    """A default as a mission file would have it."""
    value = declared.default
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:g} {declared.unit}".rstrip()
    return str(value)


def behaviour_text(kind: BehaviourKind) -> str:
    """A behaviour with its ports and outputs."""
    parts = [f"**{kind.name}**", kind.doc]
    parts += _listed("Ports", kind.ports)
    parts += _listed("Outputs", kind.outputs)
    return "\n\n".join(part for part in parts if part)


def word_text(word: str) -> str:
    """A composite or modifier; empty for any other word."""
    text = COMPOSITES.get(word) or MODIFIERS.get(word)
    return f"**{word}**: {text}" if text else ""


def _listed(title: str, declared: Mapping[str, Declaration]) -> list[str]:
    if not declared:
        return []
    return [f"{title}:\n{_bullets(declared.values())}"]


def _bullets(declared: Iterable[Declaration]) -> str:
    lines = []
    for item in declared:
        about = ", ".join(filter(None, [item.type_name(), item.range_text()]))
        need = " **required**" if item.required else ""
        lines.append(f"- `{item.name}` ({about}){need}: {item.help}")
    return "\n".join(lines)
