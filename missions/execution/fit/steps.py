"""Every node and every condition of a mission."""

from __future__ import annotations

from collections.abc import Iterator

from missions.language.analysis.data_flow import steps_of
from missions.language.expressions.expression import CheckedExpression
from missions.language.kinds.leaf import LeafStep
from missions.language.model import Mission
from missions.language.step import Step
from stack.documents import Mark


def every_step(mission: Mission) -> Iterator[Step]:
    """Yield the nodes of run, events and trees, each once, also of trees that nothing uses."""
    roots = [mission.root, *(event.step for event in mission.events)]
    roots += [root for tree in mission.trees.values() for root in tree.roots]
    for root in roots:
        yield from steps_of(root)


def every_leaf(mission: Mission) -> Iterator[LeafStep]:
    """Yield the behaviours of a mission, each once."""
    return (step for step in every_step(mission) if isinstance(step, LeafStep))


def every_condition(mission: Mission) -> Iterator[tuple[CheckedExpression, Mark]]:
    """Yield the conditions of nodes and events with their positions."""
    trees = mission.trees.values()
    for event in (*mission.events, *(event for tree in trees for event in tree.events)):
        yield event.when, event.when.mark or event.mark
    for step in every_step(mission):
        for condition in (*step.modifiers.conditions(), *step.conditions()):
            yield condition, condition.mark or step.mark
