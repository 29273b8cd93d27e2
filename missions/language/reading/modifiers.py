"""What may stand beside a node's type: `when: …, timeout: 90 s, retry: 3`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from missions.language.expressions.expression import CheckedExpression, Surroundings
from missions.language.model import Constant, Modifiers, Recover, Retry, Step, Value
from missions.language.reading.values import ValueReader
from stack.documents import Mark, Node
from stack.parameters import Declaration, suggestion

MODIFIERS: dict[str, str] = {
    "name": "a label for the screen and the report",
    "when": "looked at when the node starts: if false, the node is skipped",
    "while": "looked at on every tick: when false, the node is halted and fails (CHECK_FAILED)",
    "on_failure": "`continue` makes a failure a success; `fail` is the default",
    "repeat": "run again after success: a number of times, or `forever`",
    "recover": "after a failure run the next recovery, then try again",
    "retry": "try again after a failure: a number of attempts, or `{attempts: 3, delay: 500 ms}`",
    "timeout": "halt the node after this long and fail (TIMED_OUT); per attempt",
    "every": "run at most once in this time; in between the last result stands",
    "with": "with `use`: what goes into the tree",
    "out": "where outputs go: `{output: $key}`",
    "do": "with `for_each` and `follow_waypoints`: what is done per item",
}
"""Modifiers, outermost decorator first."""

LOOPS = ("for_each", "follow_waypoints")
"""What `do` goes with; their `on_failure` is about one item."""

ATTEMPTS = Declaration("attempts", int, at_least=1)
DELAY = Declaration("delay", float, unit="s", default=0.0, at_least=0.0)
TIMES = Declaration("repeat", int, at_least=1)
LIMIT = Declaration("timeout", float, unit="s", above=0.0)
PERIOD = Declaration("every", float, unit="s", above=0.0)

Children = Callable[[Node | None, str, Mark, Surroundings], list[Step]]
Beside = Mapping[str, tuple[Node, Node]]


class ModifierReader:
    """Reads the modifiers of one node; `children` reads lists of nodes."""

    def __init__(self, values: ValueReader, children: Children) -> None:
        self.values, self.findings, self.children = values, values.findings, children

    def read(self, kind: str, beside: Beside, around: Surroundings) -> Modifiers:
        """The modifiers; what is wrong is reported and left out."""
        inside = replace(around, knows_attempt=True)
        return Modifiers(
            when=self._condition(beside, "when", around),
            while_=self._condition(beside, "while", around),
            keep_going=self._keeps_going(beside) and kind not in LOOPS,
            repeat=self._repeat(beside, around),
            recover=self._recover(beside, inside),
            retry=self._retry(beside, around),
            timeout=self._scalar(LIMIT, beside, around),
            every=self._scalar(PERIOD, beside, around),
        )

    def _condition(
        self, beside: Beside, word: str, around: Surroundings
    ) -> CheckedExpression | None:
        return self.values.expression(beside[word][1], around) if word in beside else None

    def _scalar(self, declared: Declaration, beside: Beside, around: Surroundings) -> Value | None:
        if declared.name not in beside:
            return None
        return self.values.value(declared, beside[declared.name][1], around)

    def _keeps_going(self, beside: Beside) -> bool:
        if "on_failure" not in beside:
            return False
        node = beside["on_failure"][1]
        if node.value not in ("continue", "fail"):
            hint = suggestion(str(node.value), ("continue", "fail"))
            sentence = f"on_failure is `continue` or `fail`, got {node.words()}"
            self.findings.error("E123", node.mark, sentence, hint)
        return bool(node.value == "continue")

    def _repeat(self, beside: Beside, around: Surroundings) -> Value | None:
        if "repeat" in beside and beside["repeat"][1].value == "forever":
            return Constant(None, "forever")
        return self._scalar(TIMES, beside, around)

    def _retry(self, beside: Beside, around: Surroundings) -> Retry | None:
        if "retry" not in beside:
            return None
        node = beside["retry"][1]
        if not node.is_mapping:
            attempts = self.values.value(ATTEMPTS, node, around)
            return Retry(attempts, Constant(0.0)) if attempts else None
        self._only("retry", node, ("attempts", "delay"))
        attempts = self._needed("retry", node, around)
        given = node.get("delay")
        delay = self.values.value(DELAY, given, around) if given else Constant(0.0)
        return Retry(attempts, delay) if attempts and delay else None

    def _recover(self, beside: Beside, inside: Surroundings) -> Recover | None:
        if "recover" not in beside:
            return None
        node, key = beside["recover"][1], beside["recover"][0]
        if not node.is_mapping:
            sentence = f"recover is {{attempts: N, round_robin: […]}}, got {node.words()}"
            self.findings.error("E123", node.mark, sentence)
            return None
        self._only("recover", node, ("attempts", "unless", "round_robin"))
        attempts = self._needed("recover", node, inside)
        dealing = replace(inside, knows_error=True)
        unless = node.get("unless")
        condition = self.values.expression(unless, dealing) if unless else None
        steps = self.children(node.get("round_robin"), "round_robin", key.mark, dealing)
        return Recover(attempts, condition, tuple(steps)) if attempts else None

    def _needed(self, word: str, node: Node, around: Surroundings) -> Value | None:
        given = node.get("attempts")
        if given is None:
            self.findings.error("E123", node.mark, f"{word} needs `attempts`")
            return None
        return self.values.value(ATTEMPTS, given, around)

    def _only(self, word: str, node: Node, known: tuple[str, ...]) -> None:
        for key, _ in node.entries:
            if key.value not in known:
                hint = suggestion(str(key.value), known)
                self.findings.error("E123", key.mark, f"{word} has no {key.value!r}", hint)
