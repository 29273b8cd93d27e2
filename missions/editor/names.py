"""Names for `$name` and `use` in a file, valid or not, with the position of each declaration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from missions.editor.outline import Scope, Signature, signature_of, type_word
from missions.execution.resources import WORLDS
from missions.language.expressions.value_types import ANYTHING, POSE, ValueType
from missions.language.reading.item_types import item_type
from missions.language.reading.port_expressions import reference_name, text_of
from robots.load import find_robot
from stack.documents import Mark, Node, read_file
from stack.errors import InputError
from stack.sim.worlds.world_file import find_world

MAX_FILES = 50


@dataclass(frozen=True)
class Name:
    """A declared name.

    Attributes:
        role: kind of the name, as text.
        text: its value as written in the file.
        mark: position of the declaration.
    """

    name: str
    role: str
    type: ValueType
    text: str
    mark: Mark


@dataclass(frozen=True)
class TreeName:
    """A tree that `use` can name."""

    name: str
    signature: Signature
    doc: str
    mark: Mark


class Names:
    """The names declared in a file and in the files it refers to."""

    def __init__(self, top: Node, path: Path) -> None:
        self.top, self.path = top, path
        self._files = list(_included(top, path))
        self.trees = {tree.name: tree for tree in self._trees()}
        self.places = {place.name: place for place in self._places()}
        self._inner = {**self._declared("arguments", "argument"),
                       **self._declared("blackboard", "blackboard key")}  # fmt: skip

    def known(self, scope: Scope) -> dict[str, Name]:
        """Return the names visible in a scope."""
        signature: dict[str, Name] = {}
        body = (self.top.get("trees") or _EMPTY).get(scope.tree)
        for word in ("in", "out"):
            for key, given in ((body.get(word) if body else None) or _EMPTY).entries:
                name = str(key.value)
                role = f"`{word}` of the tree {scope.tree}"
                signature[name] = Name(name, role, type_word(given), text_of(given), key.mark)
        outer = {**self._inner, **self.places, **signature}
        for key, items in reversed(scope.variables):
            name = str(key.value)
            kind = _item_type(items, outer)
            outer[name] = Name(name, "loop variable", kind, f"of {text_of(items)}", key.mark)
        return outer

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

    def _trees(self) -> Iterator[TreeName]:
        for _, top in reversed(self._files):
            for key, body in (top.get("trees") or _EMPTY).entries:
                doc = body.get("doc")
                text = str(doc.value) if doc else ""
                yield TreeName(str(key.value), signature_of(body), text, key.mark)

    def _places(self) -> Iterator[Name]:
        world = self.top.get("world")
        file = self.file_of("world", str(world.value)) if world else None
        of_world = _read(file) if file else None
        tops = [*([of_world] if of_world else []), *(top for _, top in reversed(self._files))]
        for top in tops:
            role = "place of the world" if top is of_world else "place"
            for key, pose in (top.get("places") or _EMPTY).entries:
                name = str(key.value)
                yield Name(name, role, POSE, text_of(pose), key.mark)

    def _declared(self, section: str, role: str) -> dict[str, Name]:
        found = {}
        for key, body in (self.top.get(section) or _EMPTY).entries:
            name = str(key.value)
            found[name] = Name(name, role, type_word(body.get("type")), text_of(body), key.mark)
        return found


_EMPTY = Node([], "mapping", Mark(""))


def _item_type(items: Node, outer: dict[str, Name]) -> ValueType:
    name = reference_name(items)
    known = outer.get(name) if name else None
    if name is None and items.is_sequence:
        found = item_type(items.items, lambda item: _type_of_reference(item, outer))
        return found if isinstance(found, ValueType) else ANYTHING
    return (known.type.item if known else None) or ANYTHING


def _type_of_reference(item: Node, outer: dict[str, Name]) -> ValueType | None:
    name = reference_name(item)
    if name is None:
        return None
    return outer[name].type if name in outer else ANYTHING


def _included(top: Node, path: Path) -> Iterator[tuple[Path, Node]]:
    """Yield the file, then the files it includes, each once."""
    waiting, seen = [(path, top)], {path.resolve()}
    while waiting and len(seen) <= MAX_FILES:
        file, node = waiting.pop(0)
        yield file, node
        for item in (node.get("include") or _EMPTY).items:
            below = file.parent / str(item.value)
            inner = None if below.resolve() in seen else _read(below)
            if inner is not None:
                seen.add(below.resolve())
                waiting.append((below, inner))


def _read(path: Path) -> Node | None:
    """Read a file that this one refers to; None if that fails."""
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        return None
    return _read_once(path, changed)


@lru_cache(maxsize=64)
def _read_once(path: Path, changed: int) -> Node | None:
    """Read a file once per modification time: worlds are long and needed at every keystroke."""
    try:
        return read_file(path)
    except InputError:
        return None
