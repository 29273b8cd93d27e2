"""Repetition: attempts, recoveries, periods and rotations without effect; what never ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from missions.language.analysis.claims import (
    Claims,
    is_literal,
    mark_of,
    number_of,
)
from missions.language.analysis.data_flow import children_of, steps_of
from missions.language.analysis.outcomes import OutcomeCheck, is_endless
from missions.language.step import Event, Modifiers, Order, Step, Tree
from missions.language.values import symbols_in
from stack.documents import Finding, Findings


class RepetitionCheck:
    """Reports modifiers that repeat nothing, and nodes that end nothing.

    Nodes are visited once per use: a node can run again if a loop is anywhere around it.
    """

    def __init__(
        self, trees: Mapping[str, Tree], findings: Findings, outcomes: OutcomeCheck
    ) -> None:
        self.trees, self.findings, self.outcomes = trees, findings, outcomes
        self.claims = Claims(findings)

    def mission(self, root: Step, events: Sequence[Event], roots: Sequence[Step]) -> None:
        """Check the mission; `roots` are the nodes of run, events and trees, each once."""
        restarts = any(event.then == "restart" for event in events)
        self._visit(root, restarts)
        for event in events:
            self._visit(event.step, True)
            self._ends(event.step, f"the event {event.name!r}")
        for tree in self.trees.values():
            for event in tree.events:
                self._ends(event.step, f"the event {event.name!r}")
        self.claims.report()
        for start in roots:
            for step in steps_of(start):
                self._counts(step)
                self._recoveries(step)

    def _counts(self, step: Step) -> None:
        """Report `retry: 1` and `repeat: 1`."""
        modifiers = step.modifiers
        attempts = modifiers.retry.attempts if modifiers.retry else None
        for word, value, more in (
            ("retry", attempts, "`retry: 2` tries once more after a failure"),
            ("repeat", modifiers.repeat, "`repeat: 2` runs it twice"),
        ):
            if is_literal(value) and number_of(value) == 1:
                sentence = f"`{word}: 1` has no effect: {step.title} runs once"
                self.findings.add("W124", mark_of(value, step.mark), sentence, more)

    def _recoveries(self, step: Step) -> None:
        """Report recoveries that never get a turn, and those that never end."""
        recover = step.modifiers.recover
        if recover is None or not recover.recoveries:
            return
        most, count = number_of(recover.attempts), len(recover.recoveries)
        for recovery in recover.recoveries:
            self._ends(recovery, f"the recovery {recovery.title}")
        if most is None or not is_literal(recover.attempts) or most > count:
            return
        mark = mark_of(recover.attempts, step.mark)
        hint = f"use at least `attempts: {count + 1}`: the first run counts as an attempt"
        if most == 1:
            sentence = "no recovery ever runs: there is a single attempt"
            self.findings.add("E166", mark, sentence, hint)
            return
        unused = ", ".join(item.title for item in recover.recoveries[int(most) - 1 :])
        sentence = f"with {most:g} attempts {unused} never runs: {count} recoveries"
        self.findings.add("W125", mark, sentence, hint)

    def _ends(self, step: Step, what: str) -> None:
        ends = self.outcomes.outcomes(step)
        if ends.success:
            return
        endless = next(_endless_below(step), None)
        if endless is not None:
            why = "repeats forever" if is_endless(endless) else "has no end"
            sentence = f"{what} never ends: {endless.title} {why}"
            hint = "repeat it a number of times, or put a `timeout` around it"
            if not is_endless(endless):
                hint = f"set {' or '.join(endless.missing_ends())}, or a `timeout`"
            self.findings.add("E167", endless.mark, sentence, hint)
        elif not ends.failure:
            sentence = f"{what} never ends, so the mission never continues"
            self.findings.add("E167", step.mark, sentence, "add a `timeout`, or let it end")

    def _visit(self, step: Step, again: bool) -> None:
        """Check a step and everything below it; `again`: it can run again after its end."""
        modifiers = step.modifiers
        repeated = bool(modifiers.repeat or modifiers.retry or modifiers.recover)
        inside = again or repeated or step.starts_again
        self._every(step, again=again or repeated)
        self._too_often(step)
        if step.order is Order.IN_TURN:
            self._rotation(step, again=again or repeated)
        if modifiers.finally_ is not None:
            self._visit(modifiers.finally_, again)
        for child in step.children():
            self._visit(child, inside)
        for recovery in modifiers.recover.recoveries if modifiers.recover else ():
            self._visit(recovery, True)
        if step.uses:
            tree = self.trees[step.uses]
            if tree.root is not None:
                self._visit(tree.root, inside)
            for event in tree.events:
                self._visit(event.step, True)

    def _every(self, step: Step, *, again: bool) -> None:
        if not is_literal(step.modifiers.every):
            return
        mark = mark_of(step.modifiers.every, step.mark)
        finding = None
        if not again:
            sentence = f"`every` has no effect: {step.title} runs once"
            hint = "put it below a `reactive` or a `repeat`, or remove it"
            finding = Finding(mark, "W126", sentence, hint)
        self.claims.claim(finding, "W126", step)

    def _too_often(self, step: Step) -> None:
        """Report a repetition of nodes that end at once; counting up to `until` is none."""
        until = step.modifiers.until
        endless = is_endless(step)
        if until is not None and not endless:
            written = {symbol for node in steps_of(step) for symbol in node.changes()}
            endless = not written & {*symbols_in(until)}
        if endless and step.modifiers.every is None and _is_instant(step):
            sentence = f"{step.title} repeats on every tick of the tree"
            hint = "add `every: 5 s`, or a `wait` in a sequence"
            self.claims.claim(Finding(step.mark, "W127", sentence, hint), "W127", step)

    def _rotation(self, step: Step, *, again: bool) -> None:
        finding = None
        certain = next(
            (child for child in step.children()[:-1] if not self.outcomes.outcomes(child).failure),
            None,
        )
        if not again and certain is not None:
            sentence = f"{step.title} runs once, and {certain.title} cannot fail: "
            sentence += "the children after it never run"
            hint = "put it below a `repeat`, or use a sequence"
            finding = Finding(step.mark, "W128", sentence, hint)
        self.claims.claim(finding, "W128", step)


def _is_instant(step: Step) -> bool:
    """Return whether a step only says and sets: it always ends in the tick in which it starts."""
    if step.modifiers.recover is not None or step.modifiers.finally_ is not None:
        return False
    if step.uses or step.order is Order.NONE:
        return step.ends_at_once and not any(step.conditions())
    plain = all(child.modifiers == Modifiers() for child in step.children())
    return plain and all(map(_is_instant, step.children()))


def _endless_below(step: Step) -> Iterator[Step]:
    """Yield the nodes that never succeed by themselves, without those below a timeout."""
    if is_endless(step):
        yield step
    if step.modifiers.timeout is not None:
        return
    if step.missing_ends():
        yield step
    for child in children_of(step):
        yield from _endless_below(child)
