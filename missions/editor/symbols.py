"""Document symbols: the sections, names, trees and nodes of a mission file, as a tree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from missions.editor.document import Reading
from missions.language.keys import MISSION, Form
from missions.language.kinds import NODES
from missions.language.kinds.kind import Shape
from missions.language.reading.words import WordRole
from stack.documents import Node

_NAMES = (Form.POSES, Form.NAMED)


@dataclass(frozen=True)
class Entry:
    """One line of the outline.

    Attributes:
        kind: section | name | tree | event | node | test.
        key: the word that it stands for.
        last: the last key or value below it.
    """

    name: str
    kind: str
    key: Node
    last: Node
    detail: str = ""
    children: list[Entry] = field(default_factory=list)


def outline(reading: Reading) -> list[Entry]:
    """Return the entries of a file, in the order of the file."""
    heads = {
        id(word.node) for word in reading.words.of_file(str(reading.path))
        if word.role is WordRole.KIND
    }  # fmt: skip
    found = []
    for key, value in reading.top.entries:
        known = MISSION.get(str(key.value))
        if known is not None:
            entry = Entry(known.word, "section", key, _last(value))
            entry.children.extend(_inside(known.word, known.form, value, heads))
            found.append(entry)
    return found


def _inside(word: str, form: Form, value: Node, heads: set[int]) -> Iterator[Entry]:
    if form in _NAMES:
        kind = "tree" if word == "trees" else "name"
        for key, body in value.entries:
            below: list[Entry] = []
            if kind == "tree":
                below += _events(body.get("events"), heads)
                below += _nodes(body.get("do"), heads)
            yield Entry(str(key.value), kind, key, _last(body), children=below)
    elif form is Form.NAMED_LIST:
        yield from _events(value, heads)
    elif form is Form.LIST:
        for number, item in enumerate(value.items, 1):
            name = item.get("name")
            title = str(name.value) if name else f"case {number}"
            yield Entry(title, "test", name or item, _last(item))
    elif form is Form.NODE:
        yield from _nodes(value, heads)


def _events(section: Node | None, heads: set[int]) -> Iterator[Entry]:
    for item in section.items if section else ():
        for key, body in item.entries:
            below = list(_nodes(body.get("do"), heads))
            yield Entry(str(key.value), "event", key, _last(body), children=below)


def _nodes(node: Node | None, heads: set[int]) -> Iterator[Entry]:
    """Yield the nodes at a place: the node itself, or those below it."""
    if node is None:
        return
    if id(node) in heads:
        yield Entry(str(node.value), "node", node, node)
        return
    head = next(((key, value) for key, value in node.entries if id(key) in heads), None)
    if head is None:
        for item in (*node.items, *(value for _, value in node.entries)):
            yield from _nodes(item, heads)
        return
    key, value = head
    name, word = node.get("name"), str(key.value)
    title = str(name.value) if name else word
    if word in NODES and NODES[word].shape is Shape.TREE and not name:
        title = f"{word} {value.value}"
    below: list[Entry] = []
    if word in NODES:
        for part in (value, node.get("do")):
            below += _nodes(part, heads)
    recover = node.get("recover")
    below += _nodes(recover.get("round_robin") if recover else None, heads)
    below += _nodes(node.get("finally"), heads)
    yield Entry(title, "node", key, _last(node), word if name else "", below)


def _last(node: Node) -> Node:
    """Return the last key or value of a node, by its position."""
    below = [*(part for entry in node.entries for part in entry), *node.items]
    found = [node, *map(_last, below[-2:])]
    return max(found, key=lambda one: one.mark)
