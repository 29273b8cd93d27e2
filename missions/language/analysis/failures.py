"""Failure codes that nothing fails with; `error` and `attempt` in trees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from missions.language.analysis.claims import Claims
from missions.language.analysis.data_flow import once_per_step
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.terms import Binary, Literal, Named, Term
from missions.language.step import Codes, Event, Step, Tree
from stack.documents import Finding, Findings, Mark
from stack.parameters import did_you_mean, nearest
from stack.types import FailureCode

_OF_VALUES = frozenset(
    (FailureCode.NOT_SET, FailureCode.DIVISION_BY_ZERO, FailureCode.OVERFLOW,
     FailureCode.OUT_OF_RANGE)
)  # fmt: skip
"""Codes of values that cannot be computed: any port, condition or list can fail with them."""


@dataclass(frozen=True)
class _Place:
    """What `error` and `attempt` mean at a place: the failure codes, None if there is no failure.

    Attributes:
        handled: whether a failure is being handled.
        codes: codes that it can have; None if not known.
        counts: whether attempts are counted.
        tree: the `use` of the innermost tree.
    """

    handled: bool = False
    codes: Codes = None
    counts: bool = False
    tree: Step | None = None


class FailureCheck:
    """Visits every node at every place where it runs."""

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings, self.claims = trees, findings, Claims(findings)
        self.memory: dict[tuple[str, int], Any] = {}

    def mission(self, root: Step, events: Sequence[Event]) -> None:
        """Check the mission and its events."""
        for step in (root, *(event.step for event in events)):
            self._visit(step, _Place())
        self.claims.report()

    def _visit(self, step: Step, place: _Place) -> None:
        modifiers = step.modifiers
        counted = bool(modifiers.retry or modifiers.recover)
        for condition in (modifiers.when, modifiers.while_, modifiers.until):
            self._expression(condition, place)
        inside = replace(place, counts=place.counts or counted)
        for expression in (item for value in step.reads() for item in value.expressions()):
            self._expression(expression, inside)
        recoveries = modifiers.recover.recoveries if modifiers.recover else ()
        if modifiers.recover:
            failed = replace(inside, handled=True, codes=self.codes_of_attempt(step))
            self._expression(modifiers.recover.unless, failed)
            for recovery in recoveries:
                self._visit(recovery, failed)
        if modifiers.finally_ is not None:
            self._visit(modifiers.finally_, place)
        self._visit_children(step, inside)
        if step.uses:
            self._visit_tree(step, replace(inside, tree=step))

    def _visit_children(self, step: Step, inside: _Place) -> None:
        codes: Codes = frozenset()
        for number, child in enumerate(step.children()):
            here = inside
            if step.order.handles_failure and number:
                here = replace(inside, handled=True, codes=codes or None)
            self._visit(child, here)
            codes = _union(codes, self.codes(child))
            if child.modifiers.when is not None and codes is not None:
                codes |= inside.codes or frozenset()

    def _visit_tree(self, use: Step, inside: _Place) -> None:
        tree = self.trees[use.uses]
        if tree.root is not None:
            self._visit(tree.root, inside)
        for event in tree.events:
            self._visit(event.step, _Place(tree=use))

    # Possible codes

    @once_per_step
    def codes(self, step: Step) -> Codes:
        """Return the codes that a step with all its modifiers can fail with."""
        modifiers = step.modifiers
        found: Codes = frozenset()
        if not modifiers.keep_going:
            found = self.codes_of_attempt(step)
            if found is not None and (modifiers.while_ is not None or modifiers.invert):
                found |= {FailureCode.CHECK_FAILED}
        last = modifiers.finally_
        return _union(found, self.codes(last)) if last is not None else found

    @once_per_step
    def codes_of_attempt(self, step: Step) -> Codes:
        """Return the codes that one attempt of a step can fail with."""
        found = self._codes_of_body(step)
        if found is not None and step.modifiers.timeout is not None:
            found |= {FailureCode.TIMED_OUT}
        return found

    def _codes_of_body(self, step: Step) -> Codes:
        found = step.fails_with()
        for child in step.children():
            found = _union(found, self.codes(child))
        if step.uses:
            tree = self.trees[step.uses]
            for root in tree.roots:
                found = _union(found, self.codes(root))
            if any(event.then == "abort" for event in tree.events):
                found = _union(found, frozenset((FailureCode.CANCELLED,)))
        return found

    # Expressions

    def _expression(self, expression: CheckedExpression | None, place: _Place) -> None:
        if expression is None or expression.mark is None:
            return
        named = (term for _, term in expression.term.named())
        names = {term.name for term in named if isinstance(term, Named)}
        if "error" in names:
            self._defined("error", place.handled, expression, place)
        if "attempt" in names:
            self._defined("attempt", place.counts, expression, place)
        for term in expression.term.walk():
            code = _compared(term)
            if code is not None:
                self._compared_with(term, code, expression.mark, place)

    def _defined(
        self, name: str, known: bool, expression: CheckedExpression, place: _Place
    ) -> None:
        """Report `error` or `attempt` in a tree that is used where it has no meaning."""
        if known or place.tree is None or expression.mark is None:
            return
        where = f"{place.tree.uses} is used in line {place.tree.mark.line}"
        sentence = f"`error` is not defined here: {where}, where no failure is handled"
        hint = "use it in `unless`, in recoveries or in later children of a fallback"
        if name == "attempt":
            sentence = f"`attempt` is not defined here: {where}, where no attempt is counted"
            hint = "use it inside a retry or recover, or in `unless`"
        self.findings.add("E154", expression.mark, sentence, hint)

    def _compared_with(self, term: Term, code: str, mark: Mark, place: _Place) -> None:
        finding: Finding | None = None
        codes = place.codes
        if code and codes is not None and code not in codes | _OF_VALUES:
            known = sorted(str(item) for item in codes)
            close = nearest(code, known)
            hint = did_you_mean(close) if close else f"it can fail with {', '.join(known)}"
            sentence = f"error is never {code} here: nothing that runs before it fails with {code}"
            finding = Finding(mark, "W131", sentence, hint)
        self.claims.claim(finding, "W131", term)


def _union(first: Codes, second: Codes) -> Codes:
    return None if first is None or second is None else first | second


def _compared(term: Term) -> str | None:
    """Return the code that a term compares `error` with."""
    if not isinstance(term, Binary) or term.word not in ("==", "!="):
        return None
    for one, other in ((term.left, term.right), (term.right, term.left)):
        if isinstance(one, Named) and one.name == "error":
            if isinstance(other, Literal):
                return str(other.value)
            if isinstance(other, Named) and other.name in FailureCode.__members__:
                return other.name
    return None
