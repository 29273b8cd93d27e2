"""Events: they pre-empt the mission, and define how it continues."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from collections.abc import Sequence as Items
from dataclasses import dataclass
from math import hypot
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from missions.trees.context import Execution, halt
from missions.trees.node import VALUE_ERRORS, Decorator, InnerNode, Node, run
from stack.types import Expression, Failure, FailureCode

STANDING_PATIENCE = 5.0
"""Seconds after which an event starts although the robot does not stand."""


@dataclass(slots=True)
class Trigger:
    """The trigger of an event: it fires when its condition has become true, for `hold` seconds.

    Attributes:
        again: seconds after which it fires again while the condition stays true; None: never.
        since: started when the condition became true.
        ended: started when the event ended.
        is_true: the condition is true.
        has_fired: it has fired since the condition became true.
        forced: due regardless of the condition, for mission tests.
        problem: why the condition cannot be computed.
    """

    condition: Expression
    hold: Callable[[], float]
    again: Callable[[], float] | None
    since: Timer
    ended: Timer
    is_true: bool = False
    has_fired: bool = False
    forced: bool = False
    problem: str = ""

    def evaluate(self) -> None:
        """Evaluate the condition; it is false if it cannot be computed."""
        try:
            true, self.problem = bool(self.condition()), ""
        except VALUE_ERRORS as error:
            true, self.problem = False, str(error)
        if not true:
            self.reset()
        elif not self.is_true:
            self.is_true = True
            self.since.restart()

    def reset(self) -> None:
        """Forget that the condition was true: it has to become true."""
        self.is_true = self.has_fired = False

    def is_due(self) -> bool:
        """Return whether the event is due."""
        if self.forced or not self.is_true:
            return self.forced
        if not self.has_fired:
            return self.since.is_over(self.hold())
        return self.again is not None and self.ended.is_over(self.again())


class Event(Decorator):
    """One event: a trigger and a node; its outcome is that of the node."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, trigger: Trigger, then: str
    ) -> None:
        super().__init__(name, child, execution)
        self.trigger, self.then = trigger, then

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        return self.outcome_of_child()


class Events(InnerNode, composites.Composite):
    """Evaluates all events on every tick, then ticks the active event or the mission.

    The first event that is due starts when the robot stands. It runs until it ends; only an event
    listed before it pre-empts it. A pre-empted branch keeps its state: its running leaves are
    halted and start again when it is resumed, finished nodes stay finished, timeouts and delays are
    paused. The active branches form a stack with the mission at the bottom. After the end of an
    event the next one that is due starts before the branch below; an event starts once in a tick.
    """

    def __init__(self, events: Items[Event], mission: Behaviour, execution: Execution) -> None:
        super().__init__("events", [*events, mission])
        self.execution, self.events, self.mission = execution, list(events), mission
        self.stack: list[Behaviour] = []
        self.suspensions: dict[int, Timer] = {}
        self.braking = Timer(execution)
        self.started: list[Event] = []
        self.reported: set[str] = set()

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            self.stack = [self.mission]
            self._reset_triggers()
        self.started.clear()
        while True:
            self._start_due_event()
            top: Any = self.stack[-1]
            self.current_child = top
            starts = isinstance(top, Event) and top.status is not Status.RUNNING
            if starts and not self._may_start(top):
                return Status.RUNNING
            status = run(top)
            if status is Status.FAILURE:
                return self._finish(self.execution.propagate_failure(self, top))
            if status is Status.RUNNING:
                return status
            if not isinstance(top, Event):
                return self.skip() if top.skipped else status
            if self._done(top) is Status.FAILURE:
                return self._finish(Status.FAILURE)

    def timers(self) -> Iterable[Timer]:
        triggers = (event.trigger for event in self.events)
        counting = (timer for trigger in triggers for timer in (trigger.since, trigger.ended))
        return (*counting, self.braking, *self.suspensions.values())

    def _start_due_event(self) -> None:
        """Interrupt for the first event that is due, unless it or an earlier event is active."""
        active = [node for node in self.stack if isinstance(node, Event)]
        limit = min((self.events.index(node) for node in active), default=len(self.events))
        due = None
        for number, event in enumerate(self.events):
            event.trigger.evaluate()
            self._report_problem(event)
            if due is None and number < limit and event not in self.started:
                due = event if self._is_due(event) else None
        if due is None:
            return
        due.trigger.forced, due.trigger.has_fired = False, True
        interrupted = self.stack[-1]
        if interrupted.status is Status.RUNNING:
            self._suspend(interrupted)
        halt(due)
        self.stack.append(due)
        self.started.append(due)
        self.braking.restart()
        why = due.trigger.condition.explain()
        self._emit(due, "event", f"{due.name}: {why}; interrupts {interrupted.name}")

    def _is_due(self, event: Event) -> bool:
        try:
            return event.trigger.is_due()
        except VALUE_ERRORS as error:
            event.trigger.problem = str(error)
            self._report_problem(event)
            return False

    def _may_start(self, event: Event) -> bool:
        """Return whether the robot stands; after STANDING_PATIENCE report it and go on."""
        speed = self.execution.robot.base.speed
        if speed.stands:
            self.feedback_message = ""
            return True
        self.feedback_message = f"{event.name} starts when the robot stands"
        if not self.braking.is_over(STANDING_PATIENCE):
            return False
        sentence = (
            f"the robot does not stand after {STANDING_PATIENCE:g} s "
            f"({hypot(speed.linear, speed.lateral):.2f} m/s, {abs(speed.angular):.2f} rad/s)"
        )
        self._emit(event, "event", f"{event.name}: {sentence}; it starts now")
        return True

    def _report_problem(self, event: Event) -> None:
        """Report once that a condition cannot be computed."""
        if event.trigger.problem and event.name not in self.reported:
            self.reported.add(event.name)
            text = f"{event.name}: `when` counts as false: {event.trigger.problem}"
            self._emit(event, "event_not_computed", text)

    def _done(self, event: Event) -> Status:
        """Continue after the success of an event, as its `then` says."""
        event.trigger.ended.restart()
        self._emit(event, "event_done", f"{event.name} is done: {event.then}")
        if event.then == "abort":
            sentence = f"the event {event.name!r} ends the mission"
            return self.execution.fail(self, Failure(FailureCode.CANCELLED, sentence), event.name)
        self.stack.pop()
        if event.then == "restart":
            for node in self.stack:
                halt(node)
            self.stack = [self.mission]
            self._reset_triggers()
        suspension = self.suspensions.pop(id(self.stack[-1]), None)
        if suspension is not None:
            for node in _running(self.stack[-1]):
                node.postpone(suspension.elapsed)
        return Status.SUCCESS

    def _reset_triggers(self) -> None:
        self.suspensions.clear()
        for event in self.events:
            event.trigger.reset()

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
            level="info" if kind == "event_done" else "warning", kind=kind, text=text,
            fields={"node": self.execution.record(event).id, "name": event.name},
        )  # fmt: skip


def _running(node: Any) -> Iterator[Node]:
    """Yield the running nodes of a branch, the deepest first."""
    for child in node.children:
        if child.status is Status.RUNNING:
            yield from _running(child)
    if node.status is Status.RUNNING:
        yield node
