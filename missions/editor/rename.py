"""Rename of places, trees and keys: every use, also in the files that a mission includes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from missions.editor.document import Reading, read_words
from missions.language.expressions.scope import Symbol
from missions.language.keys import EXPECTATION
from missions.language.reading.literals import IDENTIFIER
from missions.language.reading.words import Word, WordRole
from missions.language.step import Tree
from stack.documents import Mark
from stack.errors import InputError

MAX_FILES = 200
"""Files of a folder that are searched for uses."""

_PLAIN = (WordRole.PLACE, WordRole.KEY, WordRole.ARGUMENT, WordRole.EXPECTATION)
"""Words that name a place or key without a `$`."""


@dataclass(frozen=True)
class Use:
    """One use of a name: the position of its first letter, without the `$`."""

    mark: Mark
    length: int


def renamed(reading: Reading, word: Word, text: str) -> Symbol | Tree | None:
    """Return the name under the cursor, if it can be renamed.

    Args:
        reading: the file.
        word: the key or value at the position.
        text: the part of it at the position.
    """
    value, trees = str(word.node.value), reading.words.trees
    if text.startswith("$"):
        return reading.scope(word).lookup(text[1:].partition(".")[0])
    if word.role in (WordRole.TREE, WordRole.NODE_NAME):
        return trees.get(value)
    if word.role in (WordRole.INPUT, WordRole.OUTPUT):
        tree = trees.get(word.owner)
        return {**tree.inputs, **tree.outputs}.get(value) if tree else None
    if word.role is WordRole.DECLARED:
        declared = (symbol for symbol in _all_symbols(reading) if symbol.mark == word.node.mark)
        return trees.get(value) if word.owner == "trees" else next(declared, None)
    if word.role not in _PLAIN or (word.role is WordRole.EXPECTATION and value in EXPECTATION):
        return None
    return reading.scope(word).lookup(value)


def renamed_uses(
    reading: Reading, name: Symbol | Tree, new: str, texts: Mapping[Path, str]
) -> list[Use]:
    """Return every use of a name and its declaration, in a file and in those that it includes.

    Args:
        reading: the file.
        name: the name, as another reading may know it.
        new: its new name.
        texts: the files that are open in the editor, by resolved path.

    Raises:
        InputError: the new name is invalid or collides with another, or an included file has
            unsaved changes.
    """
    wanted = _own(reading, name)
    if wanted is None:
        return []
    check_new_name(reading, wanted, new)
    sources: dict[str, Sequence[str]] = {}
    found: dict[tuple[str, int, int], Use] = {}
    for word in reading.words.items:
        file = word.node.mark.file
        if file not in sources:
            sources[file] = _lines(reading, Path(file), texts)
        for use in _in_word(reading, word, wanted, sources):
            found[file, use.mark.line, use.mark.column] = use
    changed = {file for file, _, _ in found}
    for file in changed - {str(reading.path)}:
        shown = texts.get(Path(file).resolve())
        if shown is not None and shown.splitlines() != _saved(Path(file)):
            raise InputError(f"{Path(file).name} has unsaved changes; save it first")
    return [found[key] for key in sorted(found)]


def users_of(file: Path, reading: Reading, texts: Mapping[Path, str]) -> Iterator[Reading]:
    """Yield the files of the folder that include a file, other than the one being edited."""
    here = reading.path.resolve()
    for path in sorted(file.parent.glob("*.yaml"))[:MAX_FILES]:
        if path.resolve() in (here, file.resolve()):
            continue
        text = texts.get(path.resolve()) or "\n".join(_saved(path))
        if file.name in text and "include" in text:
            found = read_words(text, path)
            if found is not None:
                yield found


def _lines(reading: Reading, file: Path, texts: Mapping[Path, str]) -> Sequence[str]:
    """Return the lines that a reading has read: those of the editor, or of the saved file."""
    if file == reading.path and file.resolve() in texts:
        return texts[file.resolve()].splitlines()
    return _saved(file)


def _saved(file: Path) -> list[str]:
    try:
        return file.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return []


def _own(reading: Reading, name: Symbol | Tree) -> Symbol | Tree | None:
    """Return a reading's own record of a name that another one has read."""
    place = _place(name.mark)
    if isinstance(name, Tree):
        tree = reading.words.trees.get(name.name)
        return tree if tree is not None and _place(tree.mark) == place else None
    known = _all_symbols(reading)
    return next((one for one in known if one is name or (
        one.name == name.name and _place(one.mark) == place)), None)  # fmt: skip


def _place(mark: Mark) -> tuple[Path, int, int]:
    return Path(mark.file).resolve(), mark.line, mark.column


def check_new_name(reading: Reading, wanted: Symbol | Tree, name: str) -> None:
    """Raise InputError for a name that is invalid or would collide with another one."""
    if isinstance(wanted, Symbol) and reading.is_of_world(wanted):
        raise InputError(f"{wanted.name!r} is a place of the world; rename it in the world file")
    if not IDENTIFIER.fullmatch(name):
        hint = "use letters, digits and _; start with a letter"
        raise InputError(f"{name!r} is not a valid name; {hint}")
    if isinstance(wanted, Tree):
        if name in reading.words.trees:
            raise InputError(f"there is already a tree {name!r}")
        return
    for other in _all_symbols(reading):
        if other.name == name and other is not wanted:  # a hidden name would mean another thing
            raise InputError(
                f"{name!r} is already the name of a {other.role} "
                f"({Path(other.mark.file).name}:{other.mark.line})"
            )


def _all_symbols(reading: Reading) -> Iterator[Symbol]:
    """Yield every declared name of the file and of the included ones."""
    yield from reading.words.scope.symbols()
    for tree in reading.words.trees.values():
        yield from (*tree.inputs.values(), *tree.outputs.values())
    layers = {id(layer): layer for word in reading.words.items if word.scope
              for layer in word.scope.layers}  # fmt: skip
    for layer in layers.values():
        yield from layer.values()


def _in_word(
    reading: Reading, word: Word, wanted: Symbol | Tree, sources: Mapping[str, Sequence[str]]
) -> Iterator[Use]:
    if word.node.kind != "scalar":
        return
    if word.role in (WordRole.VALUE, WordRole.EXPRESSION, WordRole.TARGET):
        if reading.scope(word).lookup(wanted.name) is wanted:
            yield from _references(word, wanted.name, sources)
    elif word.role is WordRole.DECLARED:
        if word.node.mark == wanted.mark:
            yield _whole(word, sources)
    elif renamed(reading, word, str(word.node.value)) is wanted:
        yield _whole(word, sources)


def _whole(word: Word, sources: Mapping[str, Sequence[str]]) -> Use:
    """Return the use that is a whole word, without its quote and `$`."""
    mark, value = word.node.mark, str(word.node.value)
    line = sources.get(mark.file, [])[mark.line - 1 : mark.line]
    skipped = len(value) - len(value.lstrip("$"))
    if line and line[0][mark.column - 1 : mark.column] in ("'", '"'):
        skipped += 1
    moved = Mark(mark.file, mark.line, mark.column + skipped)
    return Use(moved, len(value.lstrip("$")))


def _references(word: Word, name: str, sources: Mapping[str, Sequence[str]]) -> Iterator[Use]:
    """Yield the `$name` and `${name}` of a value, which may have several lines."""
    mark, value = word.node.mark, str(word.node.value)
    wanted = len(list(_offsets(word, value, name)))
    lines = sources.get(mark.file, [])
    pattern = re.compile(rf"(?<!\$)\$(?:\{{\s*)?({re.escape(name)})\b")
    for number in range(mark.line, len(lines) + 1):
        start = mark.column - 1 if number == mark.line else 0
        for found in pattern.finditer(lines[number - 1], start):
            if wanted == 0:
                return
            yield Use(Mark(mark.file, number, found.start(1) + 1), len(name))
            wanted -= 1


def _offsets(word: Word, value: str, name: str) -> Iterator[int]:
    """Yield the offsets of a name in a value; texts are no uses of it."""
    dollar = re.compile(rf"\${re.escape(name)}\b")
    if word.role is WordRole.EXPRESSION:
        plain = re.sub(r"'[^']*'|\"[^\"]*\"", lambda text: " " * len(text[0]), value)
        yield from (found.start() for found in dollar.finditer(plain))
    elif value == f"${name}" and not word.node.quoted:
        yield 0
    else:
        for piece in re.finditer(r"(?<!\$)\$\{([^}]*)\}", value):
            if piece[1].strip() == name:
                yield piece.start()
            yield from (found.start() for found in dollar.finditer(piece[1]))
