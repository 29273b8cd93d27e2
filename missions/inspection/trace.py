"""`treepilot trace RUN`: the story of a finished run, node by node, from its event log alone."""

from __future__ import annotations

from missions.inspection.trace_model import Node, Trace, Tree, is_reset, read_trace
from stack.errors import InputError
from stack.telemetry.records import ROUTINE, Event

__all__ = ["read_trace", "story", "summary"]

GLYPHS = {"running": "▶", "success": "✔", "failure": "✘", "idle": "·"}
OF_ALL_NODES = ("saved", "reload", "reload_refused")
"""Kinds of events that concern every node."""


def story(trace: Trace, only: str = "", since: float = 0.0, until: float = 1e18) -> list[str]:
    """Every change of status in its order, indented by depth; other events in between.

    Args:
        trace: the run.
        only: a node by number, name, kind, path or file:line: nothing but its changes and those
            below it, and what operators did to them; or why no tree of the run reached it.
        since: robot time, seconds.
        until: likewise.

    Raises:
        InputError: no node has that name.
    """
    chosen = _chosen(trace, only)
    lines = []
    for event, tree, number in trace.told():
        if not since <= event.time <= until:
            continue
        among = chosen[number]
        if event.kind == "tree" and number > 0:
            lines.append(f"{event.time:8.2f} s  ── tree {number + 1}, {event.text} ──")
        elif event.kind == "node_status":
            node = tree.nodes[int(event.fields["node"])]
            if not is_reset(event) and (among is None or node.id in among):
                lines.append(_change(tree, node, event))
        elif event.kind not in ROUTINE and _concerns(event, tree, among):
            lines.append(f"{event.time:8.2f} s    {event.source}: {event.text}")
    return lines + _never_reached(trace, chosen)


def summary(trace: Trace, only: str = "") -> list[str]:
    """A line a node: how often it ran, how long, how it ended, or why it was never reached.

    Args:
        trace: the run.
        only: as of `story`.
    """
    lines: list[str] = []
    for number, (tree, chosen) in enumerate(zip(trace.trees, _chosen(trace, only), strict=True), 1):
        if len(trace.trees) > 1:
            end = f", until {tree.end}" if tree.end else ""
            lines.append(f"── tree {number}, from {tree.began:.2f} s{end} ──")
        shown = [node for node in tree.nodes.values() if chosen is None or node.id in chosen]
        width = max((2 * tree.depth(node) + len(node.name) for node in shown), default=0)
        for node in shown:
            label = "  " * tree.depth(node) + node.name
            above = tree.nodes.get(node.parent)
            told = above is not None and not above.reached and above in shown
            lines.append(f"{label:<{width}}  {_fate(tree, node, told)}")
    return lines


def _chosen(trace: Trace, only: str) -> list[set[int] | None]:
    """For each tree the nodes to tell of; None for all."""
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
    """Why nodes that were asked for have no story: the outermost of them, if none was reached."""
    found = [
        (tree, tree.nodes[number])
        for tree, among in zip(trace.trees, chosen, strict=True)
        for number in sorted(among or ())
    ]
    if any(node.reached for _, node in found):
        return []
    wanted = {id(node) for _, node in found}
    return [
        f"{node.name}: never reached: {_why_not(tree, node)}"
        for tree, node in found
        if id(tree.nodes.get(node.parent)) not in wanted
    ]


def _concerns(event: Event, tree: Tree, among: set[int] | None) -> bool:
    """Whether an event that is no change of status tells of the chosen nodes."""
    if among is None or event.kind in OF_ALL_NODES:
        return True
    if event.kind == "breakpoint":
        return not among.isdisjoint(event.fields.get("nodes", ()))
    if event.kind != "command" or event.fields.get("refused"):
        return False
    named = event.fields.get("arguments", {}).get("node")
    try:
        return named is not None and not among.isdisjoint(tree.find(str(named)))
    except InputError:
        return False


def _change(tree: Tree, node: Node, event: Event) -> str:
    to = str(event.fields["to"])
    said = "" if to == "idle" else str(event.fields.get("message") or "")
    indent = "  " * tree.depth(node)
    word = "halted" if to == "idle" else to
    return f"{event.time:8.2f} s  {indent}{GLYPHS[to]} {node.name}: {word}" + (
        f" ({said})" if said else ""
    )


def _fate(tree: Tree, node: Node, told: bool) -> str:
    """What became of a node; `told` when the line above says why its parent was not reached."""
    if not node.reached:
        if told:
            return f"never reached: {tree.nodes[node.parent].name!r} above it was not"
        return f"never reached: {_why_not(tree, node)}"
    counts = {word: node.ended.count(word) for word in ("success", "failure", "idle")}
    parts = [f"{node.seconds:7.1f} s"]
    names = {"success": "✔", "failure": "✘", "idle": "halted"}
    parts += [f"{names[word]} {count}" for word, count in counts.items() if count]
    if node.running_since is not None:
        parts.append("still running")
    return "  ".join([*parts, node.last if counts["failure"] else ""]).rstrip()


def _why_not(tree: Tree, node: Node) -> str:
    """The nearest reason above: what ended, or did not end, before its turn came."""
    if node.held:
        return "it stood at a breakpoint" + (f" until {tree.end}" if tree.end else " to the end")
    parent = tree.nodes.get(node.parent)
    if parent is None:
        return tree.end or "the mission did not begin"
    if not parent.reached:
        why = _why_not(tree, parent)
        return why if parent.kind == "event" else f"{parent.name!r} above it was not: {why}"
    if parent.last.startswith("forced by"):
        return f"{parent.name!r} above it was forced to {parent.ended[-1]}"
    if node.kind == "event":
        return "the event never came"
    return _turn_did_not_come(tree, parent, node)


def _turn_did_not_come(tree: Tree, parent: Node, node: Node) -> str:
    own_words = {
        "recover": "its turn to recover did not come",
        "when": "its `when` was not true",
        "while": "its `while` was not true",
        "for_each": "there was nothing to do it for",
    }
    if parent.kind in own_words:
        return own_words[parent.kind]
    siblings = tree.children(parent)
    for sibling in reversed(siblings[: siblings.index(node)]):
        if sibling.held:
            return f"{sibling.name!r} before it stood at a breakpoint"
        if sibling.running_since is not None:
            return f"{sibling.name!r} before it was still running"
        if sibling.ended:
            return f"{sibling.name!r} before it {_ended(tree, sibling)}"
    return f"{parent.name!r} ended before its turn"


def _ended(tree: Tree, node: Node) -> str:
    if node.ended[-1] == "idle":
        return "was halted" + (f" when {tree.end}" if tree.end else "")
    forced = ", forced by the operator" if node.last.startswith("forced by") else ""
    return f"ended with {node.ended[-1]}{forced}"
