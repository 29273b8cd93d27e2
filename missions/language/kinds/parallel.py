"""`parallel`: all children at once."""

from __future__ import annotations

from collections.abc import Sequence as Items
from dataclasses import dataclass
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.language.expressions.expression import NameContext
from missions.language.foreign_words import CHILDREN_WORDS
from missions.language.keys import Form, Key, section
from missions.language.kinds.composite import CompositeStep
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.step import Codes, Order, Outcomes, Step, TreeBuilder
from missions.language.values import Constant
from missions.trees.composites import halt_all
from missions.trees.context import Execution, halt
from missions.trees.node import InnerNode, Node
from missions.trees.slots import Frame
from stack.documents import Node as YamlNode
from stack.parameters import Declaration, did_you_mean
from stack.types import Failure, FailureCode

SUCCEED_ON = Declaration("succeed_on", int, at_least=1)
SUCCEED_WORDS = ("all", "one")
KEYS = section(
    Key("succeed_on", "number of children that must succeed, `all` (default) or `one`",
        Form.VALUE, declared=SUCCEED_ON, words=SUCCEED_WORDS),
    Key("do", "the children", Form.NODES, required=True),
)  # fmt: skip
_HINTS = {
    **dict.fromkeys((word for word in CHILDREN_WORDS if word not in KEYS), did_you_mean("do")),
    **dict.fromkeys(("success_threshold", "success_count", "policy"), did_you_mean("succeed_on")),
}
"""Keys elsewhere -> what is meant."""
_RUNNING, _SUCCESS, _FAILURE = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class Parallel(InnerNode, composites.Parallel):
    """Ticks all children until each has ended; ends as early as possible.

    Succeeds at the `needed`-th success; fails when that number can no longer be reached, with the
    failure that came first. Running children are then halted, and the remaining children are not
    ticked. If all children are needed, these are all that are not skipped.
    """

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution, needed: int
    ) -> None:
        super().__init__(name, ParallelPolicy.SuccessOnAll(synchronise=True), list(children))
        self.execution, self.needed = execution, needed
        self.pending: list[Behaviour] = []
        self.succeeded = self.failed = self.left_out = 0
        self.first_failed: Behaviour | None = None

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.pending = list(self.children)
            self.succeeded = self.failed = self.left_out = 0
            self.first_failed = None
        ended = False
        children: list[Any] = self.pending
        for number, child in enumerate(children):
            status = child.execute_tick()
            if status is _RUNNING:
                continue
            ended = True
            self._count(child, status)
            decided = self._decision()
            if decided is not None:
                if fresh:
                    halt_all(children[number + 1 :])
                return self._end(decided)
        if ended:
            self.pending = [child for child in children if child.status not in (_SUCCESS, _FAILURE)]
        return _RUNNING

    def _count(self, child: Any, status: Status) -> None:
        if status is _FAILURE:
            self.failed += 1
            self.first_failed = self.first_failed or child
        elif child.skipped:
            self.left_out += 1
        else:
            self.succeeded += 1

    def _decision(self) -> Status | None:
        """Return the outcome if it is certain: SUCCESS, FAILURE, or INVALID for a skip."""
        count = len(self.children)
        if self.left_out == count:
            return Status.INVALID
        needed = self.needed if self.needed < count else count - self.left_out
        if self.succeeded >= needed:
            return _SUCCESS
        return _FAILURE if self.failed + self.left_out > count - needed else None

    def _end(self, status: Status) -> Status:
        for child in self.children:
            if child.status is _RUNNING:
                halt(child)
        if status is Status.INVALID:
            return self.skip()
        if status is _SUCCESS:
            return status
        if self.first_failed is not None:
            return self.execution.propagate_failure(self, self.first_failed)
        sentence = (
            f"{self.needed} children must succeed, but {self.left_out} of {len(self.children)} "
            "are skipped"
        )
        return self.execution.fail(self, Failure(FailureCode.CHECK_FAILED, sentence))


@dataclass(frozen=True, slots=True)
class ParallelStep(CompositeStep):
    """All children at once; `needed` of them must succeed."""

    needed: int

    order = Order.TOGETHER
    without_sibling = "nothing runs beside {child}"

    @property
    def survives_failure(self) -> bool:
        return self.needed < len(self.nodes)

    def outcomes(self, children: Items[Outcomes]) -> Outcomes:
        skip = all(end.skip for end in children)
        if not self.survives_failure:
            succeed = any(end.success for end in children)
            all_end = all(end.success or end.skip for end in children)
            return Outcomes(succeed and all_end, any(end.failure for end in children), skip)
        fails = sum(end.failure or end.skip for end in children) > len(children) - self.needed
        return Outcomes(sum(end.success for end in children) >= self.needed, fails, skip)

    def least_time(self, children: Items[float]) -> float:
        return sorted(children)[self.needed - 1] if self.needed else 0.0

    def fails_with(self) -> Codes:
        skips = self.survives_failure and any(child.modifiers.when for child in self.nodes)
        return frozenset((FailureCode.CHECK_FAILED,)) if skips else frozenset()

    @property
    def detail(self) -> str:
        return f"{self.needed} of {len(self.nodes)}"

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        children = self.build_children(builder, frame)
        return Parallel(self.name or self.kind, children, builder.execution, self.needed)


def _read(reader: NodeReading, written: Written, context: NameContext) -> Step | None:
    head, body = written.head, written.body
    given, succeed_on = body, None
    if body is not None and body.is_mapping:
        meant = reader.values.keys(body, "parallel", KEYS, "E130", context, _HINTS)
        given, succeed_on = body.get("do"), body.get("succeed_on")
        if given is None and "do" in meant:
            return None
    nodes = reader.children(given, head, context, Order.TOGETHER)
    return ParallelStep(*head, nodes, _needed(reader, succeed_on, len(nodes), context))


def _needed(reader: NodeReading, node: YamlNode | None, children: int, context: NameContext) -> int:
    findings = reader.findings
    if node is None or node.value in SUCCEED_WORDS:
        return children if node is None or node.value == SUCCEED_WORDS[0] else 1
    if isinstance(node.value, str) and node.value.isalpha():
        sentence = f"succeed_on: expected a whole number, got {node.words()}"
        findings.add("E132", node.mark, sentence, "write all, one or a number")
        return children
    value = reader.values.value(SUCCEED_ON, node, context, options=SUCCEED_WORDS)
    if value is not None and not isinstance(value, Constant):
        sentence = "succeed_on must be known before the mission runs"
        findings.add("E132", node.mark, sentence, "write a number or an argument")
    needed = value.value if isinstance(value, Constant) else children
    if children and needed > children:
        amount = "1 child" if children == 1 else f"{children} children"
        sentence = f"succeed_on is {needed}, but the parallel has {amount}"
        findings.add("E132", node.mark, sentence)
    return int(needed)


PARALLEL = NodeKind(
    "parallel", "all children at once; `{succeed_on: all | one | N, do: […]}` or a list",
    Shape.CHILDREN, "∥", Outline.PARALLELOGRAM, Parallel, "{parallel: [{say: a}]}",
    keeps="the results of the children that have ended", keys=KEYS,
    also_known_as=("spawn", "race"), read=_read, step=ParallelStep,
)  # fmt: skip
