"""The nodes at which the failures of a run began."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from missions.inspection.trace_model import Node, Trace, Tree, is_reset
from stack.telemetry.records import Event


@dataclass(frozen=True, slots=True)
class FailedNode:
    """A node at which a failure began: a leaf, a time limit, a check; not a node above it.

    Attributes:
        tree: index of its tree in the trace; id: of the node in it.
        name: of the node; kind: the word in the mission.
        code: of the failure; empty in a run of an older version. message: why, for people.
        begin: robot time of its last start, seconds; time: of the failure.
        where: file and line of the mission; line: its text.
        path: names of the nodes above it, from the root.
    """

    tree: int
    id: int
    name: str
    kind: str
    code: str
    message: str
    begin: float
    time: float
    where: str
    line: str
    path: tuple[str, ...]

    @property
    def line_number(self) -> int:
        """Line of the mission; 0 if it is not known."""
        number = self.where.rpartition(":")[2]
        return int(number) if number.isdecimal() else 0


@dataclass(frozen=True, slots=True)
class Failures:
    """Failures of a run.

    Attributes:
        every: in order of time.
        last: at which the last failure of the root began; None if the last tree did not fail.
    """

    every: tuple[FailedNode, ...]
    last: FailedNode | None


Changes = dict[int, list[Event]]
"""Changes of status of the nodes of a tree, by the id of the node."""


def failures_of(trace: Trace, line_of: Callable[[str], str]) -> Failures:
    """Return the failures of a run.

    Args:
        trace: of the run.
        line_of: returns the text of a line of the mission, given as in: patrol.yaml:21.
    """
    changes: list[Changes] = [{} for _ in trace.trees]
    every, last = list[FailedNode](), None
    for event, tree, number in trace.with_trees():
        if event.kind != "node_status" or is_reset(event):
            continue
        node = tree.nodes[int(event.fields["node"])]
        changes[number].setdefault(node.id, []).append(event)
        origin = _origin(tree, event, changes[number]) if _fails(event) else None
        if origin == node.id:
            every.append(_failed(tree, number, node, changes[number][node.id], line_of))
        if node.parent not in tree.nodes:
            last = next((one for one in reversed(every)
                         if (one.tree, one.id) == (number, origin)), None)  # fmt: skip
    is_over = last is not None and last.tree == len(trace.trees) - 1
    return Failures(tuple(every), last if is_over else None)


def _origin(tree: Tree, event: Event, changes: Changes) -> int:
    """Return the id of the node at which a failure began.

    A run of an older version does not tell it: the failures are followed down from the node.
    """
    told = event.fields.get("origin")
    if isinstance(told, int):
        return told
    at = int(event.fields["node"])
    while True:
        failed = [
            changes[child.id][-1] for child in tree.children(tree.nodes[at])
            if child.id in changes and _fails(changes[child.id][-1])
        ]  # fmt: skip
        if not failed:
            return at
        at = int(max(failed, key=lambda one: one.number).fields["node"])


def _fails(event: Event) -> bool:
    return bool(event.fields["to"] == "failure")


def _failed(
    tree: Tree, number: int, node: Node, changes: list[Event], line_of: Callable[[str], str]
) -> FailedNode:
    event = changes[-1]
    begun = [one.time for one in changes if one.fields["to"] == "running"]
    return FailedNode(
        number, node.id, node.name, node.kind, str(event.fields.get("code", "")),
        str(event.fields.get("message") or ""), begun[-1] if begun else event.time, event.time,
        node.where, line_of(node.where), tree.path(node),
    )  # fmt: skip
