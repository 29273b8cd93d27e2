"""Every node of a mission."""

from __future__ import annotations

from collections.abc import Iterator

from missions.language.analysis.claims import steps_of
from missions.language.model import Mission, Step


def every_step(mission: Mission) -> Iterator[Step]:
    """Yield the nodes of run, events and trees, each once."""
    roots = [mission.root, *(event.step for event in mission.events)]
    roots += [tree.root for tree in mission.trees.values() if tree.root]
    for root in roots:
        yield from steps_of(root)
