"""Periods of a mission, compared with the rate at which the tree is ticked."""

from __future__ import annotations

from collections.abc import Iterator

from missions.execution.fit.steps import every_step
from missions.language.analysis.claims import is_literal, mark_of, number_of, seconds
from missions.language.model import Mission
from stack.documents import Finding
from stack.runtime.parameters import LoopParameters


def period_findings(mission: Mission, loop: LoopParameters) -> Iterator[Finding]:
    """Yield a warning for each `every` that is not longer than the time between two ticks."""
    tick = 1.0 / loop.tree_rate
    for step in every_step(mission):
        every = step.modifiers.every
        period = number_of(every)
        if period is None or not is_literal(every) or period > tick + 1e-9:
            continue
        sentence = f"`every: {seconds(period)}` has no effect: the tree ticks every {tick:g} s"
        hint = "use a longer period, or remove it"
        yield Finding(mark_of(every, step.mark), "W126", sentence, hint)
