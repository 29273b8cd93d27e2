"""`treepilot trace RUN`: what each node did in a finished run, read from its event log."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from math import inf

from missions.inspection.trace_model import Node, Trace, Tree, is_reset, read_trace
from missions.language.kinds import CONTROLS, NODES
from missions.trees.debugging import FORCED
from stack.errors import InputError
from stack.telemetry.records import ROUTINE, Event

__all__ = ["read_trace", "story", "summary"]

GLYPHS = {"running": "▶", "success": "✔", "failure": "✘", "idle": "·"}
OF_ALL_NODES = ("saved", "reload", "reload_refused")
"""Event kinds that concern every node."""


def story(trace: Trace, only: str = "", since: float = 0.0, until: float = 1e18) -> list[str]:
    """Return every status change in order, indented by depth, with other events in between.

    Args:
        trace: the run.
        only: a node by number, name, kind, path or file:line. Shows its subtree only: the status
            changes and operator commands; or the reason why it was never reached.
        since: first robot time, seconds.
        until: last robot time, seconds.

    Raises:
        InputError: unknown node.
    """
    chosen = _chosen(trace, only)
    lines = []
    for event, tree, number in _in_order_of_ticks(trace):
        if not since <= event.time <= until:
            continue
        selected = chosen[number]
        if event.kind == "tree" and number > 0:
            lines.append(f"{event.time:8.2f} s  ── tree {number + 1}, {event.text} ──")
        elif event.kind == "node_status":
            node = tree.nodes[int(event.fields["node"])]
            if not is_reset(event) and (selected is None or node.id in selected):
                lines.append(_change(tree, node, event))
        elif event.kind not in ROUTINE and _concerns(event, tree, selected):
            lines.append(f"{event.time:8.2f} s    {event.source}: {event.text}")
    return lines + _never_reached(trace, chosen)


def tree_at(trace: Trace, time: float) -> list[str]:
    """Return the tree as it was at a robot time, a line for each node with its status and message.

    Raises:
        InputError: the time is before the mission began.
    """
    states: dict[int, Event] = {}
    shown: Tree | None = None
    for event, tree, _ in trace.with_trees():
        if event.time > time:
            break
        if tree is not shown:
            shown, states = tree, {}
        if event.kind == "node_status":
            states[int(event.fields["node"])] = event
    if shown is None:
        raise InputError(f"at {time:g} s the mission had not begun")
    lines = [f"the tree at {time:.2f} s:"]
    for node in shown.nodes.values():
        change = states.get(node.id)
        status = "idle" if change is None else str(change.fields["to"])
        line = f"{'  ' * shown.depth(node)}{GLYPHS[status]} {node.name}"
        if change is not None and status != "idle":
            line += f": {status} since {change.time:.2f} s"
            message = str(change.fields.get("message") or "")
            line += f" ({message})" if message else ""
        lines.append(line)
    return lines


def summary(trace: Trace, only: str = "") -> list[str]:
    """Return one line per node: run time, outcomes, first and last state, or why it never ran.

    Nodes with one parent stand in the order of their first ticks.

    Args:
        trace: the run.
        only: a node, see `story`.
    """
    lines: list[str] = []
    for number, (tree, chosen) in enumerate(zip(trace.trees, _chosen(trace, only), strict=True), 1):
        if len(trace.trees) > 1:
            end = f", until {tree.end}" if tree.end else ""
            lines.append(f"── tree {number}, from {tree.began:.2f} s{end} ──")
        shown = [node for node in _by_first_tick(tree) if chosen is None or node.id in chosen]
        width = max((2 * tree.depth(node) + len(node.name) for node in shown), default=0)
        for node in shown:
            label = "  " * tree.depth(node) + node.name
            parent = tree.nodes.get(node.parent)
            explained = parent is not None and not parent.reached and parent in shown
            lines.append(f"{label:<{width}}  {_outcome(tree, node, explained)}")
    return lines


def _in_order_of_ticks(trace: Trace) -> Iterator[tuple[Event, Tree, int]]:
    """Yield the events; a node that starts in a tick stands before its children of this tick.

    The log has it after them: its status is known when they have been ticked.
    """
    for _, group in groupby(
        trace.with_trees(), key=lambda item: (item[0].step, item[0].time, item[2])
    ):
        ordered: list[tuple[Event, Tree, int]] = []
        for event, tree, number in group:
            at = len(ordered)
            if event.kind == "node_status" and event.fields["to"] == "running":
                parent = int(event.fields["node"])
                at = next(
                    (
                        place
                        for place, (other, _, _) in enumerate(ordered)
                        if other.kind == "node_status"
                        and tree.is_below(int(other.fields["node"]), parent)
                    ),
                    at,
                )
            ordered.insert(at, (event, tree, number))
        yield from ordered


def _by_first_tick(tree: Tree) -> list[Node]:
    """Return the nodes, parents first, children in the order of their first ticks."""
    found: list[Node] = []

    def add(node: Node) -> None:
        found.append(node)
        for child in sorted(tree.children(node), key=_first_time):
            add(child)

    roots = [node for node in tree.nodes.values() if node.parent not in tree.nodes]
    for root in sorted(roots, key=_first_time):
        add(root)
    return found


def _first_time(node: Node) -> float:
    return node.first[0] if node.first is not None else inf


def _chosen(trace: Trace, only: str) -> list[set[int] | None]:
    """Return the selected node ids of each tree; None selects all."""
    if not only:
        return [None] * len(trace.trees)
    found: list[set[int] | None] = []
    refusal: InputError | None = None
    for tree in trace.trees:
        try:
            found.append(tree.find(only))
        except InputError as error:
            refusal = error
            found.append(set())
    if refusal is not None and not any(found):
        raise refusal
    return found


def _never_reached(trace: Trace, chosen: list[set[int] | None]) -> list[str]:
    """Return why the selected nodes were never reached; nothing if one of them was."""
    found = [
        (tree, tree.nodes[number])
        for tree, selected in zip(trace.trees, chosen, strict=True)
        for number in sorted(selected or ())
    ]
    if any(node.reached for _, node in found):
        return []
    wanted = {id(node) for _, node in found}
    return [
        f"{node.name}: never reached: {_why_not(tree, node)}"
        for tree, node in found
        if id(tree.nodes.get(node.parent)) not in wanted
    ]


def _concerns(event: Event, tree: Tree, selected: set[int] | None) -> bool:
    """Return whether an event other than a status change concerns the selected nodes."""
    if selected is None or event.kind in OF_ALL_NODES:
        return True
    if event.kind == "breakpoint":
        return not selected.isdisjoint(event.fields.get("nodes", ()))
    if event.kind != "command" or event.fields.get("refused"):
        return False
    arguments = event.fields.get("arguments")
    named = arguments.get("node") if isinstance(arguments, dict) else None
    try:
        return named is not None and not selected.isdisjoint(tree.find(str(named)))
    except InputError:
        return False


def _change(tree: Tree, node: Node, event: Event) -> str:
    to = str(event.fields["to"])
    message = "" if to == "idle" else str(event.fields.get("message") or "")
    indent = "  " * tree.depth(node)
    word = "halted" if to == "idle" else to
    return f"{event.time:8.2f} s  {indent}{GLYPHS[to]} {node.name}: {word}" + (
        f" ({message})" if message else ""
    )


def _outcome(tree: Tree, node: Node, explained: bool) -> str:
    """Return run time and outcomes; `explained` if a line above says why the parent never ran."""
    if not node.reached:
        if explained:
            return f"never reached: parent {tree.nodes[node.parent].name!r} not reached"
        return f"never reached: {_why_not(tree, node)}"
    counts = {word: node.ended.count(word) for word in ("success", "failure", "idle")}
    parts = [f"{node.seconds:7.1f} s"]
    names = {"success": "✔", "failure": "✘", "idle": "halted"}
    parts += [f"{names[word]} {count}" for word, count in counts.items() if count]
    if node.running_since is not None:
        parts.append("still running")
    if node.first is not None and node.now is not None:
        parts.append(" … ".join(dict.fromkeys(map(_state, (node.first, node.now)))))
    return "  ".join([*parts, node.last if counts["failure"] else ""]).rstrip()


def _state(state: tuple[float, str]) -> str:
    time, word = state
    return f"{time:.2f} s {'halted' if word == 'idle' else word}"


def _why_not(tree: Tree, node: Node) -> str:
    """Return the nearest cause for a node that was never reached."""
    if node.held:
        return "stopped at a breakpoint" + (f" until {tree.end}" if tree.end else " to the end")
    parent = tree.nodes.get(node.parent)
    if parent is None:
        return tree.end or "the mission did not start"
    if not parent.reached:
        why = _why_not(tree, parent)
        return why if parent.kind == "event" else f"parent {parent.name!r} not reached: {why}"
    if parent.last == FORCED:
        return f"parent {parent.name!r} was forced to {parent.ended[-1]}"
    if node.kind == "event":
        return "the event did not occur"
    return _why_not_its_turn(tree, parent, node)


def _why_not_its_turn(tree: Tree, parent: Node, node: Node) -> str:
    kind = CONTROLS.get(parent.kind) or NODES.get(parent.kind)
    if kind is not None and kind.empty:
        return kind.empty
    siblings = tree.children(parent)
    for sibling in reversed(siblings[: siblings.index(node)]):
        if sibling.held:
            return f"previous node {sibling.name!r} stopped at a breakpoint"
        if sibling.running_since is not None:
            return f"previous node {sibling.name!r} was still running"
        if sibling.ended:
            return f"previous node {sibling.name!r} {_ended(tree, sibling)}"
    return f"parent {parent.name!r} ended before"


def _ended(tree: Tree, node: Node) -> str:
    if node.ended[-1] == "idle":
        return "was halted" + (f" when {tree.end}" if tree.end else "")
    forced = f", {FORCED}" if node.last == FORCED else ""
    return f"ended with {node.ended[-1]}{forced}"
