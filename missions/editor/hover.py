"""Hover and go-to-definition for the words of a mission file."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path

from missions.editor.document import Reading
from missions.editor.markdown import (
    behaviour_text,
    declaration_text,
    word_text,
)
from missions.editor.names import Name, TreeName
from missions.editor.outline import Item, Use
from missions.inspection.listing import description_of, installed
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.value_types import NAMED, ValueType
from missions.language.keys import CASE, EVENT, EXPECTATION, MISSION, TREE, docs
from stack.components import available, component
from stack.documents import Mark
from stack.errors import InputError
from stack.parameters import Declaration, declarations


def explanation(reading: Reading, item: Item, word: str) -> str:
    """Return documentation of a word as markdown; empty if there is none."""
    if word.startswith("$"):
        return _name_text(reading.names.known(item.scope).get(word[1:]))
    explain = _EXPLAIN.get(item.use)
    return explain(reading, item, word) if explain else ""


def definition(reading: Reading, item: Item, word: str) -> Mark | None:
    """Return the position of a word's definition, in this file or another."""
    names = reading.names
    if word.startswith("$") or item.use in (Use.KEY, Use.PLACE, Use.DECLARED):
        found = names.known(item.scope).get(word.lstrip("$"))
        if found is not None:
            return found.mark
    if item.use is Use.TREE:
        tree = names.trees.get(str(item.node.value))
        return tree.mark if tree else None
    if item.use is Use.INPUT and item.owner in names.trees:
        return names.trees[item.owner].mark
    if item.use in (Use.WORLD, Use.ROBOT, Use.FILE):
        file = names.file_of(item.owner, str(item.node.value))
        return Mark(str(file)) if file else None
    if item.use in (Use.KIND, Use.PORT, Use.OUTPUT):
        return _source(reading, item)
    return None


def parameters_of(owner: str) -> dict[str, Declaration]:
    """Return the parameters of a component (`planner astar`) or of the settings of a kind."""
    from missions.execution.component_choices import DEFAULTS, SETTINGS

    kind, _, name = owner.partition(" ")
    if kind in SETTINGS:
        return declarations(SETTINGS[kind])
    if kind not in DEFAULTS:
        return {}
    try:
        cls = component(kind, name or DEFAULTS[kind])
    except InputError:
        return {}
    return declarations(cls.Parameters)  # type: ignore[attr-defined]


def _source(reading: Reading, item: Item) -> Mark | None:
    """Return the position of a behaviour's class."""
    word = str(item.node.value) if item.use is Use.KIND else item.owner
    kind = reading.catalogue.get(word)
    if kind is None:
        return None
    try:
        line = inspect.getsourcelines(kind.cls)[1]
    except OSError:
        line = 1
    return Mark(str(Path(kind.source).resolve()), line)


def _name_text(name: Name | None) -> str:
    return f"**${name.name}**: {name.role}, {name.type}\n\n`{name.text}`" if name else ""


def _kind(reading: Reading, item: Item, word: str) -> str:
    kind = reading.catalogue.get(str(item.node.value))
    return behaviour_text(kind) if kind else word_text(str(item.node.value))


def _declared(reading: Reading, item: Item, word: str) -> str:
    if item.declared is None:
        return ""
    return f"**{item.declared.name}**: {declaration_text(item.declared)}"


def _input(reading: Reading, item: Item, word: str) -> str:
    tree = reading.names.trees.get(item.owner)
    kind = tree.signature[0].get(word) if tree else None
    return f"**{word}**: `in` of the tree {item.owner}, {kind}" if kind else ""


def _expression(reading: Reading, item: Item, word: str) -> str:
    value = ROBOT_VALUES.get(word)
    return f"**{word}**: {value.help}\n\n*{value.type}*" if value else ""


def _plain_name(reading: Reading, item: Item, word: str) -> str:
    return _name_text(reading.names.known(item.scope).get(word))


def _tree(reading: Reading, item: Item, word: str) -> str:
    tree = reading.names.trees.get(str(item.node.value))
    return tree_text(tree) if tree else ""


def tree_text(tree: TreeName) -> str:
    """Return markdown about a tree, with its inputs and outputs."""
    inputs, outputs = (_types(types) for types in tree.signature)
    lines = [f"**{tree.name}**: a tree", tree.doc, inputs and f"in: {inputs}",
             outputs and f"out: {outputs}"]  # fmt: skip
    return "\n\n".join(filter(None, lines))


def _types(types: object) -> str:
    assert isinstance(types, dict)
    return ", ".join(f"`{name}` ({kind})" for name, kind in types.items())


def _declared_here(reading: Reading, item: Item, word: str) -> str:
    if item.owner == "trees":
        tree = reading.names.trees.get(word)
        return tree_text(tree) if tree else ""
    return _plain_name(reading, item, word)


def _component(reading: Reading, item: Item, word: str) -> str:
    name = str(item.node.value)
    from missions.execution.component_choices import DEFAULTS

    if item.owner not in DEFAULTS or name not in available(item.owner):
        return ""
    return f"**{name}**: {inspect.cleandoc(component(item.owner, name).__doc__ or '')}"


def _parameter(reading: Reading, item: Item, word: str) -> str:
    declared = parameters_of(item.owner).get(word)
    return f"**{word}**: {declaration_text(declared)}" if declared else ""


def _shipped(reading: Reading, item: Item, word: str) -> str:
    try:
        return f"```text\n{description_of(str(item.node.value), installed())}\n```"
    except InputError:
        return ""


def _type(reading: Reading, item: Item, word: str) -> str:
    found: ValueType | None = NAMED.get(word)
    return f"**{word}**: {found}" if found else ""


def _keyed(texts: dict[str, str]) -> Callable[[Reading, Item, str], str]:
    def explain(reading: Reading, item: Item, word: str) -> str:
        return f"**{word}**: {texts[word]}" if word in texts else ""

    return explain


_EXPLAIN: dict[Use, Callable[[Reading, Item, str], str]] = {
    Use.TOP_KEY: _keyed(docs(MISSION)), Use.TREE_KEY: _keyed(docs(TREE)),
    Use.EVENT_KEY: _keyed(docs(EVENT)), Use.CASE_KEY: _keyed({**docs(CASE), **docs(EXPECTATION)}),
    Use.KIND: _kind, Use.INPUT: _input, Use.TREE: _tree,
    Use.MODIFIER: lambda reading, item, word: word_text(word),
    Use.PORT: _declared, Use.OUTPUT: _declared, Use.VALUE: _declared,
    Use.EXPRESSION: _expression, Use.KEY: _plain_name, Use.PLACE: _plain_name,
    Use.DECLARED: _declared_here, Use.TYPE: _type, Use.COMPONENT: _component,
    Use.PARAMETER: _parameter, Use.WORLD: _shipped, Use.ROBOT: _shipped,
}  # fmt: skip
