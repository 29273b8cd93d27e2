"""How nodes can end, and what follows: children never reached, retries for nothing, idle events.

Everything here errs on the side of saying nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from py_trees import behaviours as py_trees_behaviours

from missions.language.analysis.data_flow import children_of, moves
from missions.language.analysis.intervals import truths
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.model import (
    Composite,
    Constant,
    Event,
    ExpressionValue,
    ForEach,
    Leaf,
    Reference,
    Step,
    Template,
    Tree,
    Use,
    Value,
)
from stack.documents import Findings


@dataclass(frozen=True, slots=True)
class Ends:
    """The ways in which a node can end; neither means that it never ends."""

    success: bool = True
    failure: bool = True


_PLAIN: dict[type, Ends] = {
    py_trees_behaviours.Success: Ends(failure=False),
    py_trees_behaviours.Failure: Ends(success=False),
    py_trees_behaviours.Running: Ends(False, False),
}
_LOOKS = {"sequence": True, "reactive": True, "fallback": False, "reactive_fallback": False}
"""Composites that go from child to child -> whether they go on after a success."""


class OutcomeCheck:
    """Reports what cannot happen as it is written."""

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings = trees, findings
        self.known: dict[tuple[int, bool], Ends] = {}

    def step(self, step: Step) -> None:
        """Everything about one step and those below it; used trees are looked at by themselves."""
        self._conditions(step)
        self._retries(step)
        if isinstance(step, Composite) and step.kind in _LOOKS:
            self._reached(step, goes_on_after=_LOOKS[step.kind])
            if step.kind == "reactive":
                self._restarted(step)
        elif isinstance(step, Composite) and step.kind == "parallel":
            self._wheels(step)
        for child in children_of(step):
            self.step(child)

    def events(self, events: Sequence[Event]) -> None:
        """Events that cannot come."""
        for number, event in enumerate(events):
            if truths(event.when.term) == {False}:
                sentence = f"the event {event.name!r} can never come: {event.when.source} is false"
                self.findings.error("E161", event.when.mark or event.mark, sentence)
            for earlier in events[:number]:
                at_once = isinstance(earlier.hold, Constant) and not earlier.hold.value
                if at_once and _words(earlier.when) == _words(event.when):
                    sentence = f"the event {event.name!r} can never come: {earlier.name!r} comes"
                    self.findings.error(
                        "E161", event.mark, f"{sentence} first, for the same reason"
                    )

    # How nodes end

    def ends(self, step: Step, *, in_fallback: bool = False) -> Ends:
        """How a step with all its modifiers can end."""
        key = (id(step), in_fallback)
        if key not in self.known:
            self.known[key] = Ends()
            self.known[key] = self._ends(step, in_fallback)
        return self.known[key]

    def _ends(self, step: Step, in_fallback: bool) -> Ends:
        given, ends = step.modifiers, self._attempt(step)
        success, failure = ends.success, ends.failure
        if isinstance(given.repeat, Constant) and given.repeat.value is None:
            success = False
        if given.keep_going:
            success, failure = success or failure, False
        if given.while_ is not None:
            failure = True
        if given.when is not None:
            success, failure = (success, True) if in_fallback else (True, failure)
        return Ends(success, failure)

    def _attempt(self, step: Step) -> Ends:
        """How one attempt can end: the step with its time limit only."""
        ends = self._body(step)
        if step.modifiers.timeout is not None:
            return Ends(ends.success, True)
        return ends

    def _body(self, step: Step) -> Ends:
        if isinstance(step, Leaf):
            return _leaf_ends(step)
        if isinstance(step, Use):
            root = self.trees[step.tree].root
            return self.ends(root) if root else Ends()
        if isinstance(step, ForEach):
            return Ends(True, self.ends(step.child).failure and not step.skip_failures)
        if isinstance(step, Composite):
            return self._composite(step)
        return Ends()

    def _composite(self, step: Composite) -> Ends:
        in_fallback = step.kind not in ("sequence", "reactive", "parallel")
        ends = [self.ends(child, in_fallback=in_fallback) for child in step.children]
        succeed = [item.success for item in ends]
        fail = [item.failure for item in ends]
        if step.kind == "parallel":
            spare = len(ends) - step.needed
            return Ends(sum(succeed) >= step.needed, sum(fail) > spare)
        if in_fallback:
            return Ends(any(succeed), all(fail))
        return Ends(all(succeed), any(fail))

    # What follows from it

    def _reached(self, step: Composite, goes_on_after: bool) -> None:
        for before, after in zip(step.children, step.children[1:], strict=False):
            ends = self.ends(before, in_fallback=not goes_on_after)
            if not (ends.success if goes_on_after else ends.failure):
                word = "succeeds" if goes_on_after else "fails"
                if not ends.success and not ends.failure:
                    word = "ends"
                sentence = f"never reached: {_name(before)} of line {before.mark.line} never {word}"
                self.findings.error("E160", after.mark, sentence)
                return

    def _retries(self, step: Step) -> None:
        given = step.modifiers
        body, attempt = self._body(step), self._attempt(step)
        for word, there in (("retry", given.retry), ("recover", given.recover)):
            if there and not attempt.failure:
                sentence = f"`{word}` is for nothing: {_name(step)} cannot fail"
                self.findings.warning("W108", step.mark, sentence)
        if given.keep_going and not attempt.failure:
            sentence = f"`on_failure` is for nothing: {_name(step)} cannot fail"
            self.findings.warning("W108", step.mark, sentence)
        if given.every is None:
            return
        counted = given.repeat is not None and not self._is_endless(step)
        if counted and body.success:
            sentence = "`repeat` counts the results that `every` keeps"
            self.findings.warning("W109", step.mark, sentence, "put one of them on a node inside")
        if given.retry and body.failure:
            sentence = "`retry` counts the results that `every` keeps"
            self.findings.warning("W109", step.mark, sentence, "put one of them on a node inside")

    def _is_endless(self, step: Step) -> bool:
        repeat = step.modifiers.repeat
        return isinstance(repeat, Constant) and repeat.value is None

    def _conditions(self, step: Step) -> None:
        given = [step.modifiers.when, step.modifiers.while_]
        if step.modifiers.recover:
            given.append(step.modifiers.recover.unless)
        if isinstance(step, Leaf):
            given += [
                item.expression for item in step.ports.values() if isinstance(item, ExpressionValue)
            ]
        for condition in given:
            outcome = truths(condition.term) if condition and condition.type.of is bool else ()
            if condition and len(outcome) == 1:
                word = "true" if True in outcome else "false"
                mark = condition.mark or step.mark
                self.findings.warning("W107", mark, f"{condition.source} is always {word}")

    def _restarted(self, step: Composite) -> None:
        for child in step.children[:-1]:
            if self.takes_time(child):
                sentence = f"{_name(child)} starts again on every tick once it has succeeded"
                hint = "use a sequence, or move it to the end"
                self.findings.warning("W106", child.mark, sentence, hint)

    def takes_time(self, step: Step) -> bool:
        """Whether a step that succeeds surely was more than a look: it needed ticks, or failed."""
        given = step.modifiers
        if given.when is not None or given.every is not None:
            return False
        if isinstance(step, Leaf):
            return bool(
                getattr(step.behaviour.cls, "uses_wheels", False)
                or getattr(step.behaviour.cls, "takes_time", False)
            )
        if isinstance(step, Use):
            root = self.trees[step.tree].root
            return root is not None and self.takes_time(root)
        if isinstance(step, ForEach):
            none = isinstance(step.items, Constant) and not step.items.value
            return not none and self.takes_time(step.child)
        if isinstance(step, Composite):
            found = [self.takes_time(child) for child in step.children]
            if step.kind == "parallel":
                return len(found) - sum(found) < step.needed
            return any(found) if step.kind in ("sequence", "reactive") else all(found)
        return False

    def _wheels(self, step: Composite) -> None:
        """Two children of a parallel at the wheel: for sure, or perhaps."""
        drivers = [child for child in step.children if moves(child, self.trees)]
        at_once = [child for child in drivers if self.begins_to_move(child)]
        if len(at_once) > 1:
            first, second = at_once[:2]
            sentence = f"{_name(second)} moves the robot at the same time as {_name(first)} of line"
            self.findings.error("E162", second.mark, f"{sentence} {first.mark.line}")
        elif len(drivers) > 1:
            first, second = drivers[:2]
            sentence = f"{_name(second)} moves the robot, and so does {_name(first)} of line"
            self.findings.warning("W105", second.mark, f"{sentence} {first.mark.line}")

    def begins_to_move(self, step: Step) -> bool:
        """Whether the first thing a step does is to move the robot."""
        if step.modifiers.when is not None:
            return False
        if isinstance(step, Leaf):
            return moves(step, self.trees)
        if isinstance(step, Use):
            root = self.trees[step.tree].root
            return root is not None and self.begins_to_move(root)
        if isinstance(step, Composite) and step.kind != "parallel" and step.children:
            return self.begins_to_move(step.children[0])
        return any(self.begins_to_move(child) for child in children_of(step)[:1])


def _leaf_ends(step: Leaf) -> Ends:
    found = _PLAIN.get(step.behaviour.cls)
    if found is not None:
        return found
    formulas = [
        item.expression for item in step.ports.values() if isinstance(item, ExpressionValue)
    ]
    outcomes = [truths(item.term) for item in formulas if item.type.of is bool]
    can_fail = bool(getattr(step.behaviour.cls, "can_fail", True))
    if not can_fail:
        read = [item for value in step.ports.values() for item in _expressions(value)]
        can_fail = any(map(_may_break, read)) or any(map(_may_be_missing, step.ports.values()))
    never_true = step.kind in ("check", "wait_until") and {False} in outcomes
    always_true = step.kind == "check" and {True} in outcomes
    return Ends(not never_true, can_fail and not always_true)


def _expressions(value: Value) -> tuple[CheckedExpression, ...]:
    if isinstance(value, Template):
        return value.expressions
    return (value.expression,) if isinstance(value, ExpressionValue) else ()


def _may_be_missing(value: Value) -> bool:
    return isinstance(value, Reference) and _may_be_unset(value.symbol)


def _may_break(expression: CheckedExpression) -> bool:
    """Whether reading it can fail: a key that may not be set, or a division."""
    return "/" in expression.source or any(map(_may_be_unset, expression.read.values()))


def _may_be_unset(symbol: Symbol) -> bool:
    return symbol.is_writable and symbol.value is UNSET


def _words(expression: CheckedExpression) -> str:
    return "".join(expression.source.split())


def _name(step: Step) -> str:
    return step.name or (step.tree if isinstance(step, Use) else step.kind)
