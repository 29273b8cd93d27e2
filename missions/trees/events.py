"""Events: what pre-empts the mission, and how the mission goes on afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as Items
from dataclasses import dataclass

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import Execution, halt
from missions.trees.decorators import TOLERANCE
from missions.trees.node import Decorator, Node, run
from stack.types import Expression, Failure, FailureCode


@dataclass(slots=True)
class Trigger:
    """When an event is due: its condition has held for `hold` seconds.

    Attributes:
        since: when the condition became true, or the event last ended; None while it is false.
        forced: due whatever the condition says; for tests of missions.
    """

    condition: Expression
    hold: Callable[[], float]
    since: float | None = None
    forced: bool = False

    def look(self, now: float) -> None:
        """Note whether the condition holds."""
        if not self.condition():
            self.since = None
        elif self.since is None:
            self.since = now

    def is_due(self, now: float) -> bool:
        """Whether it has held for long enough."""
        if self.forced:
            return True
        return self.since is not None and now >= self.since + self.hold() - TOLERANCE


class Event(Decorator):
    """One event: a name, a trigger, and the node that is run. Adds nothing to what that does."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, trigger: Trigger, then: str
    ) -> None:
        super().__init__(name, child, execution)
        self.trigger, self.then = trigger, then

    def advance(self, fresh: bool) -> Status:
        status = run(self.child)
        if status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        return status


class Events(Node, composites.Composite):
    """Looks at all events on every tick, then ticks the one under way, or the mission.

    The first that is due wins. One under way goes on to its end, and only one listed before it
    pre-empts it. What is pre-empted stands still and keeps its place: its running leaves are
    halted, and start again when it is resumed; what was done stays done; time limits and delays
    stand still meanwhile. What is under way makes a stack, the mission at the bottom.
    """

    def __init__(self, events: Items[Event], mission: Behaviour, execution: Execution) -> None:
        super().__init__("events", [*events, mission])
        self.execution, self.events, self.mission = execution, list(events), mission
        self.stack: list[Behaviour] = []
        self.left_at: dict[int, float] = {}

    def advance(self, fresh: bool) -> Status:
        now = self.execution.time
        if fresh:
            self.reset()
            self.stack = [self.mission]
            self.left_at.clear()
            for event in self.events:
                event.trigger.since = None
        self._look(now)
        while True:
            top = self.current_child = self.stack[-1]
            status = run(top)
            if status is Status.FAILURE:
                return self._over(self.execution.pass_on(self, top))
            if status is Status.RUNNING or not isinstance(top, Event):
                return status
            if self._done(top, now) is Status.FAILURE:
                return self._over(Status.FAILURE)

    def _look(self, now: float) -> None:
        """Start the first event that is due, unless one before it, or itself, is under way."""
        due = None
        for event in self.events:
            event.trigger.look(now)
            if due is None and event.trigger.is_due(now):
                due = event
        under_way = [node for node in self.stack if isinstance(node, Event)]
        limit = min((self.events.index(node) for node in under_way), default=len(self.events))
        if due is None or self.events.index(due) >= limit:
            return
        due.trigger.forced = False
        interrupted = self.stack[-1]
        if interrupted.status is Status.RUNNING:
            self._suspend(interrupted, now)
        halt(due)
        self.stack.append(due)
        why = due.trigger.condition.explain()
        self._tell(due, "event", f"{due.name}: {why}; interrupts {interrupted.name}")

    def _done(self, event: Event, now: float) -> Status:
        """An event has ended well: go on as it says."""
        event.trigger.since = None
        event.trigger.look(now)
        self._tell(event, "event_done", f"{event.name} is done: {event.then}")
        if event.then == "abort":
            sentence = f"the event {event.name!r} ends the mission"
            return self.execution.fail(self, Failure(FailureCode.CANCELLED, sentence), event.name)
        self.stack.pop()
        if event.then == "restart":
            for node in self.stack:
                halt(node)
            self.stack = [self.mission]
        left = self.left_at.pop(id(self.stack[-1]), None)
        if left is not None and self.stack[-1].status is Status.RUNNING:
            for node in _under_way(self.stack[-1]):
                if isinstance(node, Node):
                    node.postpone(now - left)
        return Status.SUCCESS

    def _suspend(self, node: Behaviour, now: float) -> None:
        """Bring what runs to rest, and leave the rest as it is."""
        self.left_at[id(node)] = now
        for item in list(_under_way(node)):
            if item.children:
                self.execution.became(item, Status.INVALID)
            else:
                halt(item)

    def _over(self, status: Status) -> Status:
        for child in self.children:
            if child.status is Status.RUNNING:
                halt(child)
        return status

    def _tell(self, event: Event, kind: str, text: str) -> None:
        self.execution.emit(
            level="warning" if kind == "event" else "info", kind=kind, text=text,
            fields={"node": self.execution.record(event).id, "name": event.name},
        )  # fmt: skip


def _under_way(node: Behaviour) -> Iterator[Behaviour]:
    """The running nodes of a branch, the deepest first."""
    for child in node.children:
        if child.status is Status.RUNNING:
            yield from _under_way(child)
    if node.status is Status.RUNNING:
        yield node
