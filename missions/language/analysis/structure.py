"""Nodes without effect: one child, nothing to do, the same drive again, conditions that exclude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from missions.language.analysis.claims import Claims
from missions.language.analysis.data_flow import steps_of
from missions.language.analysis.intervals import conjuncts, exclude_each_other, truth_values
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import Role
from missions.language.expressions.terms import Binary, Literal, Named, Term
from missions.language.step import Event, Modifiers, Order, Step, Tree
from missions.language.values import symbols_in
from stack.documents import Finding, Findings

_MEASURED = ("battery.charge", "robot.speed", "robot.turning", "localisation.health",
             "localisation.deviation", "pose.x", "pose.y", "pose.heading", "time")  # fmt: skip

Around = tuple[CheckedExpression, ...]


class StructureCheck:
    """Reports nodes that have no effect, from their place in the tree."""

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings, self.claims = trees, findings, Claims(findings)

    def mission(self, root: Step, events: Sequence[Event], roots: Sequence[Step]) -> None:
        """Check the mission; `roots` are the nodes of run, events and trees, each once."""
        for start in roots:
            for step in steps_of(start):
                self._one_child(step)
                self.findings.items += step.problems()
                self._same_goal(step)
                for condition in (*step.modifiers.conditions(), *step.conditions()):
                    self._equality(condition)
        for event in events:
            self._equality(event.when)
            self._restarts(event, "mission")
        for tree in self.trees.values():
            for event in tree.events:
                self._equality(event.when)
                self._restarts(event, f"tree {tree.name!r}")
        for start in (root, *(event.step for event in events)):
            self._exclusive(start, (), ())
        self.claims.report()

    def _one_child(self, step: Step) -> None:
        children = step.children()
        if step.without_sibling and len(children) == 1:
            why = step.without_sibling.format(child=children[0].title)
            sentence = f"a {step.kind} of one child has no effect: {why}"
            self.findings.add("W132", step.mark, sentence, "add a child, or write the child alone")

    def _same_goal(self, step: Step) -> None:
        """Report a recovery that drives to the goal of its node."""
        recover = step.modifiers.recover
        for recovery in recover.recoveries if recover else ():
            if step.goal is not None and recovery.goal == step.goal:
                sentence = "the recovery drives to the goal that has just failed"
                hint = "clear the costmap, turn, or back up; it tries again by itself"
                self.findings.add("W134", recovery.mark, sentence, hint)

    def _equality(self, condition: CheckedExpression) -> None:
        """Report `==` of a measured number, which is almost never exactly equal."""
        for part in conjuncts(condition.term):
            if not isinstance(part, Binary) or part.word != "==" or len(truth_values(part)) == 1:
                continue
            for one, other in ((part.left, part.right), (part.right, part.left)):
                if isinstance(one, Named) and one.name in _MEASURED and isinstance(other, Literal):
                    sentence = f"{one.name} is measured: it is almost never exactly equal"
                    hint = "use `<=` or `>=`"
                    mark = condition.mark
                    if mark is not None:
                        self.findings.add("W135", mark, sentence, hint)

    def _restarts(self, event: Event, what: str) -> None:
        """Report an event whose condition is still true after its restart of the mission or tree.

        Beside a tree, other nodes may write what its events read.
        """
        if event.then != "restart":
            return
        names = {item.name for _, item in event.when.term.named() if isinstance(item, Named)}
        written = {symbol for step in steps_of(event.step) for symbol in step.changes()}
        used = {*symbols_in(event.when)}
        if any(step.uses for step in steps_of(event.step)) or used & written:
            return
        if what != "mission" and not all(symbol.role is Role.ARGUMENT for symbol in used):
            return
        if names - {"time"} or (names and not _only_grows(event.when.term)) or not (names or used):
            return
        sentence = f"the event {event.name!r} restarts the {what} forever: {event.when.source} "
        sentence += "stays true after the restart"
        hint = "make it false in `do`, for example with `set`, or use `then: resume`"
        self.findings.add("E169", event.when.mark or event.mark, sentence, hint)

    def _exclusive(self, step: Step, lasting: Around, starting: Around) -> None:
        """Report conditions that the conditions around them exclude.

        Args:
            step: the node.
            lasting: conditions of `while` around it, true as long as it runs.
            starting: conditions that are true in the tick in which it starts.
        """
        modifiers = step.modifiers
        for condition in (modifiers.when, modifiers.while_, *_checks(step)):
            if condition is not None:
                self._against(step, condition, (*lasting, *starting))
        if modifiers.when is not None:
            starting = (*starting, modifiers.when)
        if modifiers.finally_ is not None:  # outside `while`
            self._exclusive(modifiers.finally_, lasting, ())
        if modifiers.while_ is not None and not _reads_keys(modifiers.while_):
            lasting = (*lasting, modifiers.while_)
        for recovery in modifiers.recover.recoveries if modifiers.recover else ():
            self._exclusive(recovery, lasting, ())
        self._below(step, lasting, starting)

    def _below(self, step: Step, lasting: Around, starting: Around) -> None:
        """Check the children of a node and its tree."""
        for child in step.children():
            begins_with = starting if step.order is not Order.REPEATED else ()
            self._exclusive(child, lasting, begins_with)
            if step.order is Order.AFTER_SUCCESS and _is_plain_check(child):
                starting = (*starting, *_checks(child))
            elif step.order not in (Order.TOGETHER, Order.ONE):
                starting = ()
        if step.uses:
            tree = self.trees[step.uses]
            if tree.root is not None:
                self._exclusive(tree.root, lasting, starting)
            for event in tree.events:
                self._exclusive(event.step, lasting, ())

    def _against(self, step: Step, condition: CheckedExpression, around: Around) -> None:
        own = list(conjuncts(condition.term))
        outer = [
            part for item in around if _agree(item, condition) for part in conjuncts(item.term)
        ]
        excluded = bool(outer) and exclude_each_other([*own, *outer])
        if not excluded or exclude_each_other(own) or exclude_each_other(outer):
            self.claims.claim(None, "W136", condition)
            return
        sentence = f"{condition.source} is never true here: the conditions around it exclude it"
        mark = condition.mark or step.mark
        self.claims.claim(Finding(mark, "W136", sentence, "correct one of them"), "W136", condition)


def _agree(first: CheckedExpression, second: CheckedExpression) -> bool:
    """Return whether names that both read mean the same."""
    return all(second.read.get(name, symbol) is symbol for name, symbol in first.read.items())


def _reads_keys(condition: CheckedExpression) -> bool:
    return any(symbol.is_writable for symbol in condition.read.values())


def _is_plain_check(step: Step) -> bool:
    return bool(_checks(step)) and step.modifiers == Modifiers()


def _checks(step: Step) -> tuple[CheckedExpression, ...]:
    """Return the condition of a `check`."""
    return tuple(step.conditions()) if step.ends_at_once else ()


def _only_grows(term: Term) -> bool:
    """Return whether a condition over the time, once true, stays true: `time > 60 s`."""
    for part in conjuncts(term):
        if not isinstance(part, Binary):
            return False
        left = isinstance(part.left, Named) and part.word in (">", ">=")
        right = isinstance(part.right, Named) and part.word in ("<", "<=")
        if not (left or right):
            return False
    return True
