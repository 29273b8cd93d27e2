"""Markdown about the words of mission files, for hover and completion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from behaviours.kind import BehaviourKind
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES
from stack.drivetrain.needs import needs_text
from stack.parameters import Declaration


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
    parts = [f"**{kind.name}**", kind.doc, needs_text(kind.needs)]
    parts += _listed("Ports", kind.ports)
    parts += _listed("Outputs", kind.outputs)
    return "\n\n".join(part for part in parts if part)


def word_text(word: str) -> str:
    """Return markdown about a node kind or modifier; empty for any other word."""
    if word in NODES:
        kind = NODES[word]
        parts = [f"**{word}**: {kind.doc}"]
        return "\n\n".join(
            [*parts, *_listed("Ports", kind.ports), *_listed("Outputs", kind.outputs)]
        )
    return f"**{word}**: {MODIFIERS[word].doc}" if word in MODIFIERS else ""


def _listed(title: str, declared: Mapping[str, Declaration]) -> list[str]:
    if not declared:
        return []
    return [f"{title}:\n{_bullets(declared.values(), needed=title == 'Ports')}"]


def _bullets(declared: Iterable[Declaration], needed: bool) -> str:
    lines = []
    for item in declared:
        about = ", ".join(filter(None, [item.type_name(), item.range_text()]))
        need = " **required**" if needed and item.required else ""
        lines.append(f"- `{item.name}` ({about}){need}: {item.help}")
    return "\n".join(lines)
