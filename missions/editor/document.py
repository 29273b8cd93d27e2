"""A file as an editor has it, saved or not: its findings, and what its words mean."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from behaviours.catalogue import Catalogue
from missions.editor.names import Names
from missions.editor.outline import Item, item_at, outline
from missions.execution.resources import catalogue_of, resources
from missions.language.reading.mission import read_mission
from robots.load import read_robot
from stack.documents import Finding, Findings, Mark, Node, read_text
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world


class FileKind(StrEnum):
    """What kind of file it is."""

    MISSION = "mission"
    WORLD = "world"
    ROBOT = "robot"
    TREES = "trees"
    OTHER = "other"


@dataclass(frozen=True)
class Reading:
    """A file that could be parsed, with what it refers to."""

    names: Names
    catalogue: Catalogue
    items: list[Item]

    def at(self, line: int, column: int) -> Item | None:
        """The word at a position, counted from 1."""
        return item_at(self.items, line, column)


def file_kind(text: str) -> FileKind:
    """What kind of file a text is, by the keys at its margin; editors ask of any YAML file."""
    keys = set(re.findall(r"^([a-z_]+)\s*:", text, re.MULTILINE))
    if "mission" in keys or {"run", "robot"} <= keys or {"run", "world"} <= keys:
        return FileKind.MISSION
    if "world" in keys and keys & {"walls", "boxes", "places", "bounds", "format"}:
        return FileKind.WORLD
    if "robot" in keys and keys & {"wheels", "urdf", "footprint"}:
        return FileKind.ROBOT
    return FileKind.TREES if keys & {"trees", "places"} else FileKind.OTHER


def findings_in(text: str, path: Path) -> tuple[Finding, ...]:
    """Everything wrong with a text that stands, or will stand, in a file."""
    sort = file_kind(text)
    try:
        if sort is FileKind.MISSION:
            return read_mission(path, catalogue_of, resources(), text=text).warnings
        if sort is FileKind.WORLD:
            read_world(path, text)
        elif sort is FileKind.ROBOT:
            read_robot(path, text)
        elif sort is FileKind.TREES:
            read_text(text, str(path))
    except InputError as error:
        return error.findings or (Finding(Mark(str(path)), "E110", str(error)),)
    return ()


def read(text: str, path: Path) -> Reading | None:
    """What the words of a text mean; None when it cannot be parsed."""
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
"""Stands for the word under way."""

_CLOSING = {"{": "}", "[": "]"}


@dataclass(frozen=True)
class UnderWay:
    """A file in which a word is being typed.

    Attributes:
        item: the stand-in for the word.
        cut: what follows it had to be left out.
    """

    reading: Reading
    item: Item
    cut: bool


def read_at_cursor(text: str, path: Path, line: int, column: int) -> UnderWay | None:
    """The file and the word that is being typed, whatever state the file is in.

    The word under way is replaced by a stand-in, as a value and as a key, with open brackets
    closed, and, if nothing else helps, with what follows left out; the first text that can be
    parsed is taken.

    Args:
        text: the file as the editor has it.
        path: where it stands.
        line: of the cursor, from 1.
        column: of the first character of the word under way, from 1.
    """
    lines = text.split("\n")
    before, after = lines[: line - 1], lines[line:]
    here = lines[line - 1] if line <= len(lines) else ""
    head = here[: column - 1]
    tail = re.sub(r"^\$?[\w.]*", "", here[column - 1 :])
    closed = _closing(head)
    tries = [f"{head}{CURSOR}{tail}", f"{head}{CURSOR}:{tail}", f"{head}{CURSOR}{closed}",
             f"{head}{CURSOR}: {closed}"]  # fmt: skip
    for rest, attempt in [(rest, attempt) for rest in (after, []) for attempt in tries]:
        found = read("\n".join([*before, attempt, *rest]), path)
        item = _stand_in(found.items) if found else None
        if found and item:
            return UnderWay(found, item, rest is not after)
    return None


def _stand_in(items: Sequence[Item]) -> Item | None:
    return next((item for item in items if CURSOR in str(item.node.value)), None)


def _closing(head: str) -> str:
    """The brackets that are still open at the end of a line's beginning."""
    stack: list[str] = []
    for letter in head:
        if letter in _CLOSING:
            stack.append(_CLOSING[letter])
        elif stack and letter == stack[-1]:
            stack.pop()
    return "".join(reversed(stack))
