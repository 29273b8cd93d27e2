"""Reader of nodes: `{navigate_to_pose: {goal: $dock}, timeout: 90 s}`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from behaviours.catalogue import BehaviourKind
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import UNSET, Role, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.texts import formatter
from missions.language.expressions.value_types import type_of
from missions.language.foreign_words import MODIFIERS as WORDS
from missions.language.foreign_words import modifier_hint, node_meaning, plain
from missions.language.keys import (
    MODIFIERS,
    ONLY_FOR,
    PARALLEL,
    SUCCEED_ON,
    SUCCEED_WORDS,
)
from missions.language.kinds import FOLLOW_WAYPOINTS, NODES
from missions.language.model import (
    Catalogue,
    Composite,
    Constant,
    ForEach,
    Leaf,
    Step,
    Tree,
    Use,
)
from missions.language.reading.branches import (
    check_failure_code,
    loop_hint,
    read_switch,
    read_unset,
)
from missions.language.reading.commas import report_cut_expression
from missions.language.reading.modifiers import ModifierReader, RawModifiers, keeps_going, value_in
from missions.language.reading.ports import Owner, PortReader
from missions.language.reading.values import IDENTIFIER, ValueReader
from missions.language.reading.waypoints import (
    WAYPOINT_OUTPUTS,
    WAYPOINTS,
    waypoint_loop,
    waypoint_symbols,
)
from missions.language.reading.words import WordRole
from stack.documents import Findings, Mark, Node, is_one_line
from stack.parameters import REQUIRED, suggestion


class NodeReader:
    """Reads the nodes of one file, checked against the catalogue and the declared trees.

    With `has_other_plugins`, a behaviour without a meaning here may be one of a mission's plugins.
    """

    def __init__(
        self, values: ValueReader, catalogue: Catalogue, trees: Mapping[str, Tree],
        has_other_plugins: bool = False,
    ) -> None:  # fmt: skip
        self.has_other_plugins = has_other_plugins
        self.values, self.catalogue, self.trees = values, catalogue, trees
        self.findings: Findings = values.findings
        self.ports = PortReader(values)
        self.modifiers = ModifierReader(values, self.read, self.children)
        self.known = [*NODES, *catalogue.names()]

    def read(self, node: Node, context: NameContext) -> Step | None:
        """Read a node; None after a finding."""
        if node.kind == "scalar" and isinstance(node.value, str):
            return self._step(node, None, {}, context)
        if not node.is_mapping or not node.entries:
            hint = "write a list under `sequence:`" if node.is_sequence else "write `wait: 3 s`"
            sentence = f"a node must be one key that names its type, got {node.words()}"
            self.findings.error("E120", node.mark, sentence, hint)
            for item in node.items:
                self.skim(item, context)
            return None
        head = None
        if not report_cut_expression(node, self.findings):
            head = self._head(node, context)
        if head is None:
            return None
        raw = {str(key.value): (key, value) for key, value in node.entries if key is not head[0]}
        return self._step(head[0], head[1], raw, context)

    def skim(self, node: Node | None, context: NameContext) -> None:
        """Read a node for its words only: it stands where it has no effect."""
        if node is not None:
            kept = len(self.findings.items)
            self.read(node, context)
            del self.findings.items[kept:]

    def _head(self, node: Node, context: NameContext) -> tuple[Node, Node] | None:
        """Return the entry with the node's type; report keys that are neither type nor modifier."""
        types = [entry for entry in node.entries if str(entry[0].value) not in MODIFIERS]
        if not types:
            names = ", ".join(str(key.value) for key, _ in node.entries)
            sentence = f"the node has no type; its keys are modifiers: {names}"
            hint = "add a behaviour, e.g. `wait: 1 s`"
            if node.get("do") is not None:
                hint = "write the node itself instead of `do:`, with its modifiers beside it"
            self.findings.error("E120", node.mark, sentence, hint)
            raw = {str(key.value): (key, value) for key, value in node.entries}
            kept = len(self.findings.items)
            self.modifiers.read("", raw, context)
            del self.findings.items[kept:]
            self.skim(node.get("do"), context)
            return None
        known = [entry for entry in types if str(entry[0].value) in self.known]
        head = (known or types)[0]
        for key, _ in types:
            if key is head[0]:
                continue
            self.values.words.add(key, WordRole.MODIFIER, context.scope, str(head[0].value))
            if str(key.value) in self.known:
                sentence = f"a node has one type, got {head[0].value!r} and {key.value!r}"
                hint = "write each as a list item, with `- ` in front"
                self.findings.error("E120", key.mark, sentence, hint)
            elif known or plain(str(head[0].value)) not in WORDS:  # `then` of an `if` is no mistake
                self._unknown_modifier(head[0], key)
        return head

    def _unknown_modifier(self, head: Node, key: Node) -> None:
        word = str(key.value)
        hint = modifier_hint(word, MODIFIERS)
        if str(head.value) == "use":
            hint = f"inputs of a tree stand below `with:`: write with: {{{word}: …}}"
        if str(head.value) not in NODES and str(head.value) in self.known:
            kind = self.catalogue.get(str(head.value))
            if kind is not None and word in kind.ports:
                hint = f"{word} is a port of {head.value}: indent it below `{head.value}:`"
        self.findings.error("E123", key.mark, f"there is no modifier {word!r}", hint)

    def _step(
        self, head: Node, body: Node | None, raw: RawModifiers,
        context: NameContext,
    ) -> Step | None:  # fmt: skip
        kind = str(head.value)
        self.values.words.add(head, WordRole.KIND, context.scope)
        if kind in self.known or "." in kind:
            self._misplaced(kind, raw)
        if kind not in ONLY_FOR["do"]:
            self.skim(value_in(raw, "do"), context)
        modifiers = self.modifiers.read(kind, raw, context)
        name = self._label(raw)
        within = context
        if modifiers.retry or modifiers.recover:
            within = replace(context, knows_attempt=True)
        start = Step(kind, head.mark, name, modifiers)
        if kind == "use":
            return self._use(start, body, raw, within)
        if kind == "for_each":
            return self._for_each(start, body, raw, within)
        if kind == FOLLOW_WAYPOINTS:
            return self._follow_waypoints(start, body, raw, within)
        if kind == "switch":
            return read_switch(self, start, body, within)
        if kind == "unset":
            return read_unset(self, start, body, within)
        if kind in NODES:
            return self._composite(start, body, within)
        return self._leaf(start, head, body, raw, within)

    def _misplaced(self, kind: str, raw: RawModifiers) -> None:
        for word, owners in ONLY_FOR.items():
            if word in raw and kind not in owners:
                self.findings.error(
                    "E123", raw[word][0].mark,
                    f"`{word}` is only for `{'` and `'.join(owners)}`, not for {kind!r}",
                    f"write ports below `{kind}:`" if word == "with" else "",
                )  # fmt: skip
        if "out" in raw and kind in NODES and not NODES[kind].takes_outputs:
            takers = "` and `".join(word for word, item in NODES.items() if item.takes_outputs)
            sentence = f"`out` is only for behaviours, `{takers}`, not for {kind!r}"
            self.findings.error("E123", raw["out"][0].mark, sentence)

    def _label(self, raw: RawModifiers) -> str:
        if "name" not in raw:
            return ""
        node = raw["name"][1]
        if not isinstance(node.value, str) or not node.value:
            self.findings.error("E123", node.mark, f"name must be a text, got {node.words()}")
            return ""
        if not is_one_line(node.value):
            self.findings.error("E123", node.mark, f"name must be one line, got {node.words()}")
            return ""
        return node.value

    # Composites

    def children(
        self, node: Node | None, kind: str, mark: Mark, context: NameContext
    ) -> list[Step]:
        """Read a list of children; report and skip invalid ones."""
        if node is None or not node.is_sequence or not node.items:
            got = "nothing" if node is None else node.words()
            if node is not None and node.is_sequence:
                got = "an empty list"
            place = node.mark if node is not None and node.value is not None else mark
            is_mapping = node is not None and node.is_mapping
            hint = (
                "write `- ` in front of each node" if is_mapping else f"write {kind}: [NODE, NODE]"
            )
            self.findings.error("E124", place, f"{kind} needs a list of nodes, got {got}", hint)
            if node is not None and node.value is not None and not node.is_sequence:
                self.skim(node, context)
            return []
        handles_failure = NODES[kind].handles_failure
        steps: list[Step] = []
        for number, item in enumerate(node.items):
            later = number > 0 and handles_failure
            step = self.read(item, replace(context, knows_error=context.knows_error or later))
            steps += [step] if step else []
        return steps

    def _composite(self, start: Step, body: Node | None, context: NameContext) -> Composite:
        succeed_on: Node | None = None
        if body is not None and start.kind == "parallel" and body.is_mapping:
            given, succeed_on = body.get("do"), body.get("succeed_on")
            self.values.words.keys(body, "parallel", context.scope)
            for key, _ in body.entries:
                if key.value not in PARALLEL:
                    hint = suggestion(str(key.value), PARALLEL)
                    self.findings.error(
                        "E130", key.mark, f"parallel has no key {key.value!r}", hint
                    )
            body = given
        children = tuple(self.children(body, start.kind, start.mark, context))
        needed = self._needed(succeed_on, len(children), context)
        return Composite(start.kind, start.mark, start.name, start.modifiers, children, needed)

    def _needed(self, node: Node | None, children: int, context: NameContext) -> int:
        if node is None or node.value in SUCCEED_WORDS:
            return children if node is None or node.value == SUCCEED_WORDS[0] else 1
        if isinstance(node.value, str) and node.value.isalpha():
            sentence = f"succeed_on: expected a whole number, got {node.words()}"
            self.findings.error("E132", node.mark, sentence, "write all, one or a number")
            return children
        value = self.values.value(SUCCEED_ON, node, context, options=SUCCEED_WORDS)
        if value is not None and not isinstance(value, Constant):
            sentence = "succeed_on must be known before the mission runs"
            self.findings.error("E132", node.mark, sentence, "write a number or an argument")
        needed = value.value if isinstance(value, Constant) else children
        if children and needed > children:
            amount = "1 child" if children == 1 else f"{children} children"
            sentence = f"succeed_on is {needed}, but the parallel has {amount}"
            self.findings.error("E132", node.mark, sentence)
        return int(needed)

    def _for_each(
        self, start: Step, body: Node | None, raw: RawModifiers,
        context: NameContext,
    ) -> ForEach | None:  # fmt: skip
        entries = body.entries if body else []
        if len(entries) != 1 or not IDENTIFIER.fullmatch(str(entries[0][0].value)):
            mark = body.mark if body else start.mark
            sentence = "for_each needs one variable and its list: {shelf: $shelves}"
            self.findings.error("E124", mark, sentence, loop_hint(body))
            self.skim(value_in(raw, "do"), context)
            return None
        key, node = entries[0]
        self.values.words.add(key, WordRole.DECLARED, context.scope, "for_each")
        items, kind = self.values.items(str(key.value), node, context)
        symbol = Symbol(str(key.value), Role.VARIABLE, kind, key.mark)
        self.warn_of_hiding(symbol, context)
        inside = replace(context, scope=context.scope.inside({symbol.name: symbol}))
        child = self.child(raw.get("do"), start, inside)
        if items is None or child is None:
            return None
        return ForEach(
            start.kind, start.mark, start.name, start.modifiers,
            symbol, items, keeps_going(raw), child,
        )  # fmt: skip

    def _follow_waypoints(
        self, start: Step, body: Node | None, raw: RawModifiers, context: NameContext
    ) -> Step | None:
        drive = self.catalogue.get("navigate_to_pose")
        if drive is None:
            sentence = f"{FOLLOW_WAYPOINTS} needs the behaviour navigate_to_pose"
            self.findings.error("E121", start.mark, sentence)
            return None
        owner = Owner(start.kind, start.mark)
        ports = self.ports.of_behaviour(WAYPOINTS.ports, body, owner, context)
        outputs = self.ports.outputs(WAYPOINT_OUTPUTS, value_in(raw, "out"), owner, context)
        symbols = waypoint_symbols(start.mark)
        for symbol in symbols.values():
            self.warn_of_hiding(symbol, context)
        inside = replace(context, scope=context.scope.inside(symbols))
        task = self.child(raw["do"], start, inside) if "do" in raw else None
        if "waypoints" not in ports or ("do" in raw and task is None):
            return None
        loop = waypoint_loop(start, drive, ports, symbols, task)
        return replace(loop, skip_failures=keeps_going(raw), outputs=outputs)

    def child(
        self, entry: tuple[Node, Node] | None, start: Step, context: NameContext
    ) -> Step | None:
        """Read the node under `do`."""
        if entry is None:
            self.findings.error("E124", start.mark, f"{start.kind} needs `do`")
            return None
        return self.read(entry[1], context)

    def warn_of_hiding(self, symbol: Symbol, context: NameContext) -> None:
        """Report a name that hides one of an outer scope."""
        hidden = context.scope.lookup(symbol.name)
        if hidden is not None and hidden is not symbol:
            where = f" (line {hidden.mark.line})" if hidden.mark.file == symbol.mark.file else ""
            sentence = f"the {symbol.role} {symbol.name!r} hides the {hidden.role}{where}"
            self.findings.warning("W101", symbol.mark, sentence)

    # Leaves

    def _use(
        self, start: Step, body: Node | None, raw: RawModifiers,
        context: NameContext,
    ) -> Use | None:  # fmt: skip
        word = body.value if body is not None and not body.is_mapping else None
        tree = self.trees.get(word) if isinstance(word, str) else None
        if body is not None:
            self.values.words.add(body, WordRole.TREE, context.scope)
        if body is None or tree is None:
            mark = body.mark if body is not None and body.value is not None else start.mark
            hint = suggestion(str(word), self.trees) if self.trees else "declare it under `trees`"
            if word in self.known:
                hint = f"{word} is a behaviour: write `{word}:`"
            sentence = f"there is no tree {word!r}"
            if not isinstance(word, str):
                got = body.words() if body is not None else "nothing"
                sentence, hint = f"use needs the name of a tree, got {got}", "write `use: NAME`"
            self.findings.error("E122", mark, sentence, hint)
            self._skim_passed(raw, context)
            return None
        defaults = {
            name: symbol.value for name, symbol in tree.inputs.items() if symbol.value is not UNSET
        }
        declared = {
            name: symbol.type.declaration(name, default=defaults.get(name, REQUIRED))
            for name, symbol in tree.inputs.items()
        }
        owner = Owner(tree.name, body.mark, is_tree=True, misplaced=raw)
        inputs = self.ports.by_name(declared, value_in(raw, "with"), owner, context, WordRole.INPUT)
        for name, value in defaults.items():
            text = formatter(tree.inputs[name].type, shown)(value)
            inputs.setdefault(name, Constant(value, text))
        results = {name: symbol.type for name, symbol in tree.outputs.items()}
        outputs = self.ports.outputs(results, value_in(raw, "out"), owner, context)
        return Use(
            start.kind, start.mark, start.name, start.modifiers, tree.name, inputs, outputs
        )  # fmt: skip

    def _skim_passed(self, raw: RawModifiers, context: NameContext) -> None:
        """Record the words under `with` and `out` of an unknown tree."""
        for word, role in (("with", WordRole.VALUE), ("out", WordRole.TARGET)):
            given = value_in(raw, word)
            for _, value in given.entries if given else []:
                self.values.words.add(value, role, context.scope)

    def _leaf(
        self, start: Step, head: Node, body: Node | None, raw: RawModifiers, context: NameContext,
    ) -> Leaf | None:  # fmt: skip
        kind = self._behaviour(head)
        if kind is None:
            return None
        owner = Owner(start.kind, head.mark, misplaced=raw)
        ports = self.ports.of_behaviour(kind.ports, body, owner, context)
        if not kind.bindable:
            for name, value in ports.items():
                if not isinstance(value, Constant):
                    sentence = f"{name}: a port of a plain py_trees class must be a literal"
                    self.findings.error("E132", head.mark, sentence)
        if start.kind == "fail":
            check_failure_code(ports, start.mark, self.findings)
        results = {name: type_of(declared) for name, declared in kind.outputs.items()}
        outputs = self.ports.outputs(results, value_in(raw, "out"), owner, context)
        return Leaf(
            start.kind, start.mark, start.name, start.modifiers, kind, ports, outputs
        )  # fmt: skip

    def _behaviour(self, head: Node) -> BehaviourKind | None:
        word = str(head.value)
        if word not in self.known and "." not in word:
            hint = node_meaning(word, self.known)
            name, colon, value = word.partition(":")
            if colon and (name in self.known or name in MODIFIERS):
                hint = f"write a space after the colon: `{name}: {value.strip()}`"
            if word in self.trees:
                hint = f"{word} is a tree: write `use: {word}`"
                hint += ", with its inputs below `with:`" if self.trees[word].inputs else ""
            if hint or not self.has_other_plugins:
                hint = hint or suggestion(word, self.known)
                self.findings.error("E121", head.mark, f"there is no behaviour {word!r}", hint)
            return None
        found = self.catalogue.get(word)
        if found is None and not self.has_other_plugins:
            self.findings.error("E121", head.mark, self.catalogue.why_not(word))
        return found
