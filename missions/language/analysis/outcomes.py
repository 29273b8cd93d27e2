"""Possible outcomes of nodes: reports unreachable children, useless retries, impossible events.

The analysis is conservative: a finding is reported only if it is certain.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import combinations, pairwise
from typing import Any

from missions.language.analysis.data_flow import children_of, once_per_step, steps_below
from missions.language.analysis.intervals import conjuncts, exclude_each_other, truth_values
from missions.language.analysis.ranges import range_hint
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.step import Claims, Order, Outcomes, Step, Tree
from missions.language.values import Constant, may_fail
from stack.documents import Findings
from stack.drivetrain.needs import noun_of


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
        if step.order in (Order.AFTER_SUCCESS, Order.AFTER_FAILURE):
            self._reached(step)
        if step.order is Order.AFTER_SUCCESS and step.starts_again:
            self._restarted(step)
        elif step.order is Order.AFTER_SUCCESS:
            self._overwritten(step)
        if step.order is Order.TOGETHER:
            self._conflicts(step)
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
            failure = failure or may_fail(modifiers.until)
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
        """Return the possible outcomes of a step without its modifiers."""
        if any(id(condition) in self.dead for condition in step.conditions()):
            return Outcomes(False, False)
        if step.uses:
            return step.outcomes([self._tree(self.trees[step.uses])])
        return step.outcomes([self.outcomes(child) for child in step.children()])

    def _tree(self, tree: Tree) -> Outcomes:
        """Return the possible outcomes of a used tree; an event can end it with its failure."""
        ends = self.outcomes(tree.root) if tree.root else Outcomes()
        events = [self.outcomes(event.step).failure or event.then == "abort"
                  for event in tree.events]  # fmt: skip
        return Outcomes(ends.success, ends.failure or any(events), ends.skip)

    # Findings

    def _reached(self, step: Step) -> None:
        for before, after in pairwise(step.children()):
            ends = self.outcomes(before)
            if ends.next_may_run(step.order):
                continue
            word = "succeeds" if step.order is Order.AFTER_SUCCESS else "fails"
            if not ends.success and not ends.failure:
                word = "ends"
            sentence = f"never reached: {before.title} (line {before.mark.line}) never {word}"
            why, hint = _constant_condition(before)
            hint = hint or _ways_to_end(before) or "change the order, or remove it"
            self.findings.add("E160", after.mark, sentence + why, hint)
            return

    def _retries(self, step: Step) -> None:
        modifiers = step.modifiers
        body, attempt = self._body(step), self._attempt(step)
        for word, modifier in (("retry", modifiers.retry), ("recover", modifiers.recover)):
            if modifier and not attempt.failure:
                sentence = f"`{word}` has no effect: {step.title} cannot fail"
                self.findings.add("W108", step.mark, sentence, f"remove `{word}`")
        if modifiers.keep_going and not self._before_on_failure(step).failure:
            sentence = f"`on_failure` has no effect: {step.title} cannot fail"
            self.findings.add("W108", step.mark, sentence, "remove `on_failure`")
        if modifiers.every is None:
            return
        counted = modifiers.repeat is not None and not is_endless(step)
        if counted and body.success:
            sentence = "`repeat` also counts results that `every` only repeats"
            self.findings.add("W109", step.mark, sentence, "move one of them to a child node")
        if modifiers.retry and body.failure:
            sentence = "`retry` also counts results that `every` only repeats"
            self.findings.add("W109", step.mark, sentence, "move one of them to a child node")

    def _restarted(self, step: Step) -> None:
        for child in step.children()[:-1]:
            if self.takes_time(child):
                sentence = f"after its success {child.title} starts again on every tick"
                hint = "use a sequence, or make it the last child"
                self.findings.add("W106", child.mark, sentence, hint)

    def _overwritten(self, step: Step) -> None:
        """Report a key that the next node surely overwrites before anything can have read it."""
        for first, second in pairwise(step.children()):
            if any(node.uses or node.modifiers.when is not None for node in (first, second)):
                continue
            lost = {*first.writes()} & {*second.writes()} - {*second.symbols_read()}
            for symbol in sorted(lost, key=lambda item: item.name):
                if self._may_survive(symbol, second):
                    continue
                sentence = f"${symbol.name} of line {first.mark.line} is overwritten here "
                sentence += "before anything reads it"
                hint = "use another key, or remove one of them"
                self.findings.add("W130", second.mark, sentence, hint)

    def _may_survive(self, symbol: Symbol, step: Step) -> bool:
        """Return whether a key may keep its value: its default, if the node does not succeed.

        `set` computes all values before it writes. A behaviour that fails unsets the targets of its
        outputs that have no initial value; one that is halted leaves them.
        """
        modifiers = step.modifiers
        if modifiers.every or modifiers.timeout or modifiers.while_:
            return True
        for value in step.reads():
            if symbol in value.writes():
                return value.may_fail()
        unset_by_failure = symbol in step.results().values() and symbol.value is UNSET
        return self._body(step).failure and not unset_by_failure

    @once_per_step
    def takes_time(self, step: Step) -> bool:
        """Return whether a step surely needs more than one tick to succeed."""
        modifiers = step.modifiers
        if modifiers.when is not None or modifiers.every is not None:
            return False
        return step.takes_time([self.takes_time(child) for child in self._run_by(step)])

    def _run_by(self, step: Step) -> tuple[Step, ...]:
        """Return the children of a step, or the root of its tree."""
        root = self.trees[step.uses].root if step.uses else None
        return step.children() if root is None else (root,)

    def _conflicts(self, step: Step) -> None:
        """Report two children of a parallel that claim the same, certainly or possibly."""
        children = step.children()
        for first, second in combinations(children, 2):
            if shared := self.begins(first) & self.begins(second):
                sentence = f"{second.title} uses the {_nouns(shared)} at the same time as "
                sentence += f"{first.title} (line {first.mark.line})"
                self.findings.add("E162", second.mark, sentence, "use a sequence")
                return
        for first, second in combinations(children, 2):
            shared = self.claims(first) & self.claims(second)
            if shared and _both(first, second):
                sentence = f"{second.title} may use the {_nouns(shared)} at the same time as "
                sentence += f"{first.title} (line {first.mark.line})"
                hint = "use a sequence, or conditions that exclude each other"
                self.findings.add("W105", second.mark, sentence, hint)
                return

    @once_per_step
    def claims(self, step: Step) -> Claims:
        """Return what a step, with the trees it uses, may claim of the robot."""
        below = steps_below(step, self.trees)
        return step.claims.union(*(self.claims(child) for child in below))

    @once_per_step
    def begins(self, step: Step) -> Claims:
        """Return what a step claims from its first tick on."""
        if step.modifiers.when is not None:
            return frozenset()
        return step.begins([self.begins(child) for child in self._run_by(step)])


def _nouns(claims: Claims) -> str:
    """Return resources in words: `arm and gripper`."""
    return " and ".join(noun_of(name) for name in sorted(claims))


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
    for condition in step.conditions():
        found = truth_values(condition.term)
        if len(found) == 1:
            word = "true" if True in found else "false"
            return f": {condition.source} is always {word}", range_hint(condition)
    return "", ""


def _ways_to_end(step: Step) -> str:
    ports = step.missing_ends()
    return f"set {', '.join(ports[:-1])} or {ports[-1]}" if ports else ""


def is_endless(step: Step) -> bool:
    """Return whether a step is repeated forever: no number of times, no `until` that ends it."""
    repeat, until = step.modifiers.repeat, step.modifiers.until
    if not isinstance(repeat, Constant) or repeat.value is not None:
        return False
    return until is None or truth_values(until.term) == {False}
