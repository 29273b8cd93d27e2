"""Reader of the bodies of trees, and of files of trees that no mission includes here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from behaviours.catalogue import Catalogue
from missions.language.analysis.data_flow import check_recursion
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Scope
from missions.language.keys import TREE_FILE
from missions.language.reading.declarations import DeclarationReader
from missions.language.reading.events import EventReader
from missions.language.reading.include import IncludeReader
from missions.language.reading.nodes import NodeReader
from missions.language.reading.values import ValueReader
from missions.language.reading.words import Draft
from missions.language.step import Tree
from stack.documents import Finding, Findings, Node, read_document


def read_bodies(
    entries: Iterable[tuple[Node, Node]], reader: NodeReader, scope: Scope, trees: dict[str, Tree]
) -> None:
    """Read the nodes of trees, given by name and body, into `trees`."""
    for key, node in entries:
        tree, body = trees[str(key.value)], node.get("do")
        if body is None or tree.mark != key.mark:
            continue
        layer = {**tree.inputs, **tree.outputs}
        # whether `error` and `attempt` are defined depends on where the tree is used
        context = NameContext(scope.inside(layer), True, True)
        events = EventReader(reader).events(node.get("events"), context)
        trees[tree.name] = replace(tree, root=reader.read(body, context), events=events)


def read_trees(path: Path, catalogue: Catalogue, draft: Draft | None = None) -> tuple[Finding, ...]:
    """Read a file of trees as if a mission included it; return its findings.

    Behaviours may come from the plugins of the mission, so an unknown one is a warning, unless its
    name resembles a known one or is a word of another tool.

    Raises:
        InputError: the file cannot be read, or is not YAML.
    """
    draft = draft or Draft()
    top = read_document(path, "file of trees", draft.text, tuple(TREE_FILE))
    findings = Findings()
    words = draft.words
    values = ValueReader(findings, words)
    includes = IncludeReader(DeclarationReader(values))
    own = includes.read(top, path)
    trees = dict(own.trees)
    words.catalogue, words.trees, words.scope = catalogue, trees, Scope((own.places,))
    for file in includes.files.values():
        reader = NodeReader(values, catalogue, file.trees, has_other_plugins=True)
        read_bodies(file.bodies, reader, Scope((file.places,)), trees)
    if not findings.errors:
        check_recursion(trees, (), findings)
    return tuple(findings.items)
