"""`treepilot trace RUN`: the story of a finished run, node by node, from its event log alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from stack.errors import InputError
from stack.parameters import suggestion
from stack.telemetry.event_log import read_events
from stack.telemetry.records import ROUTINE, Event

GLYPHS = {"running": "▶", "success": "✔", "failure": "✘", "idle": "·"}


@dataclass
class Node:
    """A node of the recorded tree and what became of it.

    Attributes:
        running_since: robot time at which it began to run; None while it does not.
        seconds: total time that it ran.
        ended: statuses it came to, in order: success, failure or idle (halted).
        last: the last thing it said when it ended.
    """

    id: int
    parent: int
    kind: str
    name: str
    running_since: float | None = None
    seconds: float = 0.0
    starts: int = 0
    ended: list[str] = field(default_factory=list)
    last: str = ""

    @property
    def reached(self) -> bool:
        """Whether it was ever ticked."""
        return self.starts > 0 or bool(self.ended)

    def note(self, event: Event) -> None:
        """Take in one change of status."""
        to = str(event.fields["to"])
        if _is_reset(event):
            return
        if to == "running":
            self.running_since = event.time
            self.starts += 1
            return
        if self.running_since is not None:
            self.seconds += event.time - self.running_since
            self.running_since = None
        self.ended.append(to)
        self.last = str(event.fields.get("message") or "")


@dataclass(frozen=True)
class Trace:
    """A run that was read back: its nodes in drawing order and its events."""

    nodes: dict[int, Node]
    events: tuple[Event, ...]

    def depth(self, node: Node) -> int:
        """Distance from the root."""
        return 0 if node.parent not in self.nodes else 1 + self.depth(self.nodes[node.parent])

    def children(self, node: Node) -> list[Node]:
        """In order."""
        return [other for other in self.nodes.values() if other.parent == node.id]


def read_trace(folder: Path) -> Trace:
    """The trace of a run's folder; a run that was killed has one as well.

    Raises:
        InputError: the folder holds no events, or none that tell of a tree.
    """
    path = folder / "events.jsonl"
    if not path.is_file():
        raise InputError(f"{folder} is not a run's folder: it holds no events.jsonl")
    events = tuple(read_events(path))
    trees = [event for event in events if event.kind == "tree"]
    if not trees:
        raise InputError(f"{path} tells of no tree: it ended before the mission began")
    nodes = {row[0]: Node(*row) for row in trees[-1].fields["rows"]}
    for event in events:
        if event.kind == "node_status":
            nodes[int(event.fields["node"])].note(event)
    return Trace(nodes, events)


def story(trace: Trace, only: str = "", since: float = 0.0, until: float = 1e18) -> list[str]:
    """Every change of status in its order, indented by depth; other events in between.

    Args:
        trace: the run.
        only: the name or kind of a node: nothing but its changes and those below it.
        since: robot time, seconds.
        until: likewise.

    Raises:
        InputError: no node has that name.
    """
    chosen = _chosen(trace, only)
    lines = []
    for event in trace.events:
        if not since <= event.time <= until:
            continue
        if event.kind == "node_status":
            node = trace.nodes[int(event.fields["node"])]
            if _is_reset(event):
                continue
            if chosen is None or node.id in chosen:
                lines.append(_change(trace, node, event))
        elif chosen is None and event.kind not in ROUTINE:
            lines.append(f"{event.time:8.2f} s    {event.source}: {event.text}")
    return lines


def summary(trace: Trace) -> list[str]:
    """A line a node: how often it ran, how long, how it ended, or why it was never reached."""
    width = max(2 * trace.depth(node) + len(node.name) for node in trace.nodes.values())
    lines = []
    for node in trace.nodes.values():
        label = "  " * trace.depth(node) + node.name
        lines.append(f"{label:<{width}}  {_fate(trace, node)}")
    return lines


def _is_reset(event: Event) -> bool:
    """Whether a node that had ended was made ready to run again: nothing was halted."""
    return bool(event.fields["to"] == "idle" and event.fields["from"] != "running")


def _chosen(trace: Trace, only: str) -> set[int] | None:
    if not only:
        return None
    roots = [node for node in trace.nodes.values() if only in (node.name, node.kind)]
    if not roots:
        names = {node.name for node in trace.nodes.values()}
        raise InputError(f"no node is called {only!r}; {suggestion(only, names)}")
    return {below.id for root in roots for below in _below(trace, root)}


def _below(trace: Trace, node: Node) -> Iterable[Node]:
    yield node
    for child in trace.children(node):
        yield from _below(trace, child)


def _change(trace: Trace, node: Node, event: Event) -> str:
    to = str(event.fields["to"])
    said = "" if to == "idle" else str(event.fields.get("message") or "")
    indent = "  " * trace.depth(node)
    word = "halted" if to == "idle" else to
    return f"{event.time:8.2f} s  {indent}{GLYPHS[to]} {node.name}: {word}" + (
        f" ({said})" if said else ""
    )


def _fate(trace: Trace, node: Node) -> str:
    if not node.reached:
        return f"never reached: {_why_not(trace, node)}"
    counts = {word: node.ended.count(word) for word in ("success", "failure", "idle")}
    parts = [f"{node.seconds:7.1f} s"]
    names = {"success": "✔", "failure": "✘", "idle": "halted"}
    parts += [f"{names[word]} {count}" for word, count in counts.items() if count]
    if node.running_since is not None:
        parts.append("still running")
    return "  ".join([*parts, node.last if counts["failure"] else ""]).rstrip()


def _why_not(trace: Trace, node: Node) -> str:
    """The nearest reason above: what ended, or did not end, before its turn came."""
    parent = trace.nodes.get(node.parent)
    if parent is None:
        return "the mission did not begin"
    if not parent.reached:
        return f"{parent.name!r} above it was not"
    siblings = trace.children(parent)
    before = siblings[: siblings.index(node)]
    if parent.kind == "recover":
        return "its turn to recover did not come"
    for sibling in reversed(before):
        if sibling.running_since is not None:
            return f"{sibling.name!r} before it was still running"
        if sibling.ended:
            word = "halted" if sibling.ended[-1] == "idle" else sibling.ended[-1]
            return f"{sibling.name!r} before it ended with {word}"
    if parent.kind == "when":
        return "its `when` was not true"
    return f"{parent.name!r} ended before its turn"
