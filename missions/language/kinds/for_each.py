"""`for_each`: runs a node for each item of a list."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Role, Symbol
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.reading.literals import IDENTIFIER
from missions.language.reading.modifiers import keeps_going, value_in
from missions.language.reading.port_expressions import text_of
from missions.language.reading.words import WordRole
from missions.language.step import Order, Outcomes, Step, TreeBuilder
from missions.language.values import Constant, Value
from missions.trees.context import Execution, halt
from missions.trees.node import Decorator, Node, run
from missions.trees.slots import Frame
from stack.documents import Finding
from stack.documents import Node as YamlNode
from stack.types import Failure


class ForEach(Decorator):
    """Runs the child once per item, with the item in the loop variable.

    Succeeds at once if the list is empty; is skipped if all items are. After an item ends, the next
    one starts in the same tick, as in a sequence, unless the loops of the tree have started
    ITEMS_PER_TICK items in this tick; a loop always starts at least one.
    """

    def __init__(self, name: str, child: Behaviour, execution: Execution, loop: Loop) -> None:
        super().__init__(name, child, execution)
        self.loop, self.items, self.index, self.left_out = loop, list[Any](), 0, 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.items, self.index, self.left_out = list(self.loop.items()), 0, 0
        child = self.child
        first = self.index
        while self.index < len(self.items):
            if child.status is not Status.RUNNING:
                if self.execution.items_left <= 0 and self.index > first:
                    return Status.RUNNING
                self.execution.items_left -= 1
                self._start_item()
            run(child)
            if child.status is Status.RUNNING:
                return Status.RUNNING
            failed = child.status is Status.FAILURE
            self.left_out += child.skipped and not failed
            self._item_ended(self.execution.trace(self.child).failure if failed else None)
            if failed and not self.loop.skip_failures:
                return self.execution.propagate_failure(self, self.child, self._item())
            if failed:
                self._ignore_failure()
            self.index += 1
        if self.items and self.left_out == len(self.items):
            return self.skip()
        return Status.SUCCESS

    def _item_ended(self, failure: Failure | None) -> None:
        """Called when an item has ended, with its failure if it failed."""

    def _ignore_failure(self) -> None:
        self.execution.ignore_failure(self, self.child, self._item())

    def _start_item(self) -> None:
        halt(self.child)
        self.loop.write(self.items[self.index])
        self.feedback_message = f"{self._item()}, {self.index + 1} of {len(self.items)}"

    def _item(self) -> str:
        return f"{self.loop.variable} = {self.execution.describe(self.items[self.index])}"


@dataclass(frozen=True, slots=True)
class Loop:
    """The loop of a ForEach: source of the items and writer of the loop variable."""

    variable: str
    items: Callable[[], list[Any]]
    write: Callable[[Any], None]
    skip_failures: bool


@dataclass(frozen=True, slots=True)
class ForEachStep(Step):
    """`for_each: {variable: items}` with `do`; `skip_failures` is `on_failure: continue`."""

    variable: Symbol
    items: Value
    skip_failures: bool
    child: Step

    order = Order.REPEATED
    starts_again = True

    def children(self) -> tuple[Step, ...]:
        return (self.child,)

    def reads(self) -> Iterator[Value]:
        yield self.items

    def writes(self) -> tuple[Symbol, ...]:
        return ()

    def binds(self, inputs: Mapping[str, Symbol]) -> Iterator[tuple[Symbol, Value]]:
        yield self.variable, self.items

    def variables(self) -> tuple[Symbol, ...]:
        return (self.variable,)

    @property
    def survives_failure(self) -> bool:
        return self.skip_failures

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        ends = children[0]
        return Outcomes(True, ends.failure and not self.skip_failures, ends.skip)

    def least_time(self, children: Sequence[float]) -> float:
        items = self.items.value if isinstance(self.items, Constant) else ()
        return 0.0 if self.skip_failures else len(items) * children[0]

    def takes_time(self, children: Sequence[bool]) -> bool:
        none = isinstance(self.items, Constant) and not self.items.value
        return children[0] and not none

    @property
    def detail(self) -> str:
        return f"{self.variable.name} in {self.items.source}"

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        inside, slot = frame.with_slot(self.variable)
        child = builder.step(self.child, inside)
        return ForEach(
            self.name or self.kind, child, builder.execution, self.loop(frame, slot.write)
        )

    def loop(self, frame: Frame, write: Callable[[Any], None]) -> Loop:
        """Return the loop of its node; `write` receives the items."""
        return Loop(self.variable.name, frame.value(self.items), write, self.skip_failures)

    def problems(self) -> Iterator[Finding]:
        if isinstance(self.items, Constant) and not self.items.value and self.items.is_written:
            sentence = f"the list of {self.kind} is empty: nothing runs"
            mark = self.items.mark or self.mark
            yield Finding(mark, "W133", sentence, "add items, or remove the node")


def _read(reader: NodeReading, written: Written, context: NameContext) -> Step | None:
    head, body, raw = written.head, written.body, written.raw
    entries = body.entries if body else []
    if len(entries) != 1 or not IDENTIFIER.fullmatch(str(entries[0][0].value)):
        mark = body.mark if body else head.mark
        sentence = "for_each needs one variable and its list: {shelf: $shelves}"
        reader.findings.add("E124", mark, sentence, _hint(body))
        reader.skim(value_in(raw, "do"), context)
        return None
    key, node = entries[0]
    reader.values.words.add(key, WordRole.DECLARED, context.scope, "for_each")
    items, kind = reader.values.items(str(key.value), node, context)
    symbol = Symbol(str(key.value), Role.VARIABLE, kind, key.mark)
    reader.warn_of_hiding(symbol, context)
    inside = replace(context, scope=context.scope.inside({symbol.name: symbol}))
    child = reader.child(raw.get("do"), head, inside)
    if items is None or child is None:
        return None
    return ForEachStep(*head, symbol, items, keeps_going(raw), child)


def _hint(body: YamlNode | None) -> str:
    """Return how to write what stands below `for_each:`."""
    if body is not None and body.is_sequence:
        return f"write {{item: {text_of(body)}}}"
    words = [str(key.value) for key, _ in body.entries] if body is not None else []
    if "do" in words:
        return "write `do:` beside `for_each:`, not below it"
    if len(words) == 1 and words[0].startswith("$"):
        return f"write the name of the variable without $: {words[0][1:]}"
    return "write several lists as nested loops" if len(words) > 1 else "write {shelf: […]}"


FOR_EACH = NodeKind(
    "for_each",
    "`do` once per item: `{for_each: {shelf: $shelves}, do: …}`; with "
    "`on_failure: continue` it continues after an item that fails",
    Shape.LOOP, "∀", Outline.HEXAGON, ForEach, "{for_each: {n: [1, 2]}, do: {say: a}}",
    keeps="the list and the current item", empty="the list was empty",
    also_known_as=("LoopInt", "LoopDouble", "LoopString"), read=_read, step=ForEachStep,
)  # fmt: skip
