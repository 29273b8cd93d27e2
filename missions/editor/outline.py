"""What each word of a mission file is there for: what hover, completion and go-to-definition ask.

The reader refuses a faulty file; this walk takes any, names the words it understands and passes
over the rest.
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
from missions.language.reading.cases import CASE_KEYS, EXPECT_KEYS
from missions.language.reading.events import HOLD, THEN
from missions.language.reading.modifiers import ATTEMPTS, DELAY, LIMIT, MODIFIERS, TIMES
from missions.language.reading.nodes import COMPOSITES
from missions.language.reading.ports import bare_port
from missions.language.reading.waypoints import FOLLOW_WAYPOINTS, OUTPUTS, VARIABLES, WAYPOINT_PORTS
from stack.documents import Node
from stack.parameters import Declaration


class Use(StrEnum):
    """What a word is there for."""

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
class Around:
    """Where a word stands: the tree it is in, and the loop variables around it."""

    tree: str = ""
    variables: tuple[tuple[Node, Node], ...] = ()


@dataclass(frozen=True)
class Item:
    """One word of a file.

    Attributes:
        node: the key or value as it stands there.
        owner: the behaviour, tree, component or modifier it belongs to.
        declared: what may stand there, of a value; of a port or output itself.
        options: the words that may stand there.
    """

    node: Node
    use: Use
    around: Around = Around()
    owner: str = ""
    declared: Declaration | None = None
    options: tuple[str, ...] = ()


Signature = tuple[Mapping[str, ValueType], Mapping[str, ValueType]]
"""What goes into a tree and what comes out, by name."""

_SINGLE = {
    "start": Use.PLACE, "initial_pose": Use.PLACE, "world": Use.WORLD, "robot": Use.ROBOT,
    "map": Use.FILE,
}  # fmt: skip
_EXPECTED = tuple(word for word in EXPECT_KEYS if not word.startswith("$"))
_DECLARING: dict[str, tuple[str, ...]] = {
    "arguments": ("type", "default", "range", "one_of", "unit", "doc"),
    "blackboard": ("type", "initial", "optional", "unit", "doc"),
}
_SUB_KEYS: dict[str, dict[str, Declaration]] = {
    "retry": {"attempts": ATTEMPTS, "delay": DELAY},
    "recover": {"attempts": ATTEMPTS},
}


def outline(top: Node, catalogue: Catalogue, trees: Mapping[str, Signature]) -> list[Item]:
    """Every word that is understood, in the order of the walk.

    Args:
        top: the file.
        catalogue: the behaviours that it may name.
        trees: signatures of the trees it may use.
    """
    return list(_Walk(catalogue, trees).top(top))


def item_at(items: list[Item], line: int, column: int) -> Item | None:
    """The word at a position; both count from 1. Values of many lines have their first."""
    before = [
        item for item in items
        if item.node.mark.line == line and item.node.mark.column <= column
    ]  # fmt: skip
    return max(before, key=lambda item: item.node.mark.column, default=None)


def signature_of_kind(
    catalogue: Catalogue, word: str
) -> tuple[Mapping[str, Declaration], Mapping[str, Declaration]]:
    """Ports and outputs of what a node's word names; none of what has no such things."""
    if word == FOLLOW_WAYPOINTS:
        return WAYPOINT_PORTS, OUTPUTS
    kind = None if word in COMPOSITES else catalogue.get(word)
    return (kind.ports, kind.outputs) if kind else ({}, {})


def signature_of(tree: Node) -> Signature:
    """`in` and `out` of the body of a tree."""
    return _types(tree.get("in")), _types(tree.get("out"))


def _types(node: Node | None) -> dict[str, ValueType]:
    entries = node.entries if node else []
    return {str(key.value): type_word(value) for key, value in entries}


def type_word(node: Node | None) -> ValueType:
    """The type that a word names; anything when there is none of that name."""
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
            yield from self.node(value, Around())
        elif word == "trees":
            for key, body in value.entries:
                yield Item(key, Use.DECLARED, owner="trees")
                yield from self._tree(str(key.value), body)
        elif word == "events":
            for _, body in (entry for item in value.items for entry in item.entries):
                yield from self._event(body)
        elif word in ("places", "arguments", "blackboard"):
            yield from self._declarations(word, value)
        elif word in ("navigation", "tests"):
            yield from self._navigation(value) if word == "navigation" else self._cases(value)

    def _tree(self, name: str, body: Node) -> Iterator[Item]:
        if not body.is_mapping:
            yield Item(body, Use.TREE_KEY)
        for key, value in body.entries:
            yield Item(key, Use.TREE_KEY)
            if key.value in ("in", "out"):
                for declared, kind in value.entries:
                    yield Item(declared, Use.DECLARED, Around(name), owner=str(key.value))
                    yield Item(kind.get("type") or kind, Use.TYPE)
            elif key.value == "do":
                yield from self.node(value, Around(name))

    def _event(self, body: Node) -> Iterator[Item]:
        if not body.is_mapping:
            yield Item(body, Use.EVENT_KEY)
        for key, value in body.entries:
            yield Item(key, Use.EVENT_KEY)
            if key.value == "when":
                yield Item(value, Use.EXPRESSION)
            elif key.value == "hold":
                yield Item(value, Use.VALUE, declared=HOLD)
            elif key.value == "then":
                yield Item(value, Use.WORD, options=THEN)
            elif key.value == "do":
                yield from self.node(value, Around())

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
                    yield from self._value(given, kind.declaration(str(key.value)), Around())

    def _cases(self, node: Node) -> Iterator[Item]:
        for case in node.items:
            if not case.is_mapping:
                yield Item(case, Use.CASE_KEY, options=tuple(CASE_KEYS))
            for key, value in case.entries:
                yield Item(key, Use.CASE_KEY, options=tuple(CASE_KEYS))
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
                yield Item(value, Use.WORD, options=("success", "failure", "running"))

    def _navigation(self, node: Node) -> Iterator[Item]:
        if not node.is_mapping:
            yield Item(node, Use.COMPONENT_KIND)
        for key, value in node.entries:
            kind = str(key.value)
            yield Item(key, Use.COMPONENT_KIND)
            if not value.is_mapping:
                yield Item(value, Use.COMPONENT, owner=kind)
            use = value.get("use")
            chosen = f"{kind} {use.value if use else ''}".strip()
            for name, given in value.entries:
                yield Item(name, Use.PARAMETER, owner=chosen)
                if name.value == "use":
                    yield Item(given, Use.COMPONENT, owner=kind)

    # Nodes

    def node(self, node: Node, around: Around) -> Iterator[Item]:
        """The words of a node and of everything below it."""
        if node.kind == "scalar":
            yield Item(node, Use.KIND, around)
        types = [entry for entry in node.entries if str(entry[0].value) not in MODIFIERS]
        known = [entry for entry in types if self._is_type(str(entry[0].value))]
        head = next(iter(known or types), None)
        word = str(head[0].value) if head else ""
        for key, value in node.entries:
            if head and key is head[0]:
                yield Item(key, Use.KIND, around)
                yield from self._body(word, value, self._inside(word, value, around))
            else:
                yield Item(key, Use.MODIFIER, around, owner=word)
                inside = self._inside(word, head[1], around) if head else around
                yield from self._modifier(head, key, value, inside)

    def _is_type(self, word: str) -> bool:
        return word in COMPOSITES or word in self.catalogue.kinds or "." in word

    def _inside(self, word: str, body: Node, around: Around) -> Around:
        if word == FOLLOW_WAYPOINTS:
            items = body.get("waypoints") or body
            made = tuple((Node(name, "scalar", body.mark), items) for name in VARIABLES)
            return replace(around, variables=(*made, *around.variables))
        if word != "for_each" or not body.entries:
            return around
        return replace(around, variables=(body.entries[0], *around.variables))

    def _body(self, word: str, body: Node, around: Around) -> Iterator[Item]:
        if word == "use":
            yield Item(body, Use.TREE, around)
        elif word == "for_each":
            for name, items in body.entries:
                yield Item(name, Use.DECLARED, around, owner="for_each")
                yield from self._value(items, Declaration(str(name.value), list), around)
        elif word in COMPOSITES and word != FOLLOW_WAYPOINTS:
            for key, value in body.entries:
                yield Item(key, Use.SUB_KEY, around, options=("succeed_on", "do"))
                yield from self._children(value, around)
            yield from self._children(body, around)
        else:
            yield from self._ports(word, body, around)

    def _children(self, node: Node, around: Around) -> Iterator[Item]:
        for item in node.items:
            yield from self.node(item, around)

    def _ports(self, word: str, body: Node, around: Around) -> Iterator[Item]:
        ports, _ = signature_of_kind(self.catalogue, word)
        bare = bare_port(ports)
        takes_keys = bare is not None and type_of(ports[bare]) == ASSIGNMENTS
        if body.is_mapping and not takes_keys:
            for key, value in body.entries:
                declared = ports.get(str(key.value))
                yield Item(key, Use.PORT, around, owner=word, declared=declared)
                if declared is not None:
                    yield from self._value(value, declared, around, word)
        elif bare is not None:
            yield from self._value(body, ports[bare], around, word)
        else:
            yield Item(body, Use.PORT, around, owner=word)

    def _value(
        self, node: Node, declared: Declaration, around: Around, owner: str = ""
    ) -> Iterator[Item]:
        kind = type_of(declared)
        if kind == ASSIGNMENTS:
            for key, value in node.entries:
                yield Item(key, Use.KEY, around)
                yield Item(value, Use.EXPRESSION, around)
        for item in node.items:
            inner = replace(declared, type=(kind.item or kind).annotation)
            yield from self._value(item, inner, around)
        if node.kind == "scalar" and kind != ASSIGNMENTS:
            use = Use.EXPRESSION if kind == EXPRESSION else Use.VALUE
            yield Item(node, use, around, owner, declared, declared.one_of)

    def _modifier(
        self, head: tuple[Node, Node] | None, key: Node, value: Node, around: Around
    ) -> Iterator[Item]:
        name = str(key.value)
        if name in ("when", "while"):
            yield Item(value, Use.EXPRESSION, around)
        elif name == "on_failure":
            yield Item(value, Use.WORD, around, options=("continue", "fail"))
        elif name in ("timeout", "every"):
            yield from self._value(value, LIMIT, around)
        elif name == "repeat":
            yield from self._value(value, replace(TIMES, one_of=("forever",)), around)
        elif name == "do":
            yield from self.node(value, around)
        elif name in ("with", "out"):
            if head:
                yield from self._passed(head, name, value, around)
        elif name in _SUB_KEYS:
            yield from self._sub_keys(name, value, around)

    def _sub_keys(self, name: str, value: Node, around: Around) -> Iterator[Item]:
        known = (*_SUB_KEYS[name], *(("unless", "round_robin") if name == "recover" else ()))
        if not value.is_mapping:
            yield from self._value(value, ATTEMPTS, around)
        for inner, given in value.entries:
            yield Item(inner, Use.SUB_KEY, around, owner=name, options=known)
            if inner.value in _SUB_KEYS[name]:
                yield from self._value(given, _SUB_KEYS[name][str(inner.value)], around)
            elif inner.value == "unless":
                yield Item(given, Use.EXPRESSION, around)
            yield from self._children(given, around)

    def _passed(
        self, head: tuple[Node, Node], name: str, value: Node, around: Around
    ) -> Iterator[Item]:
        """What stands under `with` and `out`."""
        word = str(head[0].value)
        tree = str(head[1].value) if word == "use" else ""
        _, results = signature_of_kind(self.catalogue, word)
        if not value.is_mapping:
            use = Use.INPUT if name == "with" else Use.OUTPUT
            yield Item(value, use, around, owner=tree or word)
        for key, given in value.entries:
            if name == "with":
                types = self.trees.get(tree, ({}, {}))[0]
                declared = types.get(str(key.value), ValueType(object)).declaration(str(key.value))
                yield Item(key, Use.INPUT, around, owner=tree)
                yield from self._value(given, declared, around)
            else:
                found = results.get(str(key.value))
                yield Item(key, Use.OUTPUT, around, owner=tree or word, declared=found)
                yield Item(given, Use.TARGET, around, declared=found)
