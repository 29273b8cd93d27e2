"""A file in an editor, saved or not: its findings and the roles of its words."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from missions.execution.resources import WORLDS, catalogue_of, load_world
from missions.inspection.diagnosis import FileKind, file_kind, findings_of
from missions.language.expressions.scope import Scope, Symbol
from missions.language.keys import MISSION
from missions.language.model import Resources
from missions.language.reading.mission import read_mission
from missions.language.reading.trees import read_trees
from missions.language.reading.words import Draft, Word, WordRole, Words
from robots.load import find_robot
from stack.documents import Finding, Findings, Mark, Node, read_file
from stack.errors import InputError
from stack.sim.worlds.world_file import find_world

CHECKED = (
    FileKind.MISSION, FileKind.WORLD, FileKind.ROBOT, FileKind.TREES, FileKind.FAULTS,
)  # fmt: skip
"""Kinds of files that are checked; editors open any YAML file."""


@dataclass(frozen=True)
class Reading:
    """A file as the readers see it.

    Attributes:
        top: its document.
        words: its words, and those of the files that it includes.
        findings: what `treepilot check` reports for it.
    """

    path: Path
    top: Node
    words: Words
    findings: tuple[Finding, ...] = ()

    def at(self, line: int, column: int) -> Word | None:
        """Return the word at a position, counted from 1.

        A value of several lines is found in its first line.
        """
        before = [
            word for word in self.words.of_file(str(self.path))
            if word.node.mark.line == line and word.node.mark.column <= column
        ]  # fmt: skip
        # A word that was read twice counts as it was read first: with all names.
        return max(before, key=lambda word: word.node.mark.column, default=None)

    def scope(self, word: Word) -> Scope:
        """Return the names that are visible at a word."""
        return self.words.scope if word.scope is None else word.scope

    def known(self, word: Word) -> dict[str, Symbol]:
        """Return the visible names, the outermost first; hidden ones are left out."""
        layers = reversed(self.scope(word).layers)
        return {name: symbol for layer in layers for name, symbol in layer.items()}

    def mark_of(self, symbol: Symbol) -> Mark:
        """Return the position of a declaration; a place of the world is declared in its file."""
        file = self._world_of(symbol)
        places = (_read(file) or self.top).get("places") if file is not None else None
        keys = [key for key, _ in places.entries if key.value == symbol.name] if places else []
        return keys[0].mark if keys else symbol.mark

    def is_of_world(self, symbol: Symbol) -> bool:
        """Return whether a symbol is a place of the world."""
        return self._world_of(symbol) is not None

    def _world_of(self, symbol: Symbol) -> Path | None:
        world = self.top.get("world")
        if world is None or symbol.mark != world.mark:
            return None
        return self.file_of("world", str(world.value))

    def file_of(self, key: str, value: str) -> Path | None:
        """Return the file that the value of a top-level key names; None if there is none."""
        folder = self.path.parent
        try:
            if key == "world":
                return find_world(value, folder, WORLDS)
            if key == "robot":
                return find_robot(value, folder)
        except InputError:
            return None
        file = folder / value
        return file if file.is_file() else None


def diagnosed(text: str, path: Path) -> tuple[Reading | None, tuple[Finding, ...]]:
    """Return the reading of a text, None if it is not valid YAML, and its findings."""
    if file_kind(path, text) not in CHECKED:
        return None, ()
    draft = Draft(text)
    findings = findings_of(path, draft)
    top = draft.words.document
    return (Reading(path, top, draft.words, findings) if top else None), findings


def read_words(text: str, path: Path) -> Reading | None:
    """Read the words of a text without its findings; None if it is not valid YAML."""
    draft = Draft(text)
    with suppress(InputError):
        if file_kind(path, text) is FileKind.TREES:
            read_trees(path, catalogue_of([], path.parent, Findings()), draft)
        else:
            read_mission(path, catalogue_of, _NAMES_ONLY, {}, draft)
    top = draft.words.document
    return Reading(path, top, draft.words) if top else None


_NAMES_ONLY = Resources(world_places=lambda name, folder: load_world(name, folder).places)
"""What the words depend on; robots, maps and components are not read for them."""

CURSOR = "cursor__here"
"""Placeholder for the word that is being typed."""

_CLOSING = {"{": "}", "[": "]"}


@dataclass(frozen=True)
class CursorReading:
    """A file with a placeholder for the word that is being typed.

    Attributes:
        word: the placeholder.
        cut: whether the lines after it were dropped to parse the file.
    """

    reading: Reading
    word: Word
    cut: bool


def read_at_cursor(text: str, path: Path, line: int, column: int) -> CursorReading | None:
    """Read a file in which a word is being typed; None if every attempt fails.

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
        found = read_words("\n".join([*before, attempt, *rest]), path)
        word = _placeholder(found.words.of_file(str(path))) if found else None
        if found and word:
            return CursorReading(found, word, rest is not after)
    return None


def is_new(text: str) -> bool:
    """Return whether a file has no content yet, or only keys that a mission has too."""
    keys = re.findall(r"^([A-Za-z_]\w*)[ \t]*:", text, re.MULTILINE)
    return set(keys) <= MISSION.keys()


def _placeholder(words: Iterable[Word]) -> Word | None:
    found = [word for word in words if CURSOR in str(word.node.value)]
    # A bare value can also become a port or key of the section that it stands for.
    return min(found, key=lambda word: word.role is WordRole.DECLARED, default=None)


def _closing(head: str) -> str:
    """Return the brackets that close those left open in the text before the cursor."""
    stack: list[str] = []
    for letter in head:
        if letter in _CLOSING:
            stack.append(_CLOSING[letter])
        elif stack and letter == stack[-1]:
            stack.pop()
    return "".join(reversed(stack))


def _read(path: Path) -> Node | None:
    """Read a file that this one refers to; None if that fails."""
    try:
        return read_file(path)
    except InputError:
        return None
