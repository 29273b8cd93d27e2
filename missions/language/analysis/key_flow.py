"""Keys: only read, only written, written twice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from missions.language.analysis.claims import steps_of
from missions.language.analysis.order import OrderCheck, name_of
from missions.language.case_model import Case
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.terms import Reference as Named
from missions.language.model import (
    AssignmentList,
    Composite,
    Computed,
    Event,
    ExpressionValue,
    FollowWaypoints,
    ForEach,
    Leaf,
    ListValue,
    Reference,
    Step,
    Switch,
    Template,
    Use,
    Value,
)
from stack.documents import Findings


class KeyFlowCheck:
    """Collects who reads and who writes each key, over run, events and trees."""

    def __init__(self, findings: Findings, order: OrderCheck) -> None:
        self.findings, self.order = findings, order
        self.read: set[Symbol] = set()
        self.variables: list[Symbol] = []
        self.written: dict[Symbol, Step] = {}
        self.results: set[Symbol] = set()

    def mission(self, roots: Sequence[Step], events: Sequence[Event]) -> None:
        """Check the nodes of run, events and trees."""
        for event in events:
            self.read.update(event.when.read.values(), event.when.tested.values())
            self.read.update((*read_by(event.hold), *read_by(event.again)))
        for root in roots:
            for step in steps_of(root):
                self._step(step)
        for variable in self.variables:
            self._variable(variable)

    def keys(self, keys: Mapping[str, Symbol], cases: Sequence[Case]) -> None:
        """Report keys that are only read, or only written by `set`.

        Test cases read and write keys, too. The results of `out` are shown by the report.
        """
        expected = {name for case in cases for name in case.expect.keys}
        changed = keys_changed_by(cases)
        for key in keys.values():
            reads = key in self.read or key.name in expected
            self._one_sided(key, reads, writes=key in self.written or key.name in changed)

    def _one_sided(self, key: Symbol, reads: bool, *, writes: bool) -> None:
        if writes and not reads and not key.doc and key not in self.results:
            sentence = f"the key {key.name!r} is written, but nothing reads it"
            hint = "remove it; if it is for the report, describe it: `doc: …`"
            self.findings.warning("W129", key.mark, sentence, hint)
        elif reads and not writes and key.value is not UNSET:
            sentence = f"the key {key.name!r} is read, but nothing writes it"
            hint = "write it with `set` or `out`, or make it an argument"
            self.findings.warning("W129", key.mark, sentence, hint)
        elif reads and not writes:
            sentence = f"the key {key.name!r} never has a value: nothing writes it"
            hint = f"write it with `set`, or with `out: {{…: ${key.name}}}`"
            self.findings.warning("W129", key.mark, sentence, hint)

    def _step(self, step: Step) -> None:
        self.read.update(_read_for_others(step))
        if isinstance(step, ForEach) and not isinstance(step, FollowWaypoints):
            self.variables.append(step.variable)
        if isinstance(step, Leaf | Use | FollowWaypoints):
            self._outputs(step, step.outputs)
        if isinstance(step, Leaf | Use | FollowWaypoints):
            self.results.update(step.outputs.values())
        for symbol in own_writes(step):
            self.written.setdefault(symbol, step)
        if isinstance(step, Composite) and step.kind == "sequence":
            self._overwritten(step)
        elif isinstance(step, Composite) and step.kind == "parallel":
            self._at_once(step)
        self._to_itself(step)

    def _variable(self, variable: Symbol) -> None:
        if variable not in self.read:
            sentence = f"the loop variable {variable.name!r} is never used: each run does the same"
            hint = f"write ${variable.name} in the node under `do`, or use `repeat`"
            self.findings.warning("W102", variable.mark, sentence, hint)

    def _outputs(self, step: Step, outputs: Mapping[str, Symbol]) -> None:
        names: dict[Symbol, str] = {}
        for name, symbol in outputs.items():
            if symbol in names:
                first = names[symbol]
                sentence = f"{first} and {name} of {name_of(step)} both go to ${symbol.name}"
                hint = "use a key for each output"
                self.findings.error("E168", step.mark, sentence, hint)
            names[symbol] = name

    def _overwritten(self, step: Composite) -> None:
        """Report a key that the next child overwrites before anything can have read it."""
        for first, second in zip(step.children, step.children[1:], strict=False):
            if not isinstance(second, Leaf | FollowWaypoints) or second.modifiers.when is not None:
                continue
            if not isinstance(first, Leaf | FollowWaypoints) or first.modifiers.when is not None:
                continue
            lost = own_writes(first) & own_writes(second) - set(reads_of(second))
            for symbol in sorted(lost, key=lambda item: item.name):
                sentence = f"${symbol.name} of line {first.mark.line} is overwritten here "
                sentence += "before anything reads it"
                hint = "use another key, or remove one of them"
                self.findings.warning("W130", second.mark, sentence, hint)

    def _at_once(self, step: Composite) -> None:
        """Report children of a parallel that write the same key."""
        first: dict[Symbol, Step] = {}
        for child in step.children:
            for symbol in self.order.writes(child):
                other = first.setdefault(symbol, child)
                if other is not child:
                    sentence = f"{name_of(child)} and {name_of(other)} (line {other.mark.line}) "
                    sentence += f"both write ${symbol.name}: the later one wins"
                    hint = "use a key for each child"
                    self.findings.warning("W130", child.mark, sentence, hint)

    def _to_itself(self, step: Step) -> None:
        for value in step.ports.values() if isinstance(step, Leaf) else ():
            for symbol, expression in assignments_of(value):
                term = expression.term
                if isinstance(term, Named) and expression.read.get(term.name) is symbol:
                    sentence = f"${symbol.name} is set to itself"
                    mark = expression.mark or step.mark
                    self.findings.warning("W130", mark, sentence, "write the new value")


def keys_changed_by(cases: Sequence[Case]) -> set[str]:
    """Return the names of the keys that `at` of a test case writes."""
    return {item.name for case in cases for item in case.changes if item.kind == "key"}


def assignments_of(value: Value) -> tuple[tuple[Symbol, CheckedExpression], ...]:
    """Return the assignments of a port value."""
    return value.assignments if isinstance(value, AssignmentList) else ()


def own_writes(step: Step) -> set[Symbol]:
    """Return the symbols that a node itself writes, without its children and tree."""
    found: set[Symbol] = set()
    if isinstance(step, Leaf | Use | FollowWaypoints):
        found.update(step.outputs.values())
    for value in step.ports.values() if isinstance(step, Leaf) else ():
        found.update(symbol for symbol, _ in assignments_of(value))
    return found


def _conditions_of(step: Step) -> Iterator[Symbol]:
    """Yield the symbols in the conditions of a node and in the value of a `switch`."""
    modifiers = step.modifiers
    unless = modifiers.recover.unless if modifiers.recover else None
    choice = step.value if isinstance(step, Switch) else None
    for condition in (modifiers.when, modifiers.while_, modifiers.until, unless, choice):
        if condition is not None:
            yield from (*condition.read.values(), *condition.tested.values())


def reads_of(step: Step) -> Iterator[Symbol]:
    """Yield the symbols that a node itself reads."""
    yield from _conditions_of(step)
    modifiers = step.modifiers
    values: list[Value | None] = [modifiers.repeat, modifiers.timeout, modifiers.every]
    if modifiers.retry:
        values += (modifiers.retry.attempts, modifiers.retry.delay)
    if modifiers.recover:
        values.append(modifiers.recover.attempts)
    if isinstance(step, Leaf):
        values += step.ports.values()
    elif isinstance(step, Use):
        values += step.inputs.values()
    elif isinstance(step, ForEach):
        values.append(step.items)
    for value in values:
        yield from read_by(value)


def _read_for_others(step: Step) -> set[Symbol]:
    """Return the symbols that a node reads; `n: $n + 1` alone does not count as reading n."""
    found = set(reads_of(step))
    for value in step.ports.values() if isinstance(step, Leaf) else ():
        if isinstance(value, AssignmentList):
            pairs = value.assignments
            own = {symbol for symbol, expression in pairs if symbol in expression.read.values()}
            others = {
                item for symbol, expression in pairs for item in expression.read.values()
                if item is not symbol
            }  # fmt: skip
            found -= own - others
    return found.union(_conditions_of(step))


def read_by(value: Value | None) -> Iterator[Symbol]:
    """Yield the symbols that a port value reads."""
    if isinstance(value, Reference):
        yield value.symbol
    elif isinstance(value, ListValue):
        for item in value.items:
            yield from read_by(item)
    expressions: tuple[CheckedExpression, ...] = ()
    if isinstance(value, ExpressionValue | Computed):
        expressions = (value.expression,)
    elif isinstance(value, Template):
        expressions = value.expressions
    elif isinstance(value, AssignmentList):
        expressions = tuple(expression for _, expression in value.assignments)
    for expression in expressions:
        yield from (*expression.read.values(), *expression.tested.values())
