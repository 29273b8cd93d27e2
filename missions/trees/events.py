"""Events: they pre-empt the mission, and define how it continues."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from collections.abc import Sequence as Items
from dataclasses import dataclass
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from missions.trees.context import Execution, halt
from missions.trees.node import Decorator, InnerNode, Node, run
from stack.types import Expression, Failure, FailureCode


@dataclass(slots=True)
class Trigger:
    """The trigger of an event: it is due when its condition has been true for `hold` seconds.

    Attributes:
        timer: started when the condition became true or the event last ended.
        counts: the timer runs: the condition is true.
        forced: due regardless of the condition, for mission tests.
    """

    condition: Expression
    hold: Callable[[], float]
    timer: Timer
    counts: bool = False
    forced: bool = False

    def evaluate(self) -> None:
        """Evaluate the condition."""
        if not self.condition():
            self.counts = False
        elif not self.counts:
            self.counts = True
            self.timer.restart()

    def is_due(self) -> bool:
        """Return whether the event is due."""
        return self.forced or (self.counts and self.timer.is_over(self.hold()))


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


class Events(InnerNode, composites.Composite):
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
        self.suspensions: dict[int, Timer] = {}

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            self.stack = [self.mission]
            self.suspensions.clear()
            for event in self.events:
                event.trigger.counts = False
        self._start_due_event()
        while True:
            top = self.current_child = self.stack[-1]
            status = run(top)
            if status is Status.FAILURE:
                return self._finish(self.execution.propagate_failure(self, top))
            if status is Status.RUNNING or not isinstance(top, Event):
                return status
            if self._done(top) is Status.FAILURE:
                return self._finish(Status.FAILURE)

    def timers(self) -> Iterable[Timer]:
        return (*(event.trigger.timer for event in self.events), *self.suspensions.values())

    def _start_due_event(self) -> None:
        """Start the first event that is due, unless it or an earlier event is active."""
        due = None
        for event in self.events:
            event.trigger.evaluate()
            if due is None and event.trigger.is_due():
                due = event
        active = [node for node in self.stack if isinstance(node, Event)]
        limit = min((self.events.index(node) for node in active), default=len(self.events))
        if due is None or self.events.index(due) >= limit:
            return
        due.trigger.forced = False
        interrupted = self.stack[-1]
        if interrupted.status is Status.RUNNING:
            self._suspend(interrupted)
        halt(due)
        self.stack.append(due)
        why = due.trigger.condition.explain()
        self._emit(due, "event", f"{due.name}: {why}; interrupts {interrupted.name}")

    def _done(self, event: Event) -> Status:
        """Continue after the success of an event, as its `then` says."""
        event.trigger.counts = False
        event.trigger.evaluate()
        self._emit(event, "event_done", f"{event.name} is done: {event.then}")
        if event.then == "abort":
            sentence = f"the event {event.name!r} ends the mission"
            return self.execution.fail(self, Failure(FailureCode.CANCELLED, sentence), event.name)
        self.stack.pop()
        if event.then == "restart":
            for node in self.stack:
                halt(node)
            self.stack = [self.mission]
        suspension = self.suspensions.pop(id(self.stack[-1]), None)
        if suspension is not None:
            for node in _running(self.stack[-1]):
                node.postpone(suspension.elapsed)
        return Status.SUCCESS

    def _suspend(self, node: Behaviour) -> None:
        """Halt the running leaves of a branch; keep the state of the other nodes."""
        self.suspensions[id(node)] = suspension = Timer(self.execution)
        suspension.restart()
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


def _running(node: Any) -> Iterator[Node]:
    """Yield the running nodes of a branch, the deepest first."""
    for child in node.children:
        if child.status is Status.RUNNING:
            yield from _running(child)
    if node.status is Status.RUNNING:
        yield node
