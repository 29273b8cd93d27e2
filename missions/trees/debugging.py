"""Breakpoints and forced outcomes: gates in front of single nodes.

A gate replaces the `execute_tick` of one node; nodes without a gate tick as usual, so a tree
without breakpoints costs nothing extra.

A node with a breakpoint is held before it starts: nothing of it has been called. The tick that
reaches it goes on to its end, and to the nodes above it looks as if it were running, so each keeps
its place. It starts with the next tick that reaches it. A node that is under way is not held again
before it has ended or was halted.

A forced node is not run any more: whenever it has a turn, it answers as it was told, and what ran
below it is halted first.
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
    """The outcome that a node is to have."""

    status: Status
    code: str = FailureCode.FAILED


class Gate:
    """Stands before one node.

    Attributes:
        named: how an operator last named the node.
        breaks: the node has a breakpoint.
        forced: what it answers; None lets it run.
    """

    def __init__(self, record: Record, execution: Execution, stops: list[Record]) -> None:
        self.record, self.node, self.execution = record, record.node, execution
        self.named, self.breaks = "", False
        self.forced: Forced | None = None
        self._stops, self._held, self._before = stops, False, Status.INVALID
        self._own = "execute_tick" in vars(self.node)
        self._inner = self.node.execute_tick  # type: ignore[attr-defined] # as `run` in advancing says
        self._place(self.execute_tick)

    @property
    def is_holding(self) -> bool:
        """Whether the node waits here for the next tick."""
        return self._held and self.node.status is Status.RUNNING

    def execute_tick(self) -> Status:
        """Tick the node, or hold it, or answer in its place."""
        held, self._held, node = self.is_holding, False, self.node
        if held:
            node.status = self._before
        elif self.breaks and node.status is not Status.RUNNING:
            self._held, self._before = True, node.status
            self._stops.append(self.record)
            node.status = Status.RUNNING
            return Status.RUNNING
        if self.forced is not None:
            return self._answer(self.forced)
        status: Status = self._inner()
        return status

    def remove(self) -> None:
        """Let the node be ticked as ever."""
        if self.is_holding:
            self.node.status = self._before
        if self._own:
            self._place(self._inner)
        else:
            del vars(self.node)["execute_tick"]

    def _place(self, execute_tick: Any) -> None:
        self.node.execute_tick = execute_tick  # type: ignore[attr-defined] # as above

    def _answer(self, forced: Forced) -> Status:
        node, status = self.node, forced.status
        if node.status is Status.RUNNING:
            halt(node)
        node.feedback_message = FORCED
        if status is Status.FAILURE:
            self.execution.fail(node, Failure(forced.code, FORCED))
        node.status = status
        self.execution.became(node, status)
        return status


class TreeDebugger:
    """What operators do to a running tree; survives the tree's replacement.

    Attributes:
        generation: how often the tree was replaced.
        faults: of the mission's file as last saved, which is not what runs.
    """

    def __init__(self, tree: MissionTree) -> None:
        self.generation, self.faults = 0, tuple[str, ...]()
        self._tree = tree
        self._gates: dict[int, Gate] = {}
        self._stops: list[Record] = []
        self._nodes = addresses(tree)

    def set_breakpoint(self, node: str) -> str:
        """Stop before a node starts; what was understood, in words.

        Raises:
            InputError: there is no such node.
        """
        found = self._find(node)
        for record in found:
            gate = self._gate(record)
            gate.breaks, gate.named = True, node
        return self._names(found)

    def clear_breakpoint(self, node: str = "") -> str:
        """Take breakpoints away; without a node all of them. A node that is held may start then.

        Raises:
            InputError: there is no such node, or no breakpoint at it.
        """
        broken = [gate for gate in self._gates.values() if gate.breaks]
        if node:
            wanted = {record.id for record in self._find(node)}
            broken = [gate for gate in broken if gate.record.id in wanted]
            if not broken:
                raise InputError(f"there is no breakpoint at {node!r}")
        for gate in broken:
            gate.breaks = False
        self._tidy()
        return self._names([gate.record for gate in broken]) or "there was none"

    def force(self, node: str, outcome: str, code: str = "") -> str:
        """Force an outcome on a node until `off`; `due` lets an event come once.

        Args:
            node: as in `missions.trees.addressing`.
            outcome: success | failure | off | due.
            code: of a failure; FAILED when empty.

        Raises:
            InputError: no such node, outcome or code.
        """
        found = self._find(node)
        if outcome == "due":
            return self._let_come(found, node)
        if outcome not in (*OUTCOMES, "off"):
            words = suggestion(outcome, [*OUTCOMES, "off", "due"])
            raise InputError(
                f"an outcome is success, failure, off or due, got {outcome!r}; {words}"
            )
        codes = [str(known) for known in FailureCode]
        if code and code not in codes:
            raise InputError(f"no failure has the code {code!r}; {suggestion(code, codes)}")
        forced = None if outcome == "off" else Forced(OUTCOMES[outcome], code or FailureCode.FAILED)
        for record in found:
            gate = self._gate(record)
            gate.forced, gate.named = forced, node
        self._tidy()
        return self._names(found)

    def take_stops(self) -> tuple[str, ...]:
        """The nodes that were held since the last call, each with its place in the file."""
        stops = tuple(self._shown(record) for record in self._stops)
        self._stops.clear()
        return stops

    def view(self) -> Debugging:
        """Breakpoints and forced outcomes, for the screen."""
        gates = [self._gates[number] for number in sorted(self._gates)]
        return Debugging(
            breakpoints=tuple(gate.record.id for gate in gates if gate.breaks),
            held=tuple(gate.record.id for gate in gates if gate.is_holding),
            forced={str(g.record.id): WORDS[g.forced.status] for g in gates if g.forced},
            generation=self.generation,
            faults=self.faults,
        )

    def move_to(self, tree: MissionTree) -> list[str]:
        """Debug another tree from now on; the paths of what could not be found again in it.

        A node is found again by its path, else by the name, path or line that the operator gave.
        """
        gates, former = self._gates, {node.id: node for node in self._nodes}
        for gate in gates.values():
            gate.remove()
        self._gates = {}
        self._stops.clear()
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
        """What a text means in this tree; a number meant a node of another."""
        try:
            return [] if text.removeprefix("#").isdecimal() else find_nodes(self._nodes, text)
        except InputError:
            return []

    def _find(self, text: str) -> list[Record]:
        records = self._tree.records
        return [records[number] for number in find_nodes(self._nodes, text)]

    def _gate(self, record: Record) -> Gate:
        if record.id not in self._gates:
            self._gates[record.id] = Gate(record, self._tree.execution, self._stops)
        return self._gates[record.id]

    def _tidy(self) -> None:
        """Take away gates that do nothing."""
        for number, gate in list(self._gates.items()):
            if not (gate.breaks or gate.forced or gate.is_holding):
                gate.remove()
                del self._gates[number]

    def _let_come(self, found: list[Record], node: str) -> str:
        events = [record for record in found if isinstance(record.node, Event)]
        if not events:
            raise InputError(f"{node!r} is not an event; only events can be due")
        for record in events:
            self._tree.force(record.node.name)
        return self._names(events)

    def _names(self, records: list[Record]) -> str:
        return ", ".join(self._shown(record) for record in records)

    def _shown(self, record: Record) -> str:
        where = self._nodes[record.id].where
        return f"{record.node.name!r} ({where})" if where else repr(record.node.name)


def addresses(tree: MissionTree) -> list[Addressed]:
    """What the nodes of a tree can be found by, in drawing order."""
    return [
        Addressed(
            record.id, record.parent, record.kind,
            tuple(dict.fromkeys((record.node.name, *record.names))),
            record.mark.file, record.mark.line, record.mark.column,
        )
        for record in tree.records
    ]  # fmt: skip
