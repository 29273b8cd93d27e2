"""Markdown about the words of mission files, for schemas, hover and completion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from behaviours.catalogue import BehaviourKind
from missions.language.reading.modifiers import MODIFIERS
from missions.language.reading.nodes import COMPOSITES
from stack.parameters import Declaration

TOP_KEYS: dict[str, str] = {
    "mission": "Name of the mission.",
    "format": "Version of the mission language: `1`.",
    "doc": "One-sentence description of the mission.",
    "robot": "Name of a shipped robot, or the path of a `robot.yaml`.",
    "world": "Name of a shipped world, or the path of a world file.",
    "start": "True start pose of the robot: a place or `[x, y, heading]`.",
    "initial_pose": "Initial pose estimate: `start`, `unknown`, a place or a pose.",
    "map": "`from_world` (the default), `none`, or a ROS `map.yaml`.",
    "places": "Named poses in the map frame: `dock: [0, 0, 90 deg]`.",
    "parameters": "Parameter files, applied in order before `navigation`.",
    "navigation": "Components of the navigation stack and their parameters.",
    "localisation": "Estimator of the pose: a name, or `{use: name, parameter: value}`.",
    "plugins": "Folders, files or modules with your own behaviours and components of navigation.",
    "include": "Files whose `trees` and `places` this mission can use.",
    "arguments": "Typed inputs of the mission, set with `--set name=value`.",
    "blackboard": "Typed keys that nodes can read and write.",
    "events": "Conditions checked on every tick in this order; a triggered event pre-empts `run`.",
    "run": "The behaviour tree of the mission.",
    "trees": "Subtrees for `use`, with inputs (`in`) and outputs (`out`).",
    "tests": "Test cases for `treepilot test`, run without a simulator.",
}
"""Keys at the top of a mission file."""

TREE_KEYS: dict[str, str] = {
    "in": "Inputs: `{target: Pose, dwell: {type: duration, default: 3 s}}`.",
    "out": "Outputs: `{photo: path}`.",
    "doc": "Description of the tree.",
    "do": "Root node of the tree.",
}


def declaration_text(declared: Declaration) -> str:
    """Return markdown about a port, output or parameter: help, type, default and range."""
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
    """Return a default as written in a mission file."""
    value = declared.default
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:g} {declared.unit}".rstrip()
    return str(value)


def behaviour_text(kind: BehaviourKind) -> str:
    """Return markdown about a behaviour, with its ports and outputs."""
    parts = [f"**{kind.name}**", kind.doc]
    parts += _listed("Ports", kind.ports)
    parts += _listed("Outputs", kind.outputs)
    return "\n\n".join(part for part in parts if part)


def word_text(word: str) -> str:
    """Return markdown about a composite or modifier; empty for any other word."""
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
