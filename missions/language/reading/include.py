"""`include`: other files' trees and places.

Such a tree sees its own `in` and `out`, and the places and trees of its file and of what that file
includes; nothing of the mission.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from missions.language.expressions.scope import Scope
from missions.language.model import Tree
from missions.language.reading.declarations import DeclarationReader, Layer
from stack.documents import Finding, Mark, Node, Section, read_file
from stack.errors import InputError

MAX_FILES = 50
FILE_KEYS = ("include", "format", "doc", "places", "trees")


@dataclass
class TreeFile:
    """What one file gives to those who include it.

    Attributes:
        bodies: its own trees, name and body as they stand there.
        places: its own, and those of the files it includes.
        trees: its own, and those of the files it includes; their nodes are read later.
    """

    bodies: list[tuple[Node, Node]]
    places: Layer
    trees: dict[str, Tree]


class IncludeReader:
    """Reads included files, each once, and reports names that stand in two of them.

    Attributes:
        files: by path, those that are included first.
    """

    def __init__(self, declarations: DeclarationReader) -> None:
        self.declarations, self.findings = declarations, declarations.findings
        self.files: dict[Path, TreeFile] = {}

    def together(self, node: Node | None, file: Path, above: tuple[Path, ...] = ()) -> TreeFile:
        """What the files named under `include` give together."""
        found, seen = TreeFile([], {}, {}), list[str]()
        items = [] if node is None else node.items
        if node is not None and not node.is_sequence and node.value is not None:
            self._wrong(node.mark, f"include is a list of files, got {node.words()}")
        for item in items:
            if not isinstance(item.value, str) or not item.value:
                self._wrong(item.mark, f"include is a list of files, got {item.words()}")
            elif item.value in seen:
                self._wrong(item.mark, f"{item.value} is included twice", "leave one out")
            else:
                seen.append(item.value)
                part = self._file(item, file, (*above, file.resolve()))
                self.merge(found.places, part.places if part else {}, "place")
                self.merge_trees(found.trees, part.trees if part else {})
        return found

    def merge(self, into: Layer, layer: Layer, what: str) -> None:
        """Add names; one that is there already is reported where it stands the second time."""
        for name, symbol in layer.items():
            if into.setdefault(name, symbol) is not symbol:
                self._twice(what, name, symbol.mark, into[name].mark)

    def merge_trees(self, into: dict[str, Tree], trees: dict[str, Tree]) -> None:
        """As `merge`."""
        for name, tree in trees.items():
            if into.setdefault(name, tree).mark != tree.mark:
                self._twice("tree", name, tree.mark, into[name].mark)

    def _file(self, item: Node, file: Path, above: tuple[Path, ...]) -> TreeFile | None:
        path = file.parent / item.value
        key = path.resolve()
        if key in above:
            chain = " > ".join(one.name for one in (*above[above.index(key) :], key))
            self._wrong(item.mark, f"the file includes itself: {chain}")
            return None
        if key not in self.files:
            if len(self.files) >= MAX_FILES:
                self._wrong(item.mark, f"more than {MAX_FILES} files")
                return None
            try:
                top = read_file(path, "file of trees")
            except InputError as error:
                self._pass_on(error.findings, item.mark)
                return None
            self.files[key] = TreeFile([], {}, {})
            self.files[key] = self._read(top, path, above)
        return self.files[key]

    def _read(self, top: Node, path: Path, above: tuple[Path, ...]) -> TreeFile:
        section = Section(top, self.findings, "an included file", "E101", FILE_KEYS)
        for word in ("doc", "format"):
            section.node_of(word)
        found = self.together(section.node_of("include"), path, above)
        own = self.declarations.places(section.node_of("places"), {}, top.mark)
        self.merge(found.places, own, "place")
        bodies = tree_entries(section.node_of("trees"))
        scope = Scope((found.places,))
        trees = {str(key.value): self.declarations.tree(key, body, scope) for key, body in bodies}
        self.merge_trees(found.trees, trees)
        section.done()
        return TreeFile(bodies, found.places, found.trees)

    def _pass_on(self, findings: Iterable[Finding], mark: Mark) -> None:
        for item in findings:
            if item.code == "E001":
                self._wrong(mark, f"{item.mark.file}: {item.sentence}", item.hint)
            else:
                self.findings.items.append(item)

    def _twice(self, what: str, name: str, mark: Mark, other: Mark) -> None:
        sentence = f"there is a {what} {name!r} in {Path(other.file).name}:{other.line} already"
        self.findings.error("E114", mark, sentence, "rename one of them")

    def _wrong(self, mark: Mark, sentence: str, hint: str = "") -> None:
        self.findings.error("E113", mark, sentence, hint)


def tree_entries(node: Node | None) -> list[tuple[Node, Node]]:
    """Names and bodies under `trees`."""
    return node.entries if node else []
