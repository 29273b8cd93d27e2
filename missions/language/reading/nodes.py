"""The nodes of a mission file, read: `{navigate_to_pose: {goal: $dock}, timeout: 90 s}`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from behaviours.catalogue import BehaviourKind
from missions.language.expressions.expression import Surroundings
from missions.language.expressions.scope import UNSET, Role, Symbol
from missions.language.expressions.terms import shown
from missions.language.expressions.texts import formatter
from missions.language.expressions.value_types import (
    ANYTHING,
    ValueType,
    type_of,
)
from missions.language.model import (
    Catalogue,
    Composite,
    Constant,
    ForEach,
    Leaf,
    Step,
    Tree,
    Use,
    Value,
)
from missions.language.reading.modifiers import LOOPS, MODIFIERS, Beside, ModifierReader
from missions.language.reading.ports import Owner, PortReader
from missions.language.reading.values import IDENTIFIER, ValueReader
from missions.language.reading.waypoints import (
    FOLLOW_WAYPOINTS,
    WAYPOINT_OUTPUTS,
    WAYPOINT_PORTS,
    following,
    waypoint_symbols,
)
from stack.documents import Findings, Mark, Node
from stack.parameters import REQUIRED, Declaration, suggestion
from stack.types import Pose2D

COMPOSITES: dict[str, str] = {
    "sequence": "children in turn until one fails; remembers where it was",
    "reactive": "as `sequence`, but looks at the children from the top on every tick",
    "fallback": "children in turn until one succeeds; remembers where it was",
    "reactive_fallback": "as `fallback`, but looks at the children from the top on every tick",
    "parallel": "all children at once; `{succeed_on: all | one | N, do: […]}` or a list",
    "round_robin": "one child per run, the next one each time; tries the others when it fails",
    "for_each": "`do` once per item: `{for_each: {shelf: $shelves}, do: …}`; with "
    "`on_failure: continue` an item that fails is passed over",
    "follow_waypoints": "drives to poses in turn and does `do`, if it is there, at each; "
    "with `on_failure: continue` a waypoint that fails is missed and the next one follows",
    "use": "a tree of this file: `{use: inspect, with: {…}, out: {…}}`",
}
"""Words that may stand where a behaviour's name does, and what they do."""

_ONLY_FOR = {"with": ("use",), "do": LOOPS}
_WITH_OUTPUTS = ("use", FOLLOW_WAYPOINTS)
_HAS_ERROR = ("fallback", "reactive_fallback", "round_robin")
_PATIENCE = Declaration("succeed_on", int, at_least=1)


class NodeReader:
    """Reads nodes of one file against what is installed and what its trees declare."""

    def __init__(
        self, values: ValueReader, catalogue: Catalogue, trees: Mapping[str, Tree]
    ) -> None:
        self.values, self.catalogue, self.trees = values, catalogue, trees
        self.findings: Findings = values.findings
        self.ports = PortReader(values)
        self.modifiers = ModifierReader(values, self.children)
        self.known = [*COMPOSITES, *catalogue.names()]

    def read(self, node: Node, around: Surroundings) -> Step | None:
        """The step that a node means; None after a finding."""
        if node.kind == "scalar" and isinstance(node.value, str):
            return self._step(node, None, {}, around)
        if not node.is_mapping or not node.entries:
            hint = "write a list under `sequence:`" if node.is_sequence else ""
            sentence = f"a node is one key that names its type, got {node.words()}"
            self.findings.error("E120", node.mark, sentence, hint)
            return None
        head = self._head(node)
        if head is None:
            return None
        beside = {str(key.value): (key, value) for key, value in node.entries if key is not head[0]}
        return self._step(head[0], head[1], beside, around)

    def _head(self, node: Node) -> tuple[Node, Node] | None:
        """The entry that names the node's type; what is neither type nor modifier is reported."""
        types = [entry for entry in node.entries if str(entry[0].value) not in MODIFIERS]
        if not types:
            names = ", ".join(str(key.value) for key, _ in node.entries)
            sentence = f"no type: {names} stand beside a node's type"
            self.findings.error("E120", node.mark, sentence, "name a behaviour, e.g. `wait: 1 s`")
            return None
        known = [entry for entry in types if str(entry[0].value) in self.known]
        head = (known or types)[0]
        for key, _ in types:
            if key is head[0]:
                continue
            if str(key.value) in self.known:
                sentence = f"a node has one type, got {head[0].value!r} and {key.value!r}"
                hint = "write each as an item of a list, with `- ` in front"
                self.findings.error("E120", key.mark, sentence, hint)
            else:
                self._unknown_modifier(head[0], key)
        return head

    def _unknown_modifier(self, head: Node, key: Node) -> None:
        word = str(key.value)
        hint = suggestion(word, MODIFIERS)
        if str(head.value) not in COMPOSITES and str(head.value) in self.known:
            kind = self.catalogue.get(str(head.value))
            if kind is not None and word in kind.ports:
                hint = f"{word} is a port of {head.value}: indent it below `{head.value}:`"
        self.findings.error("E123", key.mark, f"there is no modifier {word!r}", hint)

    def _step(
        self, head: Node, body: Node | None, beside: Beside,
        around: Surroundings,
    ) -> Step | None:  # fmt: skip
        kind = str(head.value)
        self._misplaced(kind, beside)
        modifiers = self.modifiers.read(kind, beside, around)
        name = self._label(beside)
        within = around
        if modifiers.retry or modifiers.recover:
            within = replace(around, knows_attempt=True)
        start = Step(kind, head.mark, name, modifiers)
        if kind == "use":
            return self._use(start, body, beside, within)
        if kind == "for_each":
            return self._for_each(start, body, beside, within)
        if kind == FOLLOW_WAYPOINTS:
            return self._follow_waypoints(start, body, beside, within)
        if kind in COMPOSITES:
            return self._composite(start, body, within)
        return self._leaf(start, head, body, _value(beside, "out"), within)

    def _misplaced(self, kind: str, beside: Beside) -> None:
        for word, owners in _ONLY_FOR.items():
            if word in beside and kind not in owners:
                self.findings.error(
                    "E123", beside[word][0].mark,
                    f"`{word}` goes with `{'` and `'.join(owners)}`, not with {kind!r}",
                    f"ports stand below `{kind}:`" if word == "with" else "",
                )  # fmt: skip
        if "out" in beside and kind in COMPOSITES and kind not in _WITH_OUTPUTS:
            sentence = f"`out` goes with a behaviour or `use`, not with {kind!r}"
            self.findings.error("E123", beside["out"][0].mark, sentence)

    def _label(self, beside: Beside) -> str:
        if "name" not in beside:
            return ""
        node = beside["name"][1]
        if not isinstance(node.value, str) or not node.value:
            self.findings.error("E123", node.mark, f"name is a text, got {node.words()}")
            return ""
        return node.value

    # Composites

    def children(
        self, node: Node | None, kind: str, mark: Mark, around: Surroundings
    ) -> list[Step]:
        """The children in a list; those that are wrong are reported and left out."""
        if node is None or not node.is_sequence or not node.items:
            got = "nothing" if node is None else node.words()
            if node is not None and node.is_sequence:
                got = "an empty list"
            place = node.mark if node is not None and node.value is not None else mark
            self.findings.error("E124", place, f"{kind} takes a list of nodes, got {got}")
            return []
        steps: list[Step] = []
        for number, item in enumerate(node.items):
            later = number > 0 and kind in _HAS_ERROR
            step = self.read(item, replace(around, knows_error=around.knows_error or later))
            steps += [step] if step else []
        return steps

    def _composite(self, start: Step, body: Node | None, around: Surroundings) -> Composite:
        patience: Node | None = None
        if body is not None and start.kind == "parallel" and body.is_mapping:
            given, patience = body.get("do"), body.get("succeed_on")
            for key, _ in body.entries:
                if key.value not in ("succeed_on", "do"):
                    hint = suggestion(str(key.value), ("succeed_on", "do"))
                    self.findings.error("E130", key.mark, f"parallel has no {key.value!r}", hint)
            body = given
        children = tuple(self.children(body, start.kind, start.mark, around))
        needed = self._needed(patience, len(children), around)
        return Composite(start.kind, start.mark, start.name, start.modifiers, children, needed)

    def _needed(self, node: Node | None, children: int, around: Surroundings) -> int:
        if node is None or node.value == "all":
            return children
        if node.value == "one":
            return 1
        value = self.values.value(_PATIENCE, node, around)
        needed = value.value if isinstance(value, Constant) else children
        if children and needed > children:
            sentence = f"succeed_on {needed}, but there are {children} children"
            self.findings.error("E132", node.mark, sentence)
        return int(needed)

    def _for_each(
        self, start: Step, body: Node | None, beside: Beside,
        around: Surroundings,
    ) -> ForEach | None:  # fmt: skip
        entries = body.entries if body else []
        if len(entries) != 1 or not IDENTIFIER.fullmatch(str(entries[0][0].value)):
            mark = body.mark if body else start.mark
            sentence = "for_each takes one variable and its list: {shelf: $shelves}"
            self.findings.error("E124", mark, sentence)
            return None
        key, node = entries[0]
        poses = any(item.is_sequence for item in node.items)
        kind = list[Pose2D] if poses else list[Any]
        items = self.values.value(Declaration(str(key.value), kind), node, around)
        symbol = Symbol(str(key.value), Role.VARIABLE, _item_type(items), key.mark)
        self.warn_of_hiding(symbol, around)
        inside = replace(around, scope=around.scope.inside({symbol.name: symbol}))
        child = self.child(beside.get("do"), start, inside)
        if items is None or child is None:
            return None
        return ForEach(
            start.kind, start.mark, start.name, start.modifiers,
            symbol, items, _skips_failures(beside), child,
        )  # fmt: skip

    def _follow_waypoints(
        self, start: Step, body: Node | None, beside: Beside, around: Surroundings
    ) -> Step | None:
        drive = self.catalogue.get("navigate_to_pose")
        if drive is None:
            sentence = f"{FOLLOW_WAYPOINTS} needs the behaviour navigate_to_pose"
            self.findings.error("E121", start.mark, sentence)
            return None
        owner = Owner(start.kind, start.mark)
        ports = self.ports.of_behaviour(WAYPOINT_PORTS, body, owner, around)
        outputs = self.ports.outputs(WAYPOINT_OUTPUTS, _value(beside, "out"), owner, around)
        symbols = waypoint_symbols(start.mark)
        for symbol in symbols.values():
            self.warn_of_hiding(symbol, around)
        inside = replace(around, scope=around.scope.inside(symbols))
        task = self.child(beside["do"], start, inside) if "do" in beside else None
        if "waypoints" not in ports or ("do" in beside and task is None):
            return None
        loop = following(start, drive, ports, symbols, task)
        return replace(loop, skip_failures=_skips_failures(beside), outputs=outputs)

    def child(
        self, entry: tuple[Node, Node] | None, start: Step, around: Surroundings
    ) -> Step | None:
        """The node under `do`."""
        if entry is None:
            self.findings.error("E124", start.mark, f"{start.kind} needs `do`")
            return None
        return self.read(entry[1], around)

    def warn_of_hiding(self, symbol: Symbol, around: Surroundings) -> None:
        """Report a name that hides one further out."""
        hidden = around.scope.lookup(symbol.name)
        if hidden is not None and hidden is not symbol:
            where = f" of line {hidden.mark.line}" if hidden.mark.file == symbol.mark.file else ""
            sentence = f"the {symbol.role} {symbol.name!r} hides the {hidden.role}{where}"
            self.findings.warning("W101", symbol.mark, sentence)

    # Leaves

    def _use(
        self, start: Step, body: Node | None, beside: Beside,
        around: Surroundings,
    ) -> Use | None:  # fmt: skip
        word = body.value if body is not None else None
        tree = self.trees.get(word) if isinstance(word, str) else None
        if body is None or tree is None:
            mark = body.mark if body is not None and body.value is not None else start.mark
            hint = suggestion(str(word), self.trees) if self.trees else "declare it under `trees`"
            if word in self.known:
                hint = f"{word} is a behaviour: write `{word}:`"
            self.findings.error("E122", mark, f"there is no tree {word!r}", hint)
            return None
        defaults = {
            name: symbol.value for name, symbol in tree.inputs.items() if symbol.value is not UNSET
        }
        declared = {
            name: symbol.type.declaration(name, default=defaults.get(name, REQUIRED))
            for name, symbol in tree.inputs.items()
        }
        owner = Owner(tree.name, body.mark)
        inputs = self.ports.by_name(declared, _value(beside, "with"), owner, around)
        for name, value in defaults.items():
            text = formatter(tree.inputs[name].type, shown)(value)
            inputs.setdefault(name, Constant(value, text))
        results = {name: symbol.type for name, symbol in tree.outputs.items()}
        outputs = self.ports.outputs(results, _value(beside, "out"), owner, around)
        return Use(
            start.kind, start.mark, start.name, start.modifiers, tree.name, inputs, outputs
        )  # fmt: skip

    def _leaf(
        self, start: Step, head: Node, body: Node | None, out: Node | None,
        around: Surroundings,
    ) -> Leaf | None:  # fmt: skip
        kind = self._behaviour(head)
        if kind is None:
            return None
        owner = Owner(start.kind, head.mark)
        ports = self.ports.of_behaviour(kind.ports, body, owner, around)
        if not kind.bindable:
            for name, value in ports.items():
                if not isinstance(value, Constant):
                    sentence = f"{name}: a plain py_trees class takes literals only"
                    self.findings.error("E132", head.mark, sentence)
        results = {name: type_of(declared) for name, declared in kind.outputs.items()}
        outputs = self.ports.outputs(results, out, owner, around)
        return Leaf(
            start.kind, start.mark, start.name, start.modifiers, kind, ports, outputs
        )  # fmt: skip

    def _behaviour(self, head: Node) -> BehaviourKind | None:
        word = str(head.value)
        if word not in self.known and "." not in word:
            hint = suggestion(word, self.known)
            if word in self.trees:
                hint = f"{word} is a tree: write `use: {word}`"
            self.findings.error("E121", head.mark, f"there is no behaviour {word!r}", hint)
            return None
        found = self.catalogue.get(word)
        if found is None:
            self.findings.error("E121", head.mark, self.catalogue.why_not(word))
        return found


def _skips_failures(beside: Beside) -> bool:
    return "on_failure" in beside and bool(beside["on_failure"][1].value == "continue")


def _value(beside: Beside, word: str) -> Node | None:
    return beside[word][1] if word in beside else None


def _item_type(items: Value | None) -> ValueType:
    """The type of a loop variable, from the list it runs over."""
    symbol = getattr(items, "symbol", None)
    if isinstance(symbol, Symbol):
        return symbol.type.item or ANYTHING
    if isinstance(items, Constant) and items.value:
        kinds = [_literal_type(value) for value in items.value]
        if all(kind == kinds[0] for kind in kinds):
            return kinds[0]
        if all(kind.is_number for kind in kinds):
            return ValueType(float)
    return ANYTHING


def _literal_type(value: Any) -> ValueType:
    return (
        ValueType(type(value)) if isinstance(value, bool | int | float | str | Pose2D) else ANYTHING
    )
