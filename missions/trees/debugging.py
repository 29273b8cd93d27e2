"""Breakpoints and forced outcomes: gates in front of single nodes.

A node asks the gate in its record before each tick; most nodes have none.

A node with a breakpoint is held before it starts: none of its methods has been called. The current
tick continues, and for its parents the held node is running, so they keep their position. The node
starts with the next tick that reaches it. A running node is not held again before it has ended or
was halted.

A forced node does not run: when it is ticked, it returns the forced outcome. Its running children
are halted first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from py_trees.common import Status

from missions.trees.addressing import Addressed, find_nodes, path_of
from missions.trees.context import WORDS, Execution, Record, halt
from missions.trees.events import Event
from missions.trees.mission_tree import MissionTree
from stack.errors import InputError
from stack.parameters import suggestion
from stack.telemetry.records import Debugging
from stack.types import Failure, FailureCode

OUTCOMES = {"success": Status.SUCCESS, "failure": Status.FAILURE}
FORCED = "forced by the operator"


@dataclass(frozen=True, slots=True)
class Forced:
    """A forced outcome."""

    status: Status
    code: str = FailureCode.FAILED


class DebuggerGate:
    """Holds one node at a breakpoint, or forces its outcome.

    Attributes:
        named: the address that the operator last used for the node.
        breaks: whether the node has a breakpoint.
        forced: the outcome to return; None lets the node run.
    """

    def __init__(self, record: Record, execution: Execution, hits: list[Record]) -> None:
        self.record, self.execution = record, execution
        self.node: Any = record.node
        self.named, self.breaks = "", False
        self.forced: Forced | None = None
        self._hits, self._held, self._before = hits, False, Status.INVALID
        record.gate = self

    @property
    def is_holding(self) -> bool:
        """Whether the node is held until the next tick."""
        return self._held and self.node.status is Status.RUNNING

    def outcome(self) -> Status | None:
        """Hold the node or force its outcome and return its status; None to tick it."""
        held, self._held, node = self.is_holding, False, self.node
        if held:
            node.status = self._before
        elif self.breaks and node.status is not Status.RUNNING:
            self._held, self._before = True, node.status
            self._hits.append(self.record)
            node.status = Status.RUNNING
            return Status.RUNNING
        if self.forced is not None:
            return self._return_forced(self.forced)
        return None

    def remove(self) -> None:
        """Remove the gate; the node ticks as usual again."""
        if self.is_holding:
            self.node.status = self._before
        self.record.gate = None

    def _return_forced(self, forced: Forced) -> Status:
        node, status = self.node, forced.status
        if node.status is Status.RUNNING:
            halt(node)
        node.feedback_message = FORCED
        node.skipped = False
        if status is Status.FAILURE:
            self.execution.fail(node, Failure(forced.code, FORCED))
        node.status = status
        self.execution.set_status(node, status)
        self.execution.mark_stale(self.record)
        return status


class TreeDebugger:
    """Breakpoints and forced outcomes of a running tree; kept when the tree is replaced.

    Attributes:
        generation: number of replacements of the tree.
        faults: errors of the mission file as last saved; the running tree is an older version.
    """

    def __init__(self, tree: MissionTree) -> None:
        self.generation, self.faults = 0, tuple[str, ...]()
        self._tree = tree
        self._gates: dict[int, DebuggerGate] = {}
        self._hits: list[Record] = []
        self._nodes = addresses(tree)

    def set_breakpoint(self, node: str) -> str:
        """Stop before a node starts; return the nodes found, as text.

        Raises:
            InputError: no node has this address.
        """
        found = self._find(node)
        for record in found:
            gate = self._gate(record)
            gate.breaks, gate.named = True, node
        return self._names(found)

    def clear_breakpoint(self, node: str = "") -> str:
        """Remove the breakpoints of a node, or all; a held node can then start.

        Raises:
            InputError: no node has this address, or it has no breakpoint.
        """
        broken = [gate for gate in self._gates.values() if gate.breaks]
        if node:
            wanted = {record.id for record in self._find(node)}
            broken = [gate for gate in broken if gate.record.id in wanted]
            if not broken:
                raise InputError(f"there is no breakpoint at {node!r}")
        for gate in broken:
            gate.breaks = False
        self._remove_idle_gates()
        return self._names([gate.record for gate in broken]) or "there are no breakpoints"

    def force(self, node: str, outcome: str, code: str = "") -> str:
        """Force the outcome of a node until `off`; `due` lets an event fire once.

        Args:
            node: address, see `missions.trees.addressing`.
            outcome: success | failure | off | due.
            code: failure code; FAILED if empty.

        Raises:
            InputError: unknown node, outcome or code.
        """
        found = self._find(node)
        if outcome == "due":
            return self._fire(found, node)
        if outcome not in (*OUTCOMES, "off"):
            hint = suggestion(outcome, [*OUTCOMES, "off", "due"])
            raise InputError(f"expected success, failure, off or due, got {outcome!r}; {hint}")
        codes = [str(known) for known in FailureCode]
        if code and code not in codes:
            raise InputError(f"there is no failure code {code!r}; {suggestion(code, codes)}")
        forced = None if outcome == "off" else Forced(OUTCOMES[outcome], code or FailureCode.FAILED)
        for record in found:
            gate = self._gate(record)
            gate.forced, gate.named = forced, node
        self._remove_idle_gates()
        return self._names(found)

    def pop_breakpoint_hits(self) -> tuple[str, ...]:
        """Return the nodes held since the last call, each with its position in the file."""
        hits = tuple(self._shown(record) for record in self._hits)
        self._hits.clear()
        return hits

    def view(self) -> Debugging:
        """Return breakpoints and forced outcomes, for the dashboard."""
        gates = [self._gates[number] for number in sorted(self._gates)]
        return Debugging(
            breakpoints=tuple(gate.record.id for gate in gates if gate.breaks),
            held=tuple(gate.record.id for gate in gates if gate.is_holding),
            forced={str(g.record.id): WORDS[g.forced.status] for g in gates if g.forced},
            generation=self.generation,
            faults=self.faults,
        )

    def move_to(self, tree: MissionTree) -> list[str]:
        """Move all gates to another tree; return the paths of nodes not found in it.

        A node is found by its path, else by the name, path or line that the operator used.
        """
        gates, former = self._gates, {node.id: node for node in self._nodes}
        for gate in gates.values():
            gate.remove()
        self._gates = {}
        self._hits.clear()
        self._tree, self._nodes = tree, addresses(tree)
        by_id = {node.id: node for node in self._nodes}
        places: dict[str, list[int]] = {}
        for number in by_id:
            places.setdefault(path_of(by_id, number), []).append(number)
        lost = []
        for number in sorted(gates):
            path, old = path_of(former, number), gates[number]
            found = places.get(path) or self._named(old.named)
            if not found:
                lost.append(path)
            for place in found:
                gate = self._gate(tree.records[place])
                gate.breaks, gate.forced = old.breaks or gate.breaks, old.forced or gate.forced
                gate.named = old.named
        return lost

    def _named(self, text: str) -> list[int]:
        """Return the nodes with this address in the current tree; numbers refer to the old one."""
        try:
            return [] if text.removeprefix("#").isdecimal() else find_nodes(self._nodes, text)
        except InputError:
            return []

    def _find(self, text: str) -> list[Record]:
        records = self._tree.records
        return [records[number] for number in find_nodes(self._nodes, text)]

    def _gate(self, record: Record) -> DebuggerGate:
        if record.id not in self._gates:
            self._gates[record.id] = DebuggerGate(record, self._tree.execution, self._hits)
        return self._gates[record.id]

    def _remove_idle_gates(self) -> None:
        """Remove gates without a function."""
        for number, gate in list(self._gates.items()):
            if not (gate.breaks or gate.forced or gate.is_holding):
                gate.remove()
                del self._gates[number]

    def _fire(self, found: list[Record], node: str) -> str:
        events = [record for record in found if isinstance(record.node, Event)]
        if not events:
            raise InputError(f"{node!r} is not an event; `due` is only for events")
        for record in events:
            self._tree.force(record.node.name)
        return self._names(events)

    def _names(self, records: list[Record]) -> str:
        return ", ".join(self._shown(record) for record in records)

    def _shown(self, record: Record) -> str:
        where = self._nodes[record.id].where
        return f"{record.node.name!r} ({where})" if where else repr(record.node.name)


def addresses(tree: MissionTree) -> list[Addressed]:
    """Return the addresses of the nodes of a tree, in drawing order."""
    return [
        Addressed(
            record.id, record.parent, record.kind,
            tuple(dict.fromkeys((record.node.name, *record.names))),
            record.mark.file, record.mark.line, record.mark.column,
        )
        for record in tree.records
    ]  # fmt: skip
