"""Hover and go-to-definition for the words of a mission file."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path

from behaviours.kind import BehaviourKind
from missions.editor.document import Reading
from missions.editor.markdown import behaviour_text, declaration_text, word_text
from missions.inspection.listing import description_of, installed
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.terms import POSE_FIELDS
from missions.language.expressions.texts import formatter, has_placeholders
from missions.language.expressions.value_types import LENGTH, NAMED, ValueType
from missions.language.kinds import NODES
from missions.language.reading.words import Word, WordRole
from missions.language.sections import SECTIONS
from missions.language.step import Tree
from stack.components import DEFAULTS, available, component
from stack.documents import Mark
from stack.drivetrain.needs import needs_text
from stack.errors import InputError
from stack.parameters import Declaration, declarations


def explanation(reading: Reading, word: Word, text: str) -> str:
    """Return documentation of a word as markdown; empty if there is none.

    Args:
        reading: the file.
        word: the key or value at the position.
        text: the part of it at the position: `$dock` of `$dock is set`.
    """
    if text.startswith("$"):
        name, _, field = text[1:].partition(".")
        if field in POSE_FIELDS and name in reading.known(word):
            return f"**{text}**: {field} of ${name}, map frame\n\n*{POSE_FIELDS[field]}*"
        return _name_text(reading, word, name)
    explain = _EXPLAIN.get(word.role)
    return explain(reading, word, text) if explain else ""


def definition(reading: Reading, word: Word, text: str) -> Mark | None:
    """Return the position of a word's definition, in this file or another."""
    named = (WordRole.KEY, WordRole.PLACE, WordRole.DECLARED, WordRole.EXPECTATION)
    unnamed = word.role is WordRole.DECLARED and word.owner in ("trees", "events")
    if text.startswith("$") or (word.role in named and not unnamed):
        found = reading.known(word).get(text.lstrip("$").partition(".")[0])
        if found is not None:
            return reading.mark_of(found)
    value, trees = str(word.node.value), reading.words.trees
    if word.role in (WordRole.TREE, WordRole.NODE_NAME):
        return trees[value].mark if value in trees else None
    if word.role in (WordRole.INPUT, WordRole.OUTPUT) and word.owner in trees:
        tree = trees[word.owner]
        declared = {**tree.inputs, **tree.outputs}.get(text)
        return declared.mark if declared else tree.mark
    if word.role in (WordRole.WORLD, WordRole.ROBOT, WordRole.FILE):
        file = reading.file_of(word.owner, value)
        return Mark(str(file)) if file else None
    if word.role in (WordRole.KIND, WordRole.PORT, WordRole.OUTPUT):
        return _source(reading, word)
    return None


def parameters_of(owner: str) -> dict[str, Declaration]:
    """Return the parameters of a component (`planner astar`), of settings, or of a fault."""
    from missions.execution.component_choices import SETTINGS
    from stack.sim.faults.registry import fault_kind, fault_names

    kind, _, name = owner.partition(" ")
    if kind in SETTINGS:
        return declarations(SETTINGS[kind])
    if owner in fault_names():
        return declarations(fault_kind(owner).Parameters)
    if kind not in DEFAULTS:
        return {}
    try:
        cls = component(kind, name or DEFAULTS[kind])
    except InputError:
        return {}
    return declarations(cls.Parameters)  # type: ignore[attr-defined]


def signature_of_kind(
    reading: Reading, word: str
) -> tuple[Mapping[str, Declaration], Mapping[str, Declaration]]:
    """Return the ports and outputs of a node type; empty if it has none."""
    if word in NODES:
        return NODES[word].ports, NODES[word].outputs
    kind = _behaviour(reading, word)
    return (kind.ports, kind.outputs) if kind else ({}, {})


def _behaviour(reading: Reading, word: str) -> BehaviourKind | None:
    catalogue = reading.words.catalogue
    return catalogue.get(word) if catalogue else None


def _source(reading: Reading, word: Word) -> Mark | None:
    """Return the position of a behaviour's class."""
    named = str(word.node.value) if word.role is WordRole.KIND else word.owner
    kind = _behaviour(reading, named)
    if kind is None:
        return None
    try:
        line = inspect.getsourcelines(kind.cls)[1]
    except OSError:
        line = 1
    return Mark(str(Path(kind.source).resolve()), line)


def symbol_text(reading: Reading, symbol: Symbol) -> str:
    """Return markdown about a declared name: its role, type and value."""
    role: str = symbol.role
    if reading.is_of_world(symbol):
        role = "place of the world"
    for tree in reading.words.trees.values():
        if symbol in (*tree.inputs.values(), *tree.outputs.values()):
            role = f"{role} {tree.name}"
    parts = [f"**${symbol.name}**: {role}, {symbol.type}"]
    if symbol.value is not UNSET and symbol.value is not None:
        parts.append(f"`{formatter(symbol.type, shown)(symbol.value)}`")
    return "\n\n".join(parts)


def _name_text(reading: Reading, word: Word, name: str) -> str:
    symbol = reading.known(word).get(name)
    return symbol_text(reading, symbol) if symbol else ""


def _kind(reading: Reading, word: Word, text: str) -> str:
    kind = _behaviour(reading, str(word.node.value))
    return behaviour_text(kind) if kind else word_text(str(word.node.value))


def _declared(reading: Reading, word: Word, text: str) -> str:
    if word.declared is None:
        return ""
    return f"**{word.declared.name}**: {declaration_text(word.declared)}"


def _output(reading: Reading, word: Word, text: str) -> str:
    _, outputs = signature_of_kind(reading, word.owner)
    declared = outputs.get(text, word.declared)
    return f"**{declared.name}**: {declaration_text(declared)}" if declared else ""


def _input(reading: Reading, word: Word, text: str) -> str:
    tree = reading.words.trees.get(word.owner)
    symbol = tree.inputs.get(text) if tree else None
    return f"**{text}**: `in` of the tree {word.owner}, {symbol.type}" if symbol else ""


def _expression(reading: Reading, word: Word, text: str) -> str:
    value, function = ROBOT_VALUES.get(text), FUNCTIONS.get(text)
    if function is not None and (value is None or f"{text}(" in str(word.node.value)):
        return f"**{function.signature}**: {function.help}\n\n*{function.result}*"
    if text == DISTANCE:
        return f"**{DISTANCE}(place)**: straight-line distance from the robot\n\n*{LENGTH}*"
    return f"**{text}**: {value.help}\n\n*{value.type}*" if value else ""


def _value(reading: Reading, word: Word, text: str) -> str:
    named = _name_text(reading, word, text) if has_placeholders(str(word.node.value)) else ""
    return named or _expression(reading, word, text) or _declared(reading, word, text)


def _tree(reading: Reading, word: Word, text: str) -> str:
    tree = reading.words.trees.get(str(word.node.value))
    return tree_text(tree) if tree else ""


def tree_text(tree: Tree) -> str:
    """Return markdown about a tree, with its inputs and outputs."""
    inputs, outputs = _types(tree.inputs), _types(tree.outputs)
    lines = [f"**{tree.name}**: a tree", tree.doc, inputs and f"in: {inputs}",
             outputs and f"out: {outputs}"]  # fmt: skip
    return "\n\n".join(filter(None, lines))


def _types(symbols: Mapping[str, Symbol]) -> str:
    return ", ".join(f"`{name}` ({symbol.type})" for name, symbol in symbols.items())


def _declared_here(reading: Reading, word: Word, text: str) -> str:
    if word.owner == "trees":
        return _tree(reading, word, text)
    return "" if word.owner == "events" else _name_text(reading, word, text)


def _node_name(reading: Reading, word: Word, text: str) -> str:
    return _tree(reading, word, text) or _kind(reading, word, text)


def _section_key(reading: Reading, word: Word, text: str) -> str:
    key = SECTIONS.get(word.owner, {}).get(text)
    return f"**{text}**: {key.doc}" if key else ""


def _expectation(reading: Reading, word: Word, text: str) -> str:
    key = SECTIONS["expectation"].get(text)
    return f"**{text}**: {key.doc}" if key else _name_text(reading, word, text)


def _component(reading: Reading, word: Word, text: str) -> str:
    name = str(word.node.value)
    if word.owner not in DEFAULTS or name not in available(word.owner):
        return ""
    cls = component(word.owner, name)
    needs = needs_text(cls.needs)  # type: ignore[attr-defined]
    return "\n\n".join(filter(None, [f"**{name}**: {inspect.cleandoc(cls.__doc__ or '')}", needs]))


def _parameter(reading: Reading, word: Word, text: str) -> str:
    declared = parameters_of(word.owner).get(text)
    return f"**{text}**: {declaration_text(declared)}" if declared else ""


def _shipped(reading: Reading, word: Word, text: str) -> str:
    try:
        return f"```text\n{description_of(str(word.node.value), installed())}\n```"
    except InputError:
        return ""


def _type(reading: Reading, word: Word, text: str) -> str:
    found: ValueType | None = NAMED.get(text)
    return f"**{text}**: {found}" if found else ""


_EXPLAIN: dict[WordRole, Callable[[Reading, Word, str], str]] = {
    WordRole.SECTION_KEY: _section_key, WordRole.EXPECTATION: _expectation,
    WordRole.KIND: _kind, WordRole.INPUT: _input, WordRole.TREE: _tree,
    WordRole.MODIFIER: lambda reading, word, text: word_text(text),
    WordRole.PORT: _declared, WordRole.OUTPUT: _output, WordRole.VALUE: _value,
    WordRole.EXPRESSION: _expression, WordRole.CHANGE: _expression,
    WordRole.KEY: _name_text, WordRole.PLACE: _name_text, WordRole.ARGUMENT: _name_text,
    WordRole.DECLARED: _declared_here, WordRole.TYPE: _type, WordRole.COMPONENT: _component,
    WordRole.PARAMETER: _parameter, WordRole.WORLD: _shipped, WordRole.ROBOT: _shipped,
    WordRole.FAULT: _shipped,
    WordRole.NODE_NAME: _node_name,
}  # fmt: skip
