"""Reader of modifiers, the keys next to a node's type: `when: …, timeout: 90 s, retry: 3`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from missions.language.expressions.expression import CheckedExpression, NameContext
from missions.language.keys import (
    ATTEMPTS,
    DELAY,
    LIMIT,
    MODIFIERS,
    ON_FAILURE_WORDS,
    PERIOD,
    RECOVER,
    REPEAT,
    RETRY,
    TIMES,
)
from missions.language.reading.values import ValueReader
from missions.language.reading.words import WordRole
from missions.language.step import Head, Modifiers, Order, Recover, Retry, Step
from missions.language.values import Constant, Value
from stack.documents import Node
from stack.errors import Hint
from stack.parameters import Declaration, did_you_mean, suggestion

ReadNode = Callable[[Node, NameContext], Step | None]
ReadChildren = Callable[[Node | None, Head, NameContext, Order], tuple[Step, ...]]
RawModifiers = Mapping[str, tuple[Node, Node]]
"""Modifier -> nodes of its key and its value."""

_HINTS = {
    "repeat": {
        "while": Hint("write `repeat: forever`, and `while: …` beside it"),
        "times": Hint("write `repeat: 3`"), "count": Hint("write `repeat: 3`"),
    },
    "retry": dict.fromkeys(("times", "count"), did_you_mean("attempts")),
    "recover": dict.fromkeys(("do", "recoveries", "actions"), did_you_mean("round_robin")),
}  # fmt: skip
"""Section -> word that is no key of it -> what is meant."""


class ModifierReader:
    """Reads the modifiers of one node; `node` reads a node, `children` a list of nodes."""

    def __init__(self, values: ValueReader, node: ReadNode, children: ReadChildren) -> None:
        self.values, self.findings = values, values.findings
        self.node, self.children = node, children

    def read(
        self, kind: str, raw: RawModifiers, context: NameContext, *, is_loop: bool = False
    ) -> Modifiers:
        """Return the modifiers; report and skip invalid ones.

        The `on_failure` of a loop is for each item, and not a modifier of the loop.
        """
        for key, _ in raw.values():
            self.values.words.add(key, WordRole.MODIFIER, context.scope, kind)
        inside, last = replace(context, knows_attempt=True), value_in(raw, "finally")
        repeat = value_in(raw, "repeat")
        until = repeat.get("until") if repeat is not None and repeat.is_mapping else None
        return Modifiers(
            when=self._condition(value_in(raw, "when"), context),
            finally_=self.node(last, context) if last is not None else None,
            while_=self._condition(value_in(raw, "while"), context),
            keep_going=self._keeps_going(raw) and not is_loop,
            invert=self._inverts(raw),
            repeat=self._repeat(repeat, context),
            until=self._condition(until, context),
            recover=self._recover(raw, inside),
            retry=self._retry(value_in(raw, "retry"), context),
            timeout=self._scalar(LIMIT, raw, context),
            every=self._scalar(PERIOD, raw, context),
        )

    def _condition(self, node: Node | None, context: NameContext) -> CheckedExpression | None:
        return None if node is None else self.values.expression(node, context)

    def _scalar(
        self, declared: Declaration, raw: RawModifiers, context: NameContext
    ) -> Value | None:
        node = value_in(raw, declared.name)
        return None if node is None else self.values.value(declared, node, context)

    def _keeps_going(self, raw: RawModifiers) -> bool:
        node = value_in(raw, "on_failure")
        if node is None:
            return False
        self.values.words.choice(node, ON_FAILURE_WORDS)
        if node.value not in ON_FAILURE_WORDS:
            hint: str = suggestion(str(node.value), ON_FAILURE_WORDS)
            if node.is_mapping or node.is_sequence:
                hint = "for a node after a failure write a list below `fallback:`"
            sentence = f"on_failure must be `continue` or `fail`, got {node.words()}"
            self.findings.add("E123", node.mark, sentence, hint)
        return keeps_going(raw)

    def _repeat(self, node: Node | None, context: NameContext) -> Value | None:
        if node is None:
            return None
        forever = MODIFIERS["repeat"].words
        if node.value in forever:
            self.values.words.choice(node, forever)
            return Constant(None, "forever")
        if node.is_mapping:
            until = node.get("until")
            self.values.keys(node, "repeat", REPEAT, "E123", context, _HINTS["repeat"])
            misnamed = any(str(key.value) in _HINTS["repeat"] for key, _ in node.entries)
            if until is None and not misnamed:
                hint = "write repeat: {until: condition}"
                self.findings.add("E123", node.mark, "repeat needs `until`", hint)
            return Constant(None, f"until {until.value if until else '?'}")
        if _is_no_count(node):
            sentence = f"repeat: expected a whole number from 1 on, got {node.words()}"
            self.findings.add("E132", node.mark, sentence, "or write `forever` or {until: …}")
            return None
        return self.values.value(TIMES, node, context)

    def _inverts(self, raw: RawModifiers) -> bool:
        node = value_in(raw, "invert")
        if node is None:
            return False
        self.values.words.choice(node, ("true", "false"))
        if not isinstance(node.value, bool):
            self.findings.add("E123", node.mark, f"invert is `true`, got {node.words()}")
        return node.value is True

    def _retry(self, node: Node | None, context: NameContext) -> Retry | None:
        if node is None:
            return None
        if _is_no_count(node):
            sentence = f"retry: expected a number of attempts from 1 on, got {node.words()}"
            hint = "write retry: 3; endless retries are not possible"
            self.findings.add("E132", node.mark, sentence, hint)
            return None
        if not node.is_mapping:
            attempts = self.values.value(ATTEMPTS, node, context)
            return Retry(attempts, Constant(0.0)) if attempts else None
        meant = self.values.keys(node, "retry", RETRY, "E123", context, _HINTS["retry"])
        attempts = self._needed("retry", node, context, meant)
        given = node.get("delay")
        delay = self.values.value(DELAY, given, context) if given else Constant(0.0)
        return Retry(attempts, delay) if attempts and delay else None

    def _recover(self, raw: RawModifiers, inside: NameContext) -> Recover | None:
        if "recover" not in raw:
            return None
        key, node = raw["recover"]
        meant = self.values.keys(node, "recover", RECOVER, "E123", inside, _HINTS["recover"])
        if not node.is_mapping:
            sentence = f"recover must be {{attempts: N, round_robin: […]}}, got {node.words()}"
            count = len(node.items) + 1 if node.is_sequence else 3
            hint = f"write `attempts: {count}` and the list below `round_robin:`"
            self.findings.add("E123", node.mark, sentence, hint)
            return None
        attempts = self._needed("recover", node, inside, meant)
        handling = replace(inside, knows_error=True)
        condition = self._condition(node.get("unless"), handling)
        if "round_robin" in meant and node.get("round_robin") is None:
            return None  # one finding for one mistake
        head = Head("round_robin", key.mark, "", Modifiers())
        steps = self.children(node.get("round_robin"), head, handling, Order.IN_TURN)
        return Recover(attempts, condition, steps) if attempts else None

    def _needed(self, word: str, node: Node, context: NameContext, meant: set[str]) -> Value | None:
        given = node.get("attempts")
        if given is not None:
            return self.values.value(ATTEMPTS, given, context)
        if "attempts" not in meant:
            self.findings.add("E123", node.mark, f"{word} needs `attempts`", "write attempts: 3")
        return None


def _is_no_count(node: Node) -> bool:
    """Return whether a number of runs is a word, true or false, or below 1."""
    value = node.value
    is_word = isinstance(value, str) and value.isalpha()
    return is_word or isinstance(value, bool) or (isinstance(value, int) and value < 1)


def keeps_going(raw: RawModifiers) -> bool:
    """Return whether a node has `on_failure: continue`."""
    node = value_in(raw, "on_failure")
    return node is not None and bool(node.value == "continue")


def value_in(raw: RawModifiers, word: str) -> Node | None:
    """Return the value of a modifier; None if the node does not have it."""
    return raw[word][1] if word in raw else None
