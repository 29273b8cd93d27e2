"""Events: they pre-empt the mission, and define how it continues."""

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
    """The trigger of an event: it is due when its condition has been true for `hold` seconds.

    Attributes:
        since: time at which the condition became true or the event last ended; None if it is false.
        forced: due regardless of the condition, for mission tests.
    """

    condition: Expression
    hold: Callable[[], float]
    since: float | None = None
    forced: bool = False

    def evaluate(self, now: float) -> None:
        """Evaluate the condition."""
        if not self.condition():
            self.since = None
        elif self.since is None:
            self.since = now

    def is_due(self, now: float) -> bool:
        """Return whether the event is due."""
        if self.forced:
            return True
        return self.since is not None and now >= self.since + self.hold() - TOLERANCE


class Event(Decorator):
    """One event: a trigger and a node; its outcome is that of the node."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, trigger: Trigger, then: str
    ) -> None:
        super().__init__(name, child, execution)
        self.trigger, self.then = trigger, then

    def advance(self, fresh: bool) -> Status:
        status = run(self.child)
        if status is Status.FAILURE:
            return self.execution.propagate_failure(self, self.child)
        return status


class Events(Node, composites.Composite):
    """Evaluates all events on every tick, then ticks the active event or the mission.

    The first event that is due starts. An active event runs until it ends; only an event listed
    before it pre-empts it. A pre-empted branch keeps its state: its running leaves are halted and
    start again when it is resumed, finished nodes stay finished, timeouts and delays are paused.
    The active branches form a stack with the mission at the bottom.
    """

    def __init__(self, events: Items[Event], mission: Behaviour, execution: Execution) -> None:
        super().__init__("events", [*events, mission])
        self.execution, self.events, self.mission = execution, list(events), mission
        self.stack: list[Behaviour] = []
        self.suspended_at: dict[int, float] = {}

    def advance(self, fresh: bool) -> Status:
        now = self.execution.time
        if fresh:
            self.reset()
            self.stack = [self.mission]
            self.suspended_at.clear()
            for event in self.events:
                event.trigger.since = None
        self._start_due_event(now)
        while True:
            top = self.current_child = self.stack[-1]
            status = run(top)
            if status is Status.FAILURE:
                return self._finish(self.execution.propagate_failure(self, top))
            if status is Status.RUNNING or not isinstance(top, Event):
                return status
            if self._done(top, now) is Status.FAILURE:
                return self._finish(Status.FAILURE)

    def _start_due_event(self, now: float) -> None:
        """Start the first event that is due, unless it or an earlier event is active."""
        due = None
        for event in self.events:
            event.trigger.evaluate(now)
            if due is None and event.trigger.is_due(now):
                due = event
        active = [node for node in self.stack if isinstance(node, Event)]
        limit = min((self.events.index(node) for node in active), default=len(self.events))
        if due is None or self.events.index(due) >= limit:
            return
        due.trigger.forced = False
        interrupted = self.stack[-1]
        if interrupted.status is Status.RUNNING:
            self._suspend(interrupted, now)
        halt(due)
        self.stack.append(due)
        why = due.trigger.condition.explain()
        self._emit(due, "event", f"{due.name}: {why}; interrupts {interrupted.name}")

    def _done(self, event: Event, now: float) -> Status:
        """Continue after the success of an event, as its `then` says."""
        event.trigger.since = None
        event.trigger.evaluate(now)
        self._emit(event, "event_done", f"{event.name} is done: {event.then}")
        if event.then == "abort":
            sentence = f"the event {event.name!r} ends the mission"
            return self.execution.fail(self, Failure(FailureCode.CANCELLED, sentence), event.name)
        self.stack.pop()
        if event.then == "restart":
            for node in self.stack:
                halt(node)
            self.stack = [self.mission]
        suspended = self.suspended_at.pop(id(self.stack[-1]), None)
        if suspended is not None and self.stack[-1].status is Status.RUNNING:
            for node in _running(self.stack[-1]):
                if isinstance(node, Node):
                    node.postpone(now - suspended)
        return Status.SUCCESS

    def _suspend(self, node: Behaviour, now: float) -> None:
        """Halt the running leaves of a branch; keep the state of the other nodes."""
        self.suspended_at[id(node)] = now
        for item in list(_running(node)):
            if item.children:
                self.execution.set_status(item, Status.INVALID)
            else:
                halt(item)

    def _finish(self, status: Status) -> Status:
        for child in self.children:
            if child.status is Status.RUNNING:
                halt(child)
        return status

    def _emit(self, event: Event, kind: str, text: str) -> None:
        self.execution.emit(
            level="warning" if kind == "event" else "info", kind=kind, text=text,
            fields={"node": self.execution.record(event).id, "name": event.name},
        )  # fmt: skip


def _running(node: Behaviour) -> Iterator[Behaviour]:
    """Yield the running nodes of a branch, the deepest first."""
    for child in node.children:
        if child.status is Status.RUNNING:
            yield from _running(child)
    if node.status is Status.RUNNING:
        yield node
