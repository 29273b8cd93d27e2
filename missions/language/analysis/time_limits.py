"""Time limits: what can never end in time, and limits that never apply."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from missions.language.analysis.claims import (
    Claims,
    is_literal,
    mark_of,
    number_of,
    seconds,
)
from missions.language.analysis.data_flow import once_per_step
from missions.language.step import Event, Step, Tree
from missions.language.values import Value
from stack.documents import Finding, Findings


@dataclass(frozen=True)
class _Limit:
    seconds: float
    owner: str
    line: int

    def words(self) -> str:
        return f"{self.owner} is stopped after {seconds(self.seconds)} (line {self.line})"


class TimeLimitCheck:
    """Walks the mission with all used trees and the innermost time limit around each node."""

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.claims = trees, Claims(findings)
        self.memory: dict[tuple[str, int], Any] = {}

    def mission(self, root: Step, events: Sequence[Event]) -> None:
        """Check the mission and its events."""
        self.step(root, None)
        self._below(root, events, None)
        self.claims.report()

    def _below(self, root: Step, events: Sequence[Event], limit: _Limit | None) -> None:
        """Check the events of the mission or of a tree; limits are suspended while one runs."""
        modifiers = root.modifiers
        own = number_of(modifiers.timeout)
        again = modifiers.retry or modifiers.recover or modifiers.repeat
        if own is not None and not again and modifiers.finally_ is None:
            if limit is None or own < limit.seconds:
                limit = _Limit(own, root.title, root.mark.line)
        for event in events:
            hold, finding = number_of(event.hold), None
            if limit is not None and hold and hold >= limit.seconds and is_literal(event.hold):
                sentence = f"the event {event.name!r} never fires: hold is {seconds(hold)}, "
                sentence += f"but {limit.words()}"
                hint = f"use less than {seconds(limit.seconds)}, or a longer timeout"
                finding = Finding(mark_of(event.hold, event.mark), "W122", sentence, hint)
            self.claims.claim(finding, "W122", event)
            self.step(event.step, None)

    def step(self, step: Step, limit: _Limit | None) -> None:
        """Check a step, its children and its tree under the limit around it."""
        modifiers = step.modifiers
        if modifiers.retry:
            self._applies("the next attempt", modifiers.retry.delay, step, limit, "delay")
        self._applies("the next run", modifiers.every, step, limit, "every")
        self._applies("the timeout", modifiers.timeout, step, limit, "timeout")
        self._possible(step)
        own = number_of(modifiers.timeout)
        inner = limit
        if own is not None and (limit is None or own < limit.seconds):
            inner = _Limit(own, step.title, mark_of(modifiers.timeout, step.mark).line)
        for name, value in step.limits().items():
            self._applies(f"{name} of", value, step, inner, name)
        for child in step.children():
            self.step(child, inner)
        for recovery in modifiers.recover.recoveries if modifiers.recover else ():
            self.step(recovery, limit)
        if modifiers.finally_ is not None:
            self.step(modifiers.finally_, limit)
        if step.uses:
            self._tree(self.trees[step.uses], inner)

    def _tree(self, tree: Tree, limit: _Limit | None) -> None:
        if tree.root is not None:
            self.step(tree.root, limit)
            self._below(tree.root, tree.events, limit)

    def _applies(
        self, what: str, value: Value | None, step: Step, limit: _Limit | None, word: str
    ) -> None:
        """Report a duration that the limit around it cuts off."""
        length = number_of(value)
        if length is None or not is_literal(value):
            return
        finding: Finding | None = None
        if limit is not None and length >= limit.seconds:
            amount = seconds(length)
            ends = {"delay": f"{what} after {amount} never starts",
                    "every": f"{what} after {amount} never starts"}  # fmt: skip
            sentence = ends.get(word, f"{what.removesuffix(' of')} of {amount} never applies")
            mark = mark_of(value, step.mark)
            hint = f"use less than {seconds(limit.seconds)}, or a longer limit around it"
            finding = Finding(mark, "W122", f"{sentence}: {limit.words()}", hint)
        self.claims.claim(finding, "W122", value)

    def _possible(self, step: Step) -> None:
        """Report a timeout that is shorter than what it limits, or limits nothing."""
        timeout = step.modifiers.timeout
        limit = number_of(timeout)
        if limit is None:
            return
        mark = mark_of(timeout, step.mark)
        if step.ends_at_once:
            sentence = f"the timeout has no effect: {step.kind} ends at once"
            self.claims.claim(Finding(mark, "W123", sentence, "remove it"), "W123", step)
        needed = self.least(step)
        if needed <= limit:
            return
        name = step.title
        sentence = f"{name} always times out: it takes at least {seconds(needed)}, "
        sentence += f"but its timeout is {seconds(limit)}"
        hint = f"use a timeout above {seconds(needed)}"
        self.claims.claim(Finding(mark, "W121", sentence, hint), "W121", step)

    @once_per_step
    def least(self, step: Step) -> float:
        """Return the shortest time in which one attempt of a step can succeed, seconds."""
        root = self.trees[step.uses].root if step.uses else None
        below = step.children() if root is None else (root,)
        return step.least_time([self.total(child) for child in below])

    def total(self, step: Step) -> float:
        """Return the shortest time in which a step with its modifiers can succeed, seconds."""
        modifiers = step.modifiers
        if modifiers.when is not None or modifiers.keep_going or modifiers.every is not None:
            return 0.0
        if modifiers.invert:  # a failure may come at once
            return 0.0
        times = 1.0
        if modifiers.repeat is not None:
            times = number_of(modifiers.repeat) or 1.0
        last = self.total(modifiers.finally_) if modifiers.finally_ is not None else 0.0
        return times * self.least(step) + last
