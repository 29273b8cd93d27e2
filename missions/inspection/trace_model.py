"""Model of a recorded run, read from its event log: trees, nodes, run times and outcomes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from missions.trees.addressing import Addressed, find_nodes
from stack.errors import Finding, InputError, Mark
from stack.telemetry.event_log import read_events
from stack.telemetry.records import Event

EVENT_LOG_BYTES = 1 << 28
"""Largest event log that is read; a run of 24 hours has about a tenth."""

STATUSES = frozenset({"idle", "running", "success", "failure"})


@dataclass
class Node:
    """A node of a recorded tree, with its run times and outcomes.

    Attributes:
        where: file and line; "" if not recorded.
        running_since: robot time of its start, seconds; None while it is not running.
        seconds: total running time.
        ended: outcomes in order: success, failure or idle (halted).
        last: message of the last outcome.
        held: whether it is stopped at a breakpoint.
        first: robot time of its first tick, seconds, and the state after it.
        now: robot time of its last change, seconds, and its state since.
    """

    id: int
    parent: int
    kind: str
    name: str
    where: str = ""
    running_since: float | None = None
    seconds: float = 0.0
    starts: int = 0
    ended: list[str] = field(default_factory=list)
    last: str = ""
    held: bool = False
    first: tuple[float, str] | None = None
    now: tuple[float, str] | None = None

    @property
    def reached(self) -> bool:
        """Whether it was ever ticked."""
        return self.starts > 0 or bool(self.ended)

    def note(self, event: Event) -> None:
        """Apply one status change."""
        to = str(event.fields["to"])
        self.held = False
        if is_reset(event):
            return
        self.now = event.time, to
        self.first = self.first or self.now
        if to == "running":
            self.running_since = event.time
            self.starts += 1
            return
        if self.running_since is not None:
            self.seconds += event.time - self.running_since
            self.running_since = None
        self.ended.append(to)
        self.last = str(event.fields.get("message") or "")


@dataclass
class Tree:
    """One tree of a run; every reload of the mission starts another.

    Attributes:
        nodes: by id, in drawing order; ids are unique within one tree only.
        began: robot time of its first tick, seconds.
        end: why it was halted; "" when it ended by itself or the reason was not recorded.
    """

    nodes: dict[int, Node]
    began: float
    end: str = ""

    def depth(self, node: Node) -> int:
        """Distance from the root."""
        return 0 if node.parent not in self.nodes else 1 + self.depth(self.nodes[node.parent])

    def path(self, node: Node) -> tuple[str, ...]:
        """Names of the nodes above a node, from the root."""
        above = self.nodes.get(node.parent)
        return () if above is None else (*self.path(above), above.name)

    def is_below(self, number: int, above: int) -> bool:
        """Return whether a node is in the subtree of another one, by their ids."""
        node = self.nodes.get(number)
        while node is not None and node.id != above:
            node = self.nodes.get(node.parent)
        return node is not None and number != above

    def children(self, node: Node) -> list[Node]:
        """Return the children of a node, in order."""
        return [other for other in self.nodes.values() if other.parent == node.id]

    def find(self, text: str) -> set[int]:
        """Return the ids of the nodes that match a text, with their subtrees.

        Raises:
            InputError: no node matches.
        """
        addresses = [_address(node) for node in self.nodes.values()]
        roots = [self.nodes[number] for number in find_nodes(addresses, text)]
        return {below.id for root in roots for below in self._below(root)}

    def _below(self, node: Node) -> Iterable[Node]:
        yield node
        for child in self.children(node):
            yield from self._below(child)


@dataclass(frozen=True)
class Trace:
    """A recorded run: its trees in order, and its events."""

    trees: tuple[Tree, ...]
    events: tuple[Event, ...]

    def with_trees(self) -> Iterator[tuple[Event, Tree, int]]:
        """Yield every event with the tree that its node ids belong to, and that tree's index."""
        count = 0
        for event in self.events:
            count += event.kind == "tree"
            yield event, self.trees[max(0, count - 1)], max(0, count - 1)


def read_trace(folder: Path) -> Trace:
    """Read the trace of a run folder; the run may have been killed.

    Raises:
        InputError: the folder has no event log, or the log has no tree, is not treepilot's, or has
            more than EVENT_LOG_BYTES.
        TelemetryError: a line is not an event.
    """
    path = folder / "events.jsonl"
    if not path.is_file():
        raise InputError(f"{folder} is not a run folder: it has no events.jsonl")
    size = path.stat().st_size
    if size > EVENT_LOG_BYTES:
        raise InputError(f"{path} has {size} bytes; at most {EVENT_LOG_BYTES} are read")
    events: list[Event] = []
    trees: list[Tree] = []
    for line, event in enumerate(read_events(path), start=1):
        events.append(event)
        try:
            if event.kind == "tree":
                trees.append(_tree(event))
            elif trees or event.kind == "node_status":
                _note(event, trees[-1])
        except (ValueError, TypeError, LookupError) as error:
            sentence = f"not an event of a run: {type(error).__name__}: {error}"
            raise InputError([Finding(Mark(str(path), line), "E004", sentence)]) from None
    if not trees:
        raise InputError(f"{path} has no tree: the run ended before the mission started")
    return Trace(tuple(trees), tuple(events))


def is_reset(event: Event) -> bool:
    """Return whether an ended node was reset to idle; nothing was halted."""
    return bool(event.fields["to"] == "idle" and event.fields["from"] != "running")


def _tree(event: Event) -> Tree:
    nodes = {int(row[0]): _node(*row) for row in event.fields["rows"]}
    for node in nodes.values():
        if node.parent >= node.id:  # nodes are numbered from the root on
            raise ValueError(f"node {node.id} is below node {node.parent}")
    return Tree(nodes, event.time)


def _node(number: int, parent: int, kind: str, name: str, where: str = "", *_later: object) -> Node:
    """The node of a recorded row; a later version may have written more."""
    return Node(int(number), int(parent), str(kind), str(name), str(where))


def _note(event: Event, tree: Tree) -> None:
    if event.kind == "node_status":
        if not {event.fields["from"], event.fields["to"]} <= STATUSES:
            raise ValueError(f"no status of a node: {event.fields['to']!r:.40}")
        tree.nodes[int(event.fields["node"])].note(event)
    elif event.kind == "breakpoint":
        for number in event.fields.get("nodes", ()):
            tree.nodes[number].held = True
    elif event.kind == "saved":
        tree.end = "the mission was reloaded"
    elif event.kind == "mission_ended" and event.fields.get("state") not in ("success", "failure"):
        tree.end = f"the mission was {event.fields.get('state')}"


def _address(node: Node) -> Addressed:
    file, _, line = node.where.rpartition(":")
    names = tuple(dict.fromkeys((node.name, node.kind)))
    number = int(line) if line.isdecimal() else 0
    return Addressed(node.id, node.parent, node.kind, names, file, number, 1)
