"""Possible outcomes of nodes: reports unreachable children, useless retries, impossible events.

The analysis is conservative: a finding is reported only if it is certain.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from py_trees import behaviours as py_trees_behaviours

from missions.language.analysis.data_flow import children_of, once_per_step
from missions.language.analysis.intervals import conjuncts, exclude_each_other, truth_values
from missions.language.analysis.ranges import range_hint
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.kinds import CONDITIONS, NODES
from missions.language.model import (
    Composite,
    Computed,
    Constant,
    ExpressionValue,
    ForEach,
    Leaf,
    ListValue,
    Reference,
    Step,
    Switch,
    Template,
    Tree,
    Unset,
    Use,
    Value,
)
from stack.documents import Findings


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The possible outcomes of a node; none at all means that it never ends."""

    success: bool = True
    failure: bool = True
    skip: bool = False

    def go_on_after(self, outcome: str) -> bool:
        """Return whether the next child may run, if it does after "success" or "failure"."""
        return self.skip or (self.success if outcome == "success" else self.failure)


_PLAIN: dict[type, Outcomes] = {
    py_trees_behaviours.Success: Outcomes(failure=False),
    py_trees_behaviours.Failure: Outcomes(success=False),
    py_trees_behaviours.Running: Outcomes(False, False),
}


class OutcomeCheck:
    """Reports nodes, retries and events that have no effect."""

    def __init__(
        self, trees: Mapping[str, Tree], findings: Findings, dead: Collection[int] = ()
    ) -> None:
        self.trees, self.findings, self.dead = trees, findings, dead
        self.known: dict[int, Outcomes] = {}
        self.memory: dict[tuple[str, int], Any] = {}

    def step(self, step: Step) -> None:
        """Check a step and its children; used trees are checked separately."""
        self._retries(step)
        if isinstance(step, Composite) and NODES[step.kind].goes_on_after:
            self._reached(step, NODES[step.kind].goes_on_after)
            if step.kind == "reactive":
                self._restarted(step)
        elif isinstance(step, Composite) and step.kind == "parallel":
            self._wheels(step)
        for child in children_of(step):
            self.step(child)

    # Possible outcomes

    def outcomes(self, step: Step) -> Outcomes:
        """Return the possible outcomes of a step with all its modifiers."""
        key = id(step)
        if key not in self.known:
            self.known[key] = Outcomes()
            self.known[key] = self._outcomes(step)
        return self.known[key]

    def _outcomes(self, step: Step) -> Outcomes:
        modifiers, ends = step.modifiers, self._before_on_failure(step)
        success, failure = ends.success, ends.failure
        if modifiers.keep_going:
            success, failure = success or failure, False
        if modifiers.finally_ is not None:
            last = self.outcomes(modifiers.finally_)
            goes_on = last.success or last.skip
            success, failure = success and goes_on, failure or (success and last.failure)
            failure = failure and (goes_on or last.failure)
        return Outcomes(success, failure, ends.skip or modifiers.when is not None)

    def _before_on_failure(self, step: Step) -> Outcomes:
        """Return the possible outcomes of a step with the modifiers inside `on_failure`."""
        modifiers, ends = step.modifiers, self._attempt(step)
        success, failure = ends.success, ends.failure
        if is_endless(step):
            success = False
        if modifiers.until is not None:
            failure = failure or _can_fail_to_evaluate(modifiers.until)
        if modifiers.invert:
            success, failure = failure, success
        return Outcomes(success, failure or modifiers.while_ is not None, ends.skip)

    def _attempt(self, step: Step) -> Outcomes:
        """Return the possible outcomes of one attempt: the step with its timeout only."""
        ends = self._body(step)
        if step.modifiers.timeout is not None:
            return Outcomes(ends.success, True, ends.skip)
        return ends

    def _body(self, step: Step) -> Outcomes:
        if isinstance(step, Leaf):
            return Outcomes(False, False) if self._waits_forever(step) else leaf_outcomes(step)
        if isinstance(step, Use):
            return self._tree(self.trees[step.tree])
        if isinstance(step, ForEach):
            ends = self.outcomes(step.child)
            return Outcomes(True, ends.failure and not step.skip_failures, ends.skip)
        if isinstance(step, Composite):
            return self._composite(step)
        if isinstance(step, Switch):
            found = [self.outcomes(child) for child in step.children]
            return Outcomes(
                any(item.success for item in found),
                step.default is None or any(item.failure for item in found),
                any(item.skip for item in found),
            )
        return Outcomes(failure=False) if isinstance(step, Unset) else Outcomes()

    def _tree(self, tree: Tree) -> Outcomes:
        """Return the possible outcomes of a used tree; an event can end it with its failure."""
        ends = self.outcomes(tree.root) if tree.root else Outcomes()
        events = [self.outcomes(event.step).failure or event.then == "abort"
                  for event in tree.events]  # fmt: skip
        return Outcomes(ends.success, ends.failure or any(events), ends.skip)

    def _waits_forever(self, step: Leaf) -> bool:
        ports = step.ports.values()
        return any(isinstance(v, ExpressionValue) and id(v.expression) in self.dead for v in ports)

    def _composite(self, step: Composite) -> Outcomes:
        ends = [self.outcomes(child) for child in step.children]
        succeed, fail = any(item.success for item in ends), any(item.failure for item in ends)
        skip = all(item.skip for item in ends)
        if NODES[step.kind].handles_failure:
            return Outcomes(succeed, fail and all(end.go_on_after("failure") for end in ends), skip)
        if step.kind == "parallel" and step.needed < len(ends):
            spare = len(ends) - step.needed
            fails = sum(item.failure or item.skip for item in ends) > spare
            return Outcomes(sum(item.success for item in ends) >= step.needed, fails, skip)
        return Outcomes(succeed and all(end.go_on_after("success") for end in ends), fail, skip)

    # Findings

    def _reached(self, step: Composite, outcome: str) -> None:
        for before, after in zip(step.children, step.children[1:], strict=False):
            ends = self.outcomes(before)
            if not ends.go_on_after(outcome):
                word = "succeeds" if outcome == "success" else "fails"
                if not ends.success and not ends.failure:
                    word = "ends"
                sentence = f"never reached: {_name(before)} (line {before.mark.line}) never {word}"
                why, hint = _constant_condition(before)
                hint = hint or self._ways_to_end(before) or "change the order, or remove it"
                sentence += why
                self.findings.error("E160", after.mark, sentence, hint)
                return

    def _ways_to_end(self, step: Step) -> str:
        ports = step.behaviour.ends_by if isinstance(step, Leaf) else ()
        return f"set {', '.join(ports[:-1])} or {ports[-1]}" if ports else ""

    def _retries(self, step: Step) -> None:
        modifiers = step.modifiers
        body, attempt = self._body(step), self._attempt(step)
        for word, modifier in (("retry", modifiers.retry), ("recover", modifiers.recover)):
            if modifier and not attempt.failure:
                sentence = f"`{word}` has no effect: {_name(step)} cannot fail"
                self.findings.warning("W108", step.mark, sentence, f"remove `{word}`")
        if modifiers.keep_going and not self._before_on_failure(step).failure:
            sentence = f"`on_failure` has no effect: {_name(step)} cannot fail"
            self.findings.warning("W108", step.mark, sentence, "remove `on_failure`")
        if modifiers.every is None:
            return
        counted = modifiers.repeat is not None and not is_endless(step)
        if counted and body.success:
            sentence = "`repeat` also counts results that `every` only repeats"
            self.findings.warning("W109", step.mark, sentence, "move one of them to a child node")
        if modifiers.retry and body.failure:
            sentence = "`retry` also counts results that `every` only repeats"
            self.findings.warning("W109", step.mark, sentence, "move one of them to a child node")

    def _restarted(self, step: Composite) -> None:
        for child in step.children[:-1]:
            if self.takes_time(child):
                sentence = f"after its success {_name(child)} starts again on every tick"
                hint = "use a sequence, or make it the last child"
                self.findings.warning("W106", child.mark, sentence, hint)

    @once_per_step
    def takes_time(self, step: Step) -> bool:
        """Return whether a step surely needs more than one tick to succeed."""
        modifiers = step.modifiers
        if modifiers.when is not None or modifiers.every is not None:
            return False
        if isinstance(step, Leaf):
            return step.behaviour.takes_time
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
            return any(found) if NODES[step.kind].goes_on_after == "success" else all(found)
        if isinstance(step, Switch):
            return all(self.takes_time(child) for child in step.children)
        return False

    def _wheels(self, step: Composite) -> None:
        """Report two children of a parallel that both move the robot, certainly or possibly."""
        drivers = [child for child in step.children if self.moves(child)]
        at_once = [child for child in drivers if self.begins_to_move(child)]
        if len(at_once) > 1:
            first, second = at_once[:2]
            sentence = f"{_name(second)} moves the robot at the same time as {_name(first)}"
            hint = "use a sequence"
            self.findings.error("E162", second.mark, f"{sentence} (line {first.mark.line})", hint)
            return
        for number, second in enumerate(drivers):
            first_or_none = next((item for item in drivers[:number] if _both(item, second)), None)
            if first_or_none is not None:
                line = first_or_none.mark.line
                sentence = f"{_name(second)} may move the robot at the same time as "
                sentence += f"{_name(first_or_none)} (line {line})"
                hint = "use a sequence, or conditions that exclude each other"
                self.findings.warning("W105", second.mark, sentence, hint)
                return

    @once_per_step
    def moves(self, step: Step) -> bool:
        """Return whether a step, with the trees it uses, may move the robot."""
        if isinstance(step, Leaf):
            return step.behaviour.uses_wheels
        if isinstance(step, Use):
            if any(self.moves(root) for root in self.trees[step.tree].roots):
                return True
        return any(self.moves(child) for child in children_of(step))

    @once_per_step
    def begins_to_move(self, step: Step) -> bool:
        """Return whether a step moves the robot from its first tick."""
        if step.modifiers.when is not None:
            return False
        if isinstance(step, Leaf):
            return self.moves(step)
        if isinstance(step, Use):
            root = self.trees[step.tree].root
            return root is not None and self.begins_to_move(root)
        if isinstance(step, Composite) and step.kind != "parallel" and step.children:
            return self.begins_to_move(step.children[0])
        if isinstance(step, Switch):
            return all(self.begins_to_move(child) for child in step.children)
        return any(self.begins_to_move(child) for child in children_of(step)[:1])


def _both(first: Step, second: Step) -> bool:
    """Return whether the conditions of two nodes that start together can both be true."""
    one, other = first.modifiers.when, second.modifiers.when
    if one is None or other is None:
        return True
    shared = one.read.keys() & other.read.keys()
    if any(one.read[name] is not other.read[name] for name in shared):
        return True
    return not exclude_each_other([*conjuncts(one.term), *conjuncts(other.term)])


def _constant_condition(step: Step) -> tuple[str, str]:
    """Return why the condition of a check or wait is constant, and a hint; "" if it is not."""
    for value in step.ports.values() if isinstance(step, Leaf) else ():
        if isinstance(value, ExpressionValue) and value.expression.type.of is bool:
            found = truth_values(value.expression.term)
            if len(found) == 1:
                word = "true" if True in found else "false"
                why = f": {value.expression.source} is always {word}"
                return why, range_hint(value.expression)
    return "", ""


def leaf_outcomes(step: Leaf) -> Outcomes:
    """Return the possible outcomes of a behaviour with its ports."""
    if step.kind == "fail":
        return Outcomes(success=False)
    found = _PLAIN.get(step.behaviour.cls)
    if found is not None:
        return found
    conditions = [
        item.expression for item in step.ports.values() if isinstance(item, ExpressionValue)
    ]
    outcomes = [truth_values(item.term) for item in conditions if item.type.of is bool]
    can_fail = step.behaviour.can_fail
    if not can_fail:
        expressions = [item for value in step.ports.values() for item in _expressions(value)]
        can_fail = any(map(_can_fail_to_evaluate, expressions)) or any(
            map(_may_be_missing, step.ports.values())
        )
    never_true = step.kind in CONDITIONS and {False} in outcomes
    always_true = step.kind == "check" and {True} in outcomes
    return Outcomes(not never_true and has_end(step), can_fail and not always_true)


def is_endless(step: Step) -> bool:
    """Return whether a step is repeated for ever: no number of times, no `until` that ends it."""
    repeat, until = step.modifiers.repeat, step.modifiers.until
    if not isinstance(repeat, Constant) or repeat.value is not None:
        return False
    return until is None or truth_values(until.term) == {False}


def has_end(step: Leaf) -> bool:
    """Return whether a behaviour that needs one of several ports to succeed has one of them."""
    ends = step.behaviour.ends_by
    return not ends or any(_is_given(step.ports.get(name)) for name in ends)


def _is_given(value: Value | None) -> bool:
    if isinstance(value, Constant):
        return value.value is not None and value.value is not False
    return value is not None


def _expressions(value: Value) -> tuple[CheckedExpression, ...]:
    if isinstance(value, Template):
        return value.expressions
    if isinstance(value, ListValue):
        return tuple(found for item in value.items for found in _expressions(item))
    return (value.expression,) if isinstance(value, ExpressionValue | Computed) else ()


def _may_be_missing(value: Value) -> bool:
    if isinstance(value, ListValue):
        return any(map(_may_be_missing, value.items))
    return isinstance(value, Reference) and _may_be_unset(value.symbol)


def _can_fail_to_evaluate(expression: CheckedExpression) -> bool:
    """Return whether the evaluation can fail: a key may be unset, or there is a division."""
    return expression.may_fail or any(map(_may_be_unset, expression.read.values()))


def _may_be_unset(symbol: Symbol) -> bool:
    return symbol.is_writable and symbol.value is UNSET


def _name(step: Step) -> str:
    return step.name or (step.tree if isinstance(step, Use) else step.kind)
