"""Reader of `include`: trees and places of other files.

An included tree sees its own `in` and `out`, and the places and trees of its file and of the files
which that file includes. It sees no names of the mission.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from missions.language.expressions.scope import Scope
from missions.language.keys import TREE_FILE
from missions.language.reading.declarations import DeclarationReader, Layer
from missions.language.step import Tree
from stack.documents import Finding, Mark, Node, Section, read_file
from stack.errors import InputError

BESIDE = "paths are relative to the folder of the file that names them"
MAX_FILES = 50


@dataclass
class TreeFile:
    """Trees and places of one included file.

    Attributes:
        bodies: its own trees: nodes of name and body.
        places: its own places and those of the files it includes.
        trees: its own trees and those of the files it includes; their nodes are read later.
    """

    bodies: list[tuple[Node, Node]]
    places: Layer
    trees: dict[str, Tree]


class IncludeReader:
    """Reads each included file once; reports names that are declared in two files.

    Attributes:
        files: by path, in the order of inclusion.
    """

    def __init__(self, declarations: DeclarationReader) -> None:
        self.declarations, self.findings = declarations, declarations.findings
        self.files: dict[Path, TreeFile] = {}

    def combined(self, node: Node | None, file: Path, above: tuple[Path, ...] = ()) -> TreeFile:
        """Return the combined trees and places of the files under `include`."""
        found, seen = TreeFile([], {}, {}), list[str]()
        items = [] if node is None else node.items
        if node is not None and not node.is_sequence and node.value is not None:
            hint = f"write include: [{node.value}]" if isinstance(node.value, str) else ""
            self._error(node.mark, f"include must be a list of files, got {node.words()}", hint)
        for item in items:
            if not isinstance(item.value, str) or not item.value:
                self._error(item.mark, f"include must be a list of files, got {item.words()}")
            elif item.value in seen:
                self._error(item.mark, f"{item.value} is included twice", "remove one")
            else:
                seen.append(item.value)
                part = self._file(item, file, (*above, file.resolve()))
                self.merge(found.places, part.places if part else {}, "place")
                self.merge_trees(found.trees, part.trees if part else {})
        return found

    def merge(self, into: Layer, layer: Layer, what: str) -> None:
        """Add names; report a name that is already declared, at its second declaration."""
        for name, symbol in layer.items():
            if into.setdefault(name, symbol) is not symbol:
                self._duplicate(what, name, symbol.mark, into[name].mark)

    def merge_trees(self, into: dict[str, Tree], trees: dict[str, Tree]) -> None:
        """As `merge`."""
        for name, tree in trees.items():
            if into.setdefault(name, tree).mark != tree.mark:
                self._duplicate("tree", name, tree.mark, into[name].mark)

    def _file(self, item: Node, file: Path, above: tuple[Path, ...]) -> TreeFile | None:
        path = file.parent / item.value
        key = path.resolve()
        if key in above:
            chain = " > ".join(one.name for one in (*above[above.index(key) :], key))
            self._error(item.mark, f"the file includes itself: {chain}")
            return None
        if key not in self.files:
            if len(self.files) >= MAX_FILES:
                self._error(item.mark, f"more than {MAX_FILES} included files")
                return None
            try:
                top = read_file(path, "file of trees", (*TREE_FILE, "run", "mission"))
            except InputError as error:
                self._add_findings(error.findings, item.mark)
                return None
            self.read(top, path, above)
        return self.files[key]

    def read(self, top: Node, path: Path, above: tuple[Path, ...] = ()) -> TreeFile:
        """Read a file of trees, and the files that it includes."""
        key = path.resolve()
        self.files[key] = TreeFile([], {}, {})
        self.files[key] = self._read(top, path, above)
        return self.files[key]

    def _read(self, top: Node, path: Path, above: tuple[Path, ...]) -> TreeFile:
        self.declarations.words.top(top, "tree file", TREE_FILE)
        section = Section(top, self.findings, "an included file", "E101", [*TREE_FILE])
        for word in ("doc", "format"):
            section.node_of(word)
        found = self.combined(section.node_of("include"), path, above)
        own = self.declarations.places(section.node_of("places"), {}, top.mark)
        self.merge(found.places, own, "place")
        bodies = tree_entries(section.node_of("trees"))
        scope = Scope((found.places,))
        trees = {str(key.value): self.declarations.tree(key, body, scope) for key, body in bodies}
        self.merge_trees(found.trees, trees)
        section.done()
        return TreeFile(bodies, found.places, found.trees)

    def _add_findings(self, findings: Iterable[Finding], mark: Mark) -> None:
        for item in findings:
            if item.code == "E001":
                self._error(mark, f"{item.mark.file}: {item.sentence}", item.hint or BESIDE)
            else:
                self.findings.items.append(item)

    def _duplicate(self, what: str, name: str, mark: Mark, other: Mark) -> None:
        sentence = (
            f"the {what} {name!r} is already declared in {Path(other.file).name}:{other.line}"
        )
        self.findings.add("E114", mark, sentence, "rename one of them")

    def _error(self, mark: Mark, sentence: str, hint: str = "") -> None:
        self.findings.add("E113", mark, sentence, hint)


def tree_entries(node: Node | None) -> list[tuple[Node, Node]]:
    """Return names and bodies under `trees`; also of a list of mappings, which is reported."""
    if node is not None and node.is_sequence:
        return [entry for item in node.items for entry in item.entries]
    return node.entries if node else []
