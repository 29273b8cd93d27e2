"""Order of writes and reads: keys read without a value, conditions that nothing can change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from missions.language.analysis.conditions import (
    CHECK,
    LIMITED_WAIT,
    WAIT,
    KnownValues,
    Verdicts,
)
from missions.language.analysis.data_flow import Written, once_per_step, steps_below
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Role, Symbol
from missions.language.step import Event, Order, Step, Tree
from missions.language.values import Constant, Value
from stack.documents import Findings, Mark


@dataclass(frozen=True)
class _Place:
    """Where the walk is.

    Attributes:
        later: keys that may be written when this node runs again, in a loop around it.
        is_certain: a failed read here ends the loop before anything else of it can run.
        inputs: `in` of the trees around it -> what it is bound to.
        attempts: most attempts of the innermost retry or recover; None if not known.
        is_limited: a `timeout` or `while` around it ends it, even if it waits forever.
        repaired: keys that `finally` or a recovery may write after a failed run, before the next.
        meanwhile: keys that events, and other children of a parallel, may write at any time.
    """

    later: Written = field(default_factory=dict)
    is_certain: bool = True
    inputs: Mapping[Symbol, Value] = field(default_factory=dict)
    attempts: int | None = None
    is_limited: bool = False
    repaired: Written = field(default_factory=dict)
    meanwhile: Written = field(default_factory=dict)


class OrderCheck:
    """Walks the tree in the order of its first tick.

    `written` collects the keys that may have been written so far; `unset` takes a key out again on
    the ways that certainly lead through it. After an expression has tested a
    key with `is set`, reads of this key are not reported. A node in a loop may also read what the
    loop writes later, unless it is certain that its first run fails and ends the loop.
    """

    def __init__(
        self, trees: Mapping[str, Tree], findings: Findings, changed: Sequence[Symbol] = ()
    ) -> None:
        """Create the check; `changed` are keys that tests change from outside the tree."""
        self.trees, self.findings = trees, findings
        self.changed: Written = dict.fromkeys(changed)
        self.verdicts = Verdicts(findings)
        self.memory: dict[tuple[str, int], Any] = {}
        self.place = _Place()
        self.unset_at: dict[Symbol, Mark] = {}

    def mission(self, root: Step, events: Sequence[Event]) -> None:
        """Check the mission and its events; an event can run at any time, after any write."""
        self._below_events(root, events, {})
        self.verdicts.report()

    def _below_events(self, root: Step, events: Sequence[Event], written: Written) -> None:
        """Check a node with the events above it; an event can run at any time."""
        by_events: Written = {}
        for event in events:
            by_events.update(self.writes(event.step))
        written.update(by_events)
        meanwhile = {**self.place.meanwhile, **by_events}
        everything = {**written, **self.writes(root)} if events else {}
        again = everything if any(event.then == "restart" for event in events) else {}
        with self._at(later={**self.place.later, **again}, meanwhile=meanwhile):
            self.step(root, written)
        for event in events:
            found = dict(everything)
            self.note("event", event.when, f"the event {event.name!r}", event.mark, found)
            self.expression(event.when, event.mark, found)
            for value in (event.hold, event.again):
                self.value(value, event.mark, found)
            with self._at(meanwhile=meanwhile):
                self.step(event.step, found)

    def step(self, step: Step, written: Written) -> None:
        """Check a step with its modifiers."""
        before, modifiers = dict(written), step.modifiers
        name = step.title
        for word, condition in (("when", modifiers.when), ("while", modifiers.while_)):
            if condition is not None:
                self.note(word, condition, name, step.mark, written)
                self.expression(condition, step.mark, written)
        retry, recover = modifiers.retry, modifiers.recover
        attempts = retry.attempts if retry else None
        values = [modifiers.repeat, modifiers.timeout, modifiers.every, attempts]
        for value in (*values, recover.attempts if recover else None):
            self.value(value, step.mark, written)
        certain = modifiers.when is None and not modifiers.keep_going
        place = replace(self.place, is_certain=self.place.is_certain and certain)
        if _runs_again(step):
            place = replace(
                place, later={**place.later, **self.writes(step)},
                repaired={**place.repaired, **self.repairs(step)},
            )  # fmt: skip
        if modifiers.recover or modifiers.retry:
            most = recover.attempts if recover else attempts
            place = replace(place, attempts=_most(most))
        if modifiers.timeout or modifiers.while_:
            place = replace(place, is_limited=True)
        with self._at(**vars(place)):
            self.body(step, written)
            self.after(step, written, before)
        if modifiers.finally_:
            with self._at(is_certain=False):
                self._after_failure(modifiers.finally_, written, before)
        if not certain or modifiers.invert:
            written.update(before)  # what is unset inside may not have been

    def _after_failure(self, step: Step, written: Written, before: Written) -> None:
        """Check a step that runs after a node that may have failed before it unset anything."""
        seen = {**before, **written}
        at_entry = dict(seen)
        self.step(step, seen)
        written.update((symbol, None) for symbol in seen if symbol not in at_entry)
        written.update(self.writes(step))

    def after(self, step: Step, written: Written, before: Written) -> None:
        """Check what is evaluated after the node itself: `until`, the delay, the recoveries."""
        modifiers = step.modifiers
        if modifiers.until:
            self.note("until", modifiers.until, step.title, step.mark, written)
            self.expression(modifiers.until, step.mark, written)
        if modifiers.retry:
            with self._at(is_certain=False):
                self.value(modifiers.retry.delay, step.mark, {**before, **written})
        if modifiers.recover:
            self.recover(step, written, before)

    def recover(self, step: Step, written: Written, before: Written) -> None:
        """Check `unless` and the recoveries; they run after all but the last attempt."""
        recover = step.modifiers.recover
        assert recover is not None
        most = self.place.attempts
        failed = None if most is None else max(1, most - 1)
        with self._at(attempts=failed, is_certain=False):
            if recover.unless:
                seen = {**before, **written}
                self.note("unless", recover.unless, step.title, step.mark, seen)
                self.expression(recover.unless, step.mark, seen)
                written.update(dict.fromkeys(recover.unless.tested.values()))
            for recovery in recover.recoveries:
                self._after_failure(recovery, written, before)

    def body(self, step: Step, written: Written) -> None:
        """Check a step without its modifiers."""
        for condition in step.conditions():
            self.note(_word_of(step), condition, step.title, step.mark, written)
        for value in step.reads():
            self.value(value, step.mark, written)
        if step.uses:
            self.use(step, written)
            return
        written.update(dict.fromkeys(step.writes()))
        self._unset(step, written)
        self._children(step, written)

    def _unset(self, step: Step, written: Written) -> None:
        for symbol in step.unsets():
            if symbol not in self.place.meanwhile:
                written.pop(symbol, None)
                self.unset_at[symbol] = step.mark

    def _possible(self, step: Step, written: Written) -> None:
        """Check a step that may not run, or fail, before what follows it runs."""
        before = dict(written)
        self.step(step, written)
        written.update(before)

    def _children(self, step: Step, written: Written) -> None:
        """Check the children in order; of several at once each may read what any other writes."""
        meanwhile = self.place.meanwhile
        if step.order is Order.TOGETHER:
            for child in step.children():
                written.update(self.writes(child))
            meanwhile = {**meanwhile, **written}
        check = self.step if step.order is Order.AFTER_SUCCESS else self._possible
        certain = self.place.is_certain and not step.survives_failure
        with self._at(is_certain=certain, meanwhile=meanwhile):
            for child in step.children():
                check(child, written)

    def use(self, step: Step, written: Written) -> None:
        """Check a used tree in place of the `use`; its outputs are the keys they are bound to."""
        tree, targets = self.trees[step.uses], step.results()
        inside = dict(written)
        for name, symbol in tree.outputs.items():
            target = targets.get(name)
            inside.pop(symbol, None)
            if target is not None and has_value(target, written):
                inside[symbol] = None
        bound = dict(step.binds(tree.inputs))
        if tree.root:
            with self._at(inputs={**self.place.inputs, **bound}):
                self._below_events(tree.root, tree.events, inside)
        for name, symbol in tree.outputs.items():
            if inside.pop(symbol, symbol) is None and name in targets:
                inside[targets[name]] = None
        for symbol in [symbol for symbol in written if symbol not in inside]:
            del written[symbol]  # the tree unsets it
        written.update(inside)

    @once_per_step
    def writes(self, step: Step) -> Written:
        """Return every key that a step may write."""
        found: Written = dict.fromkeys(step.writes())
        for child in steps_below(step, self.trees):
            found.update(self.writes(child))
        return found

    @once_per_step
    def repairs(self, step: Step) -> Written:
        """Return the keys that `finally` and the recoveries in a step may write."""
        found: Written = {}
        recover, last = step.modifiers.recover, step.modifiers.finally_
        for after_failure in (*(recover.recoveries if recover else ()), *((last,) if last else ())):
            found.update(self.writes(after_failure))
        for child in steps_below(step, self.trees):
            found.update(self.repairs(child))
        return found

    def value(self, value: Value | None, mark: Mark, written: Written) -> None:
        """Check the reads of a port value, and record the writes of `set`."""
        if value is None:
            return
        for item in value.reads():
            if isinstance(item, Symbol):
                self.read(item, mark, written)
            else:
                self.expression(item, mark, written)
        written.update(dict.fromkeys(value.writes()))

    def expression(self, expression: CheckedExpression, mark: Mark, written: Written) -> None:
        """Check the reads of an expression; a key tested with `is set` needs no value."""
        written.update(dict.fromkeys(expression.tested.values()))
        for symbol in expression.read.values():
            self.read(symbol, mark, written)

    def read(self, symbol: Symbol, mark: Mark, written: Written) -> None:
        """Check the read of a symbol."""
        if has_value(symbol, written):
            return
        place = self.place
        if symbol in place.repaired or (symbol in place.later and not place.is_certain):
            return
        sentence = f"${symbol.name} is read here, but nothing can have written it before"
        if symbol in self.unset_at:
            line = self.unset_at[symbol].line
            sentence = f"${symbol.name} is read here, but line {line} unsets it, and nothing can "
            sentence += "have written it since"
        hint = "give it an initial value, or test `is set` first"
        self.findings.add("E143", mark, sentence, hint)

    def note(
        self, word: str, condition: CheckedExpression, owner: str, mark: Mark, written: Written
    ) -> None:
        """Record the possible values of a condition at this place."""
        place = self.place
        later = {**place.later, **self.changed}
        known = KnownValues(written, later, place.inputs, place.attempts, self.unset_at)
        if word == WAIT and place.is_limited:
            word = LIMITED_WAIT
        self.verdicts.note(word, condition, owner, mark, known)

    @contextmanager
    def _at(self, **changes: Any) -> Iterator[None]:
        before, self.place = self.place, replace(self.place, **changes)
        yield
        self.place = before


def _runs_again(step: Step) -> bool:
    modifiers = step.modifiers
    return bool(modifiers.repeat or modifiers.retry or modifiers.recover or step.starts_again)


def _word_of(step: Step) -> str:
    """Return how a node evaluates its conditions: once, or until they are true."""
    return CHECK if step.ends_at_once else WAIT if step.waits else step.kind


def _most(attempts: Value | None) -> int | None:
    if isinstance(attempts, Constant) and not attempts.text.startswith("$"):
        return int(attempts.value)
    return None


def has_value(symbol: Symbol, written: Written) -> bool:
    """Return whether a symbol may have a value after these writes."""
    if symbol.role is Role.KEY:
        return symbol.value is not UNSET or symbol.keep or symbol in written
    return symbol.role is not Role.OUTPUT or symbol in written
