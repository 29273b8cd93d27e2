"""A file in an editor, saved or not: its findings and the meaning of its words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from behaviours.catalogue import Catalogue
from missions.editor.names import Names
from missions.editor.outline import Item, item_at, outline
from missions.execution.resources import catalogue_of
from stack.documents import Findings, Node, read_text
from stack.errors import InputError


@dataclass(frozen=True)
class Reading:
    """A parsed file with the names and behaviours it refers to."""

    names: Names
    catalogue: Catalogue
    items: list[Item]

    def at(self, line: int, column: int) -> Item | None:
        """Return the item at a position, counted from 1."""
        return item_at(self.items, line, column)


def read(text: str, path: Path) -> Reading | None:
    """Parse a text; None if it is not valid YAML."""
    try:
        top = read_text(text, str(path))
    except InputError:
        return None
    return _reading(top, path)


def _reading(top: Node, path: Path) -> Reading:
    names = Names(top, path)
    plugins = top.get("plugins")
    texts = [item for item in (plugins.items if plugins else []) if isinstance(item.value, str)]
    catalogue = catalogue_of(texts, path.parent, Findings())
    signatures = {name: tree.signature for name, tree in names.trees.items()}
    return Reading(names, catalogue, outline(top, catalogue, signatures))


CURSOR = "cursor__here"
"""Placeholder for the word that is being typed."""

_CLOSING = {"{": "}", "[": "]"}


@dataclass(frozen=True)
class CursorReading:
    """A parsed file with a placeholder for the word that is being typed.

    Attributes:
        item: the placeholder.
        cut: whether the lines after it were dropped to parse the file.
    """

    reading: Reading
    item: Item
    cut: bool


def read_at_cursor(text: str, path: Path, line: int, column: int) -> CursorReading | None:
    """Parse a file in which a word is being typed; None if every attempt fails.

    The word is replaced by a placeholder, as a value, as a key, with open brackets closed, and
    finally without the lines after it. The first text that can be parsed is used.

    Args:
        text: the text in the editor.
        path: the path of its file.
        line: line of the cursor, from 1.
        column: first column of the typed word, from 1.
    """
    lines = text.split("\n")
    before, after = lines[: line - 1], lines[line:]
    here = lines[line - 1] if line <= len(lines) else ""
    head = here[: column - 1]
    tail = re.sub(r"^\$?[\w.]*", "", here[column - 1 :])
    closed = _closing(head)
    attempts = [f"{head}{CURSOR}{tail}", f"{head}{CURSOR}:{tail}", f"{head}{CURSOR}{closed}",
                f"{head}{CURSOR}: {closed}"]  # fmt: skip
    for rest, attempt in [(rest, attempt) for rest in (after, []) for attempt in attempts]:
        found = read("\n".join([*before, attempt, *rest]), path)
        item = _placeholder(found.items) if found else None
        if found and item:
            return CursorReading(found, item, rest is not after)
    return None


def _placeholder(items: Sequence[Item]) -> Item | None:
    return next((item for item in items if CURSOR in str(item.node.value)), None)


def _closing(head: str) -> str:
    """Return the brackets that close those left open in the text before the cursor."""
    stack: list[str] = []
    for letter in head:
        if letter in _CLOSING:
            stack.append(_CLOSING[letter])
        elif stack and letter == stack[-1]:
            stack.pop()
    return "".join(reversed(stack))
