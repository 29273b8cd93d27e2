"""The nodes whose failures ended a mission."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from missions.inspection.page.story import Story
from missions.inspection.trace_model import Node, Tree, is_reset
from stack.telemetry.records import Event


@dataclass(frozen=True, slots=True)
class FailedNode:
    """The node whose failure ended the mission.

    Attributes:
        name: of the node; kind: the word in the mission.
        code: of the failure; empty in a run of an older version. message: why, for people.
        begin: robot time of its last start, seconds; time: of the failure.
        where: file and line of the mission; line: its text.
    """

    name: str
    kind: str
    code: str
    message: str
    begin: float
    time: float
    where: str
    line: str

    @property
    def line_number(self) -> int:
        """Line of the mission; 0 if it is not known."""
        number = self.where.rpartition(":")[2]
        return int(number) if number.isdecimal() else 0


MOST_EARLIER = 3
"""Earlier failures that are looked at."""

Changes = dict[int, list[Event]]
"""Changes of status of the nodes of a tree, by the id of the node."""


def failed_node(story: Story) -> FailedNode | None:
    """Return the first cause: follow the failures from the root of the last tree."""
    if story.status != "failure":
        return None
    tree, changes = story.trace.trees[-1], _changes(story)
    node: Node | None = next(iter(tree.nodes.values()), None)
    found: Event | None = None
    while node is not None and _fails(changes.get(node.id, [])):
        found = changes[node.id][-1]
        node = max(
            _failed_children(tree, node, changes),
            key=lambda child: changes[child.id][-1].number, default=None,
        )  # fmt: skip
    return None if found is None else _told(story, tree, found, changes)


def earlier_failures(story: Story) -> list[FailedNode]:
    """Return the last leaves that failed, newest first: a fallback may have hidden the cause."""
    tree, changes = story.trace.trees[-1], _changes(story)
    events = [
        event
        for number, every in changes.items()
        if not tree.children(tree.nodes[number])
        for event in every
        if event.fields["to"] == "failure"
    ]
    newest = sorted(events, key=lambda event: event.number)[-MOST_EARLIER:]
    return [_told(story, tree, event, changes) for event in reversed(newest)]


def _changes(story: Story) -> Changes:
    """Return the changes in the last tree; the reset of a node that has ended is none."""
    changes: Changes = {}
    for event, _, number in story.trace.with_trees():
        is_last = number == len(story.trace.trees) - 1
        if is_last and event.kind == "node_status" and not is_reset(event):
            changes.setdefault(int(event.fields["node"]), []).append(event)
    return changes


def _failed_children(tree: Tree, node: Node, changes: Changes) -> Iterator[Node]:
    """Yield the children that failed, and were not started again or halted since."""
    for child in tree.children(node):
        if _fails(changes.get(child.id, [])):
            yield child


def _fails(changes: list[Event]) -> bool:
    return bool(changes) and changes[-1].fields["to"] == "failure"


def _told(story: Story, tree: Tree, event: Event, changes: Changes) -> FailedNode:
    node = tree.nodes[int(event.fields["node"])]
    before = [one for one in changes[node.id] if one.number < event.number]
    begun = [one.time for one in before if one.fields["to"] == "running"]
    return FailedNode(
        node.name, node.kind, str(event.fields.get("code", "")),
        str(event.fields.get("message") or ""), begun[-1] if begun else event.time, event.time,
        node.where, story.line_of(node.where),
    )  # fmt: skip
