"""Outline of a mission file: the use of each word, for hover, completion and go-to-definition.

Unlike the reader, the walk accepts files with errors: it skips what it does not recognise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum, auto

from behaviours.catalogue import Catalogue
from missions.language.expressions.value_types import (
    ASSIGNMENTS,
    EXPRESSION,
    ValueType,
    named_type,
    type_of,
)
from missions.language.keys import (
    ANY_KEY,
    ARGUMENT,
    ATTEMPTS,
    BLACKBOARD_KEY,
    CASE,
    DELAY,
    EXPECTATION,
    HOLD,
    INVERT,
    LIMIT,
    MODIFIERS,
    ON_FAILURE_WORDS,
    PARALLEL,
    RECOVER,
    REPEAT,
    RETRY,
    STATUS_WORDS,
    SWITCH,
    THEN_WORDS,
    TIMES,
)
from missions.language.kinds import FOLLOW_WAYPOINTS, NODES
from missions.language.reading.header import LOCALISATION
from missions.language.reading.ports import bare_port
from stack.documents import Node
from stack.parameters import Declaration


class Use(StrEnum):
    """Use of a word in a file."""

    TOP_KEY = auto()
    TREE_KEY = auto()
    EVENT_KEY = auto()
    KIND = auto()
    MODIFIER = auto()
    PORT = auto()
    INPUT = auto()
    OUTPUT = auto()
    VALUE = auto()
    EXPRESSION = auto()
    TARGET = auto()
    KEY = auto()
    TREE = auto()
    TYPE = auto()
    DECLARED = auto()
    PLACE = auto()
    WORLD = auto()
    ROBOT = auto()
    FILE = auto()
    COMPONENT_KIND = auto()
    COMPONENT = auto()
    PARAMETER = auto()
    CASE_KEY = auto()
    SUB_KEY = auto()
    WORD = auto()


@dataclass(frozen=True)
class Scope:
    """Scope of a word: the tree that contains it, and the visible loop variables."""

    tree: str = ""
    variables: tuple[tuple[Node, Node], ...] = ()


@dataclass(frozen=True)
class Item:
    """One word of a file.

    Attributes:
        node: the key or value.
        use: its use.
        scope: its scope.
        owner: the behaviour, tree, component or modifier it belongs to.
        declared: declaration of the port, output or value.
        options: the allowed words.
    """

    node: Node
    use: Use
    scope: Scope = Scope()
    owner: str = ""
    declared: Declaration | None = None
    options: tuple[str, ...] = ()


Signature = tuple[Mapping[str, ValueType], Mapping[str, ValueType]]
"""Types of the inputs and outputs of a tree, by name."""

_SINGLE = {
    "start": Use.PLACE, "initial_pose": Use.PLACE, "world": Use.WORLD, "robot": Use.ROBOT,
    "map": Use.FILE,
}  # fmt: skip
_EXPECTED = tuple(word for word in EXPECTATION if word != ANY_KEY)
_DECLARING = {"arguments": tuple(ARGUMENT), "blackboard": tuple(BLACKBOARD_KEY)}
_SUB_KEYS: dict[str, dict[str, Declaration]] = {
    "retry": {"attempts": ATTEMPTS, "delay": DELAY},
    "recover": {"attempts": ATTEMPTS},
}
_SCALARS = {"timeout": LIMIT, "every": LIMIT, "invert": INVERT}
_KNOWN_SUB_KEYS = {"retry": tuple(RETRY), "recover": tuple(RECOVER)}


def outline(top: Node, catalogue: Catalogue, trees: Mapping[str, Signature]) -> list[Item]:
    """Return every recognised word, in the order of the walk.

    Args:
        top: the file.
        catalogue: the available behaviours.
        trees: signatures of the available trees.
    """
    return list(_Walk(catalogue, trees).top(top))


def item_at(items: list[Item], line: int, column: int) -> Item | None:
    """Return the word at a position, counted from 1; multi-line values match their first line."""
    before = [
        item for item in items
        if item.node.mark.line == line and item.node.mark.column <= column
    ]  # fmt: skip
    return max(before, key=lambda item: item.node.mark.column, default=None)


def signature_of_kind(
    catalogue: Catalogue, word: str
) -> tuple[Mapping[str, Declaration], Mapping[str, Declaration]]:
    """Return the ports and outputs of a node type; empty if it has none."""
    if word in NODES:
        return NODES[word].ports, NODES[word].outputs
    kind = catalogue.get(word)
    return (kind.ports, kind.outputs) if kind else ({}, {})


def signature_of(tree: Node) -> Signature:
    """Return the types of `in` and `out` of a tree."""
    return _types(tree.get("in")), _types(tree.get("out"))


def _types(node: Node | None) -> dict[str, ValueType]:
    entries = node.entries if node else []
    return {str(key.value): type_word(value) for key, value in entries}


def type_word(node: Node | None) -> ValueType:
    """Return the type that a word names; any type if the name is unknown."""
    node = node.get("type") if node and node.is_mapping else node
    found = named_type(node.value) if node and isinstance(node.value, str) else ""
    return ValueType(object) if isinstance(found, str) else found


class _Walk:
    def __init__(self, catalogue: Catalogue, trees: Mapping[str, Signature]) -> None:
        self.catalogue, self.trees = catalogue, trees

    def top(self, top: Node) -> Iterator[Item]:
        for key, value in top.entries:
            yield Item(key, Use.TOP_KEY)
            yield from self._section(str(key.value), value)

    def _section(self, word: str, value: Node) -> Iterator[Item]:
        if word in _SINGLE:
            more = ("start", "unknown") if word == "initial_pose" else ()
            yield Item(value, _SINGLE[word], owner=word, options=more)
        elif word in ("include", "plugins", "parameters"):
            yield from (Item(item, Use.FILE, owner=word) for item in value.items)
        elif word == "run":
            yield from self.node(value, Scope())
        elif word == "trees":
            for key, body in value.entries:
                yield Item(key, Use.DECLARED, owner="trees")
                yield from self._tree(str(key.value), body)
        elif word == "events":
            for _, body in (entry for item in value.items for entry in item.entries):
                yield from self._event(body)
        elif word in ("places", "arguments", "blackboard"):
            yield from self._declarations(word, value)
        elif word in ("navigation", LOCALISATION, "tests"):
            yield from self._cases(value) if word == "tests" else self._components(word, value)

    def _tree(self, name: str, body: Node) -> Iterator[Item]:
        if not body.is_mapping:
            yield Item(body, Use.TREE_KEY)
        for key, value in body.entries:
            yield Item(key, Use.TREE_KEY)
            if key.value in ("in", "out"):
                for declared, kind in value.entries:
                    yield Item(declared, Use.DECLARED, Scope(name), owner=str(key.value))
                    yield Item(kind.get("type") or kind, Use.TYPE)
            elif key.value == "do":
                yield from self.node(value, Scope(name))
            elif key.value == "events":
                for _, event in (entry for item in value.items for entry in item.entries):
                    yield from self._event(event, Scope(name))

    def _event(self, body: Node, scope: Scope = Scope()) -> Iterator[Item]:
        if not body.is_mapping:
            yield Item(body, Use.EVENT_KEY)
        for key, value in body.entries:
            yield Item(key, Use.EVENT_KEY)
            if key.value == "when":
                yield Item(value, Use.EXPRESSION, scope)
            elif key.value in ("hold", "again"):
                yield Item(value, Use.VALUE, scope, declared=HOLD)
            elif key.value == "then":
                yield Item(value, Use.WORD, options=THEN_WORDS)
            elif key.value == "do":
                yield from self.node(value, scope)

    def _declarations(self, word: str, node: Node) -> Iterator[Item]:
        options = _DECLARING.get(word, ())
        for key, value in node.entries:
            yield Item(key, Use.DECLARED, owner=word)
            kind = type_word(value.get("type"))
            if value.kind == "scalar" and options:
                yield Item(value, Use.SUB_KEY, owner=word, options=options)
            for inner, given in value.entries:
                yield Item(inner, Use.SUB_KEY, owner=word, options=options)
                if inner.value == "type":
                    yield Item(given, Use.TYPE)
                elif inner.value in ("default", "initial"):
                    yield from self._value(given, kind.declaration(str(key.value)), Scope())

    def _cases(self, node: Node) -> Iterator[Item]:
        for case in node.items:
            if not case.is_mapping:
                yield Item(case, Use.CASE_KEY, options=tuple(CASE))
            for key, value in case.entries:
                yield Item(key, Use.CASE_KEY, options=tuple(CASE))
                if key.value == "expect":
                    yield from self._expectation(value)
                elif key.value == "mock":
                    yield from (Item(name, Use.KIND) for name, _ in value.entries)

    def _expectation(self, node: Node) -> Iterator[Item]:
        if not node.is_mapping:
            yield Item(node, Use.CASE_KEY, options=_EXPECTED)
        for key, value in node.entries:
            yield Item(key, Use.CASE_KEY, options=_EXPECTED)
            if key.value == "status":
                yield Item(value, Use.WORD, options=STATUS_WORDS)

    def _components(self, word: str, node: Node) -> Iterator[Item]:
        if word == LOCALISATION:
            yield from self._component(word, node)
            return
        if not node.is_mapping:
            yield Item(node, Use.COMPONENT_KIND)
        for key, value in node.entries:
            yield Item(key, Use.COMPONENT_KIND)
            yield from self._component(str(key.value), value)

    def _component(self, kind: str, node: Node) -> Iterator[Item]:
        if not node.is_mapping:
            yield Item(node, Use.COMPONENT, owner=kind)
        use = node.get("use")
        chosen = f"{kind} {use.value if use else ''}".strip()
        for name, given in node.entries:
            yield Item(name, Use.PARAMETER, owner=chosen)
            if name.value == "use":
                yield Item(given, Use.COMPONENT, owner=kind)

    # Nodes

    def node(self, node: Node, scope: Scope) -> Iterator[Item]:
        """Yield the words of a node and its subtree."""
        if node.kind == "scalar":
            yield Item(node, Use.KIND, scope)
        types = [entry for entry in node.entries if str(entry[0].value) not in MODIFIERS]
        known = [entry for entry in types if self._is_type(str(entry[0].value))]
        head = next(iter(known or types), None)
        word = str(head[0].value) if head else ""
        for key, value in node.entries:
            if head and key is head[0]:
                yield Item(key, Use.KIND, scope)
                yield from self._body(word, value, self._inside(word, value, scope))
            else:
                yield Item(key, Use.MODIFIER, scope, owner=word)
                inside = self._inside(word, head[1], scope) if head else scope
                yield from self._modifier(head, key, value, inside)

    def _is_type(self, word: str) -> bool:
        return word in NODES or word in self.catalogue.kinds or "." in word

    def _inside(self, word: str, body: Node, scope: Scope) -> Scope:
        if word == FOLLOW_WAYPOINTS:
            items = body.get("waypoints") or body
            variables = NODES[word].variables
            made = tuple((Node(name, "scalar", body.mark), items) for name in variables)
            return replace(scope, variables=(*made, *scope.variables))
        if word != "for_each" or not body.entries:
            return scope
        return replace(scope, variables=(body.entries[0], *scope.variables))

    def _body(self, word: str, body: Node, scope: Scope) -> Iterator[Item]:
        if word == "use":
            yield Item(body, Use.TREE, scope)
        elif word == "for_each":
            for name, items in body.entries:
                yield Item(name, Use.DECLARED, scope, owner="for_each")
                yield from self._value(items, Declaration(str(name.value), list), scope)
        elif word == "switch":
            yield from self._switch(body, scope)
        elif word == "unset":
            for item in body.items if body.is_sequence else [body]:
                yield Item(item, Use.TARGET, scope)
        elif word in NODES and word != FOLLOW_WAYPOINTS:
            for key, value in body.entries:
                yield Item(key, Use.SUB_KEY, scope, options=tuple(PARALLEL))
                yield from self._children(value, scope)
            yield from self._children(body, scope)
        else:
            yield from self._ports(word, body, scope)

    def _switch(self, body: Node, scope: Scope) -> Iterator[Item]:
        for key, value in body.entries:
            yield Item(key, Use.SUB_KEY, scope, options=tuple(SWITCH))
            if key.value == "value":
                yield Item(value, Use.EXPRESSION, scope)
            elif key.value == "default":
                yield from self.node(value, scope)
            for _, child in value.entries if key.value == "cases" else ():
                yield from self.node(child, scope)

    def _children(self, node: Node, scope: Scope) -> Iterator[Item]:
        for item in node.items:
            yield from self.node(item, scope)

    def _ports(self, word: str, body: Node, scope: Scope) -> Iterator[Item]:
        ports, _ = signature_of_kind(self.catalogue, word)
        bare = bare_port(ports)
        takes_keys = bare is not None and type_of(ports[bare]) == ASSIGNMENTS
        if body.is_mapping and not takes_keys:
            for key, value in body.entries:
                declared = ports.get(str(key.value))
                yield Item(key, Use.PORT, scope, owner=word, declared=declared)
                if declared is not None:
                    yield from self._value(value, declared, scope, word)
        elif bare is not None:
            yield from self._value(body, ports[bare], scope, word)
        else:
            yield Item(body, Use.PORT, scope, owner=word)

    def _value(
        self, node: Node, declared: Declaration, scope: Scope, owner: str = ""
    ) -> Iterator[Item]:
        kind = type_of(declared)
        if kind == ASSIGNMENTS:
            for key, value in node.entries:
                yield Item(key, Use.KEY, scope)
                yield Item(value, Use.EXPRESSION, scope)
        for item in node.items:
            inner = replace(declared, type=(kind.item or kind).annotation)
            yield from self._value(item, inner, scope)
        if node.kind == "scalar" and kind != ASSIGNMENTS:
            use = Use.EXPRESSION if kind == EXPRESSION else Use.VALUE
            yield Item(node, use, scope, owner, declared, declared.one_of)

    def _modifier(
        self, head: tuple[Node, Node] | None, key: Node, value: Node, scope: Scope
    ) -> Iterator[Item]:
        name = str(key.value)
        if name in ("when", "while"):
            yield Item(value, Use.EXPRESSION, scope)
        elif name == "on_failure":
            yield Item(value, Use.WORD, scope, options=ON_FAILURE_WORDS)
        elif name in _SCALARS:
            yield from self._value(value, _SCALARS[name], scope)
        elif name == "repeat":
            yield from self._repeat(value, scope)
        elif name in ("do", "finally"):
            yield from self.node(value, scope)
        elif name in ("with", "out"):
            if head:
                yield from self._passed(head, name, value, scope)
        elif name in _SUB_KEYS:
            yield from self._sub_keys(name, value, scope)

    def _repeat(self, value: Node, scope: Scope) -> Iterator[Item]:
        if not value.is_mapping:
            yield from self._value(value, replace(TIMES, one_of=("forever",)), scope)
        for key, given in value.entries:
            yield Item(key, Use.SUB_KEY, scope, owner="repeat", options=tuple(REPEAT))
            yield Item(given, Use.EXPRESSION, scope)

    def _sub_keys(self, name: str, value: Node, scope: Scope) -> Iterator[Item]:
        known = _KNOWN_SUB_KEYS[name]
        if not value.is_mapping:
            yield from self._value(value, ATTEMPTS, scope)
        for inner, given in value.entries:
            yield Item(inner, Use.SUB_KEY, scope, owner=name, options=known)
            if inner.value in _SUB_KEYS[name]:
                yield from self._value(given, _SUB_KEYS[name][str(inner.value)], scope)
            elif inner.value == "unless":
                yield Item(given, Use.EXPRESSION, scope)
            yield from self._children(given, scope)

    def _passed(
        self, head: tuple[Node, Node], name: str, value: Node, scope: Scope
    ) -> Iterator[Item]:
        """Yield the words under `with` and `out`."""
        word = str(head[0].value)
        tree = str(head[1].value) if word == "use" else ""
        _, results = signature_of_kind(self.catalogue, word)
        if not value.is_mapping:
            use = Use.INPUT if name == "with" else Use.OUTPUT
            yield Item(value, use, scope, owner=tree or word)
        for key, given in value.entries:
            if name == "with":
                types = self.trees.get(tree, ({}, {}))[0]
                declared = types.get(str(key.value), ValueType(object)).declaration(str(key.value))
                yield Item(key, Use.INPUT, scope, owner=tree)
                yield from self._value(given, declared, scope)
            else:
                found = results.get(str(key.value))
                yield Item(key, Use.OUTPUT, scope, owner=tree or word, declared=found)
                yield Item(given, Use.TARGET, scope, declared=found)
