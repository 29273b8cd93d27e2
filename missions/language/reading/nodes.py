"""Reader of nodes: `{navigate_to_pose: {goal: $dock}, timeout: 90 s}`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from behaviours.catalogue import Catalogue
from behaviours.kind import BehaviourKind
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Symbol
from missions.language.foreign_words import (
    CHILDREN_WORDS,
    TYPE_WORDS,
    modifier_hint,
    node_meaning,
    plain,
)
from missions.language.foreign_words import MODIFIERS as WORDS
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES, node_types
from missions.language.kinds.kind import Written
from missions.language.kinds.leaf import read_leaf
from missions.language.reading.commas import report_cut_expression
from missions.language.reading.modifiers import ModifierReader, RawModifiers, value_in
from missions.language.reading.ports import PortReader
from missions.language.reading.values import ValueReader
from missions.language.reading.words import WordRole
from missions.language.sections import ONLY_FOR
from missions.language.step import Head, Order, Step, Tree
from stack.documents import Findings, Node, is_one_line
from stack.parameters import suggestion

_OF_A_PLUGIN = "a mission that includes this file needs a plugin with it"


class NodeReader:
    """Reads the nodes of one file, checked against the catalogue and the declared trees.

    With `has_other_plugins`, a behaviour that is not installed may be one of a mission's plugins.
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
        self.known = node_types(catalogue)

    def read(self, node: Node, context: NameContext) -> Step | None:
        """Read a node; None after a finding."""
        if node.kind == "scalar" and isinstance(node.value, str):
            return self._step(node, None, {}, context)
        if not node.is_mapping or not node.entries:
            hint = "write a list under `sequence:`" if node.is_sequence else "write `wait: 3 s`"
            sentence = f"a node must be one key that names its type, got {node.words()}"
            self.findings.add("E120", node.mark, sentence, hint)
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
        if self._type_is_a_value(types):
            return None
        if not types:
            names = ", ".join(str(key.value) for key, _ in node.entries)
            sentence = f"the node has no type; its keys are modifiers: {names}"
            hint = "add a behaviour, e.g. `wait: 1 s`"
            if node.get("do") is not None:
                hint = "write the node itself instead of `do:`, with its modifiers beside it"
            self.findings.add("E120", node.mark, sentence, hint)
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
                hint = "write each as a list item, with `- ` in front, below `sequence:`"
                self.findings.add("E120", key.mark, sentence, hint)
            elif known or plain(str(head[0].value)) not in WORDS:  # `then` of an `if` is no mistake
                self._unknown_modifier(head[0], key)
        return head

    def _type_is_a_value(self, entries: Sequence[tuple[Node, Node]]) -> bool:
        """Report `{type: wait, time: 3 s}`; return whether a node is written like this."""
        for key, value in entries:
            if str(key.value) in TYPE_WORDS and str(value.value) in self.known:
                sentence = f"the type of a node is its key, not the value of {key.value!r}"
                hint = f"write `{value.value}: {{…}}` instead, with its ports in it"
                self.findings.add("E120", key.mark, sentence, hint)
                return True
        return False

    def _unknown_modifier(self, head: Node, key: Node) -> None:
        word = str(key.value)
        hint = modifier_hint(word, MODIFIERS)
        if str(head.value) == "use":
            hint = f"inputs of a tree stand below `with:`: write with: {{{word}: …}}"
        if str(head.value) not in NODES and str(head.value) in self.known:
            kind = self.catalogue.get(str(head.value))
            if kind is not None and word in kind.ports:
                hint = f"{word} is a port of {head.value}: indent it below `{head.value}:`"
        self.findings.add("E123", key.mark, f"there is no modifier {word!r}", hint)

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
        is_loop = kind in NODES and NODES[kind].is_loop
        modifiers = self.modifiers.read(kind, raw, context, is_loop=is_loop)
        name = self._label(raw)
        within = context
        if modifiers.retry or modifiers.recover:
            within = replace(context, knows_attempt=True)
        written = Written(Head(kind, head.mark, name, modifiers), body, raw)
        read = NODES[kind].read if kind in NODES else None
        if read is not None:
            return read(self, written, within)
        behaviour = self._behaviour(head)
        return read_leaf(self, behaviour, written, within) if behaviour else None

    def _misplaced(self, kind: str, raw: RawModifiers) -> None:
        for word, owners in ONLY_FOR.items():
            if word in raw and kind not in owners:
                self.findings.add(
                    "E123", raw[word][0].mark,
                    f"`{word}` is only for `{'` and `'.join(owners)}`, not for {kind!r}",
                    f"write ports below `{kind}:`" if word == "with" else "",
                )  # fmt: skip
        if "out" in raw and kind in NODES and not NODES[kind].takes_outputs:
            takers = "` and `".join(word for word, item in NODES.items() if item.takes_outputs)
            sentence = f"`out` is only for behaviours, `{takers}`, not for {kind!r}"
            self.findings.add("E123", raw["out"][0].mark, sentence)

    def _label(self, raw: RawModifiers) -> str:
        if "name" not in raw:
            return ""
        node = raw["name"][1]
        if not isinstance(node.value, str) or not node.value:
            self.findings.add("E123", node.mark, f"name must be a text, got {node.words()}")
            return ""
        if not is_one_line(node.value):
            self.findings.add("E123", node.mark, f"name must be one line, got {node.words()}")
            return ""
        return node.value

    def children(
        self, node: Node | None, head: Head, context: NameContext, order: Order
    ) -> tuple[Step, ...]:
        """Read a list of nodes that run in this order; report and skip invalid ones."""
        kind = head.kind
        if node is None or not node.is_sequence or not node.items:
            got = "nothing" if node is None else node.words()
            if node is not None and node.is_sequence:
                got = "an empty list"
            place = node.mark if node is not None and node.value is not None else head.mark
            hint = _hint_of_children(kind, node)
            self.findings.add("E124", place, f"{kind} needs a list of nodes, got {got}", hint)
            if node is not None and node.value is not None and not node.is_sequence:
                self.skim(node, context)
            return ()
        later = replace(context, knows_error=context.knows_error or order.handles_failure)
        steps = [self.read(item, later if number else context)
                 for number, item in enumerate(node.items)]  # fmt: skip
        return tuple(step for step in steps if step is not None)

    def child(
        self, entry: tuple[Node, Node] | None, head: Head, context: NameContext
    ) -> Step | None:
        """Read the node under `do`."""
        if entry is None:
            self.findings.add("E124", head.mark, f"{head.kind} needs `do`")
            return None
        return self.read(entry[1], context)

    def warn_of_hiding(self, symbol: Symbol, context: NameContext) -> None:
        """Report a name that hides one of an outer scope."""
        hidden = context.scope.lookup(symbol.name)
        if hidden is not None and hidden is not symbol:
            where = f" (line {hidden.mark.line})" if hidden.mark.file == symbol.mark.file else ""
            sentence = f"the {symbol.role} {symbol.name!r} hides the {hidden.role}{where}"
            self.findings.add("W101", symbol.mark, sentence)

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
            sentence = f"there is no behaviour {word!r}"
            if self.has_other_plugins and not hint:
                self.findings.add("W115", head.mark, sentence, _OF_A_PLUGIN)
            else:
                self.findings.add("E121", head.mark, sentence, hint or suggestion(word, self.known))
            return None
        found = self.catalogue.get(word)
        if found is None:
            code = "W115" if self.has_other_plugins else "E121"
            self.findings.add(code, head.mark, self.catalogue.why_not(word))
        return found


def _hint_of_children(kind: str, node: Node | None) -> str:
    """Return the hint for a composite whose value is no list of nodes."""
    if node is None or not node.is_mapping:
        return f"write {kind}: [NODE, NODE]"
    (word, inner), *others = node.entries or ((node, node),)
    if inner.is_sequence and not others and str(word.value) in CHILDREN_WORDS:
        return f"leave out `{word.value}:`: the list stands directly below `{kind}:`"
    return "write `- ` in front of each node"
