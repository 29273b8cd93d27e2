"""Compiles a checked mission into a tree.

Modifiers become decorators of their node, outermost first:
when > finally > on_failure > while > invert > repeat > recover > retry > timeout > every > node.
Every `use` compiles the used tree again; outputs that are not bound get their own slots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from behaviours.base import RobotBehaviour
from behaviours.timer import Timer
from missions.language.expressions.scope import Symbol
from missions.language.keys import AGAIN, ATTEMPTS, DELAY, HOLD, LIMIT, PERIOD, TIMES
from missions.language.kinds import glyph_of
from missions.language.model import Mission
from missions.language.reading.events import NO_HOLD
from missions.language.step import Event as EventModel
from missions.language.step import Step
from missions.language.values import Constant
from missions.trees import decorators
from missions.trees.attempts import Attempts, Recover, Retry
from missions.trees.context import Execution, HandledFailure, Record
from missions.trees.events import Event, Events, Trigger
from missions.trees.latch import Read
from missions.trees.mission_tree import MissionTree
from missions.trees.node import Node
from missions.trees.slots import Frame, Slot, Write
from stack.documents import Finding, Findings, Mark

StandIn = Callable[[Step], RobotBehaviour | None]
"""Returns the mock of a behaviour or tree in mission tests; None keeps the original."""


def compile_mission(mission: Mission, stand_in: StandIn = lambda step: None) -> MissionTree:
    """Compile a mission into a tree, ready for `setup`.

    Args:
        mission: read and checked; its nodes contain the classes of the behaviours.
        stand_in: called for every behaviour and every used tree.

    Raises:
        InputError: the class of a behaviour cannot be constructed with its ports.
    """
    return _Compiler(mission, stand_in).tree()


class _Compiler:
    """A missions.language.step.TreeBuilder."""

    def __init__(self, mission: Mission, stand_in: StandIn) -> None:
        self.mission, self.execution, self.findings = mission, Execution(), Findings()
        self.trees, self._stand_in = mission.trees, stand_in
        self.execution.place_names = {pose: name for name, pose in mission.places.items()}
        self.slots = {name: Slot(symbol) for name, symbol in mission.blackboard.items()}
        symbols = mission.blackboard
        readers: dict[Symbol, Read] = {
            symbols[name]: slot.read for name, slot in self.slots.items()
        }
        writers: dict[Symbol, Write] = {
            symbols[name]: slot.write for name, slot in self.slots.items()
        }
        self.frame = Frame(self.execution, readers, writers)

    def tree(self) -> MissionTree:
        """Compile the mission; report every behaviour that cannot be built."""
        root = self.step(self.mission.root, self.frame)
        root = self.events(self.mission.events, root, self.frame)
        self.findings.raise_errors()
        return MissionTree(self.mission.name, root, self.execution, self.slots)

    def stand_in(self, step: Step) -> RobotBehaviour | None:
        """Return the mock of a node in mission tests; None keeps the node."""
        return self._stand_in(step)

    def events(self, events: Sequence[EventModel], root: Node, frame: Frame) -> Node:
        """Return the node of some events above a root; the root without events."""
        if not events:
            return root
        made = []
        for event in events:
            trigger = Trigger(
                event.when.bind(frame), frame.checked(event.hold, HOLD),
                frame.checked(event.again, AGAIN) if event.again else None,
                Timer(self.execution), Timer(self.execution),
            )  # fmt: skip
            node = Event(event.name, self.step(event.step, frame), self.execution, trigger,
                         event.then)  # fmt: skip
            held = f", held for {event.hold.source}" if event.hold != NO_HOLD else ""
            again = f", again after {event.again.source}" if event.again else ""
            detail = f"when {event.when.source}{held}{again}, then {event.then}"
            self.record(node, "event", event.mark, event.name, detail, (event.name,))
            made.append(node)
        return self.record(Events(made, root, self.execution), "events", events[0].mark)

    def step(self, step: Step, frame: Frame) -> Node:
        """Compile a node with its decorators, from the inside out."""
        modifiers = step.modifiers
        outer = inner = frame
        if modifiers.recover:
            attempts = self._attempts(modifiers.recover.attempts, frame)
            outer = inner = replace(frame, attempts=attempts)
        if modifiers.retry:
            inner = replace(outer, attempts=self._attempts(modifiers.retry.attempts, outer))
        node = step.build(self, inner)
        label = node.name if step.own_name else step.name
        self.record(node, step.kind, step.mark, label, step.detail, step.names, step.glyph)
        node = self._periodic(step, node, inner)
        node = self._timed(step, node, outer)
        if modifiers.retry and inner.attempts:
            delay = outer.checked(modifiers.retry.delay, DELAY)
            name = f"retry {modifiers.retry.attempts.source}"
            retry = Retry(name, node, self.execution, inner.attempts, delay)
            node = self.record(retry.taking(inner.attempts.most, delay), "retry", step.mark)
        node = self._recovering(step, node, outer)
        return self._conditional(step, self._repeated(step, node, frame), frame)

    def _attempts(self, value: Any, frame: Frame) -> Attempts:
        return Attempts(frame.checked(value, ATTEMPTS))

    def _periodic(self, step: Step, node: Node, frame: Frame) -> Node:
        period = step.modifiers.every
        if period is None:
            return node
        read = frame.checked(period, PERIOD)
        every = decorators.Every(f"every {period.source}", node, self.execution, read)
        return self.record(every.taking(read), "every", step.mark)

    def _timed(self, step: Step, node: Node, frame: Frame) -> Node:
        limit = step.modifiers.timeout
        if limit is None:
            return node
        read = frame.checked(limit, LIMIT)
        timed = decorators.Timeout(f"timeout {limit.source}", node, self.execution, read)
        return self.record(timed.taking(read), "timeout", step.mark)

    def _recovering(self, step: Step, node: Node, frame: Frame) -> Node:
        recover = step.modifiers.recover
        if recover is None or frame.attempts is None:
            return node
        handled = HandledFailure(frame.handled)
        handling = replace(frame, handled=handled)
        unless = recover.unless.bind(handling) if recover.unless else None
        recoveries = [self.step(recovery, handling) for recovery in recover.recoveries]
        name = f"recover, {recover.attempts.source} attempts"
        wrapped = Recover(
            name, [node, *recoveries], self.execution, frame.attempts, unless, handled
        ).taking(frame.attempts.most)
        detail = f"unless {recover.unless.source}" if recover.unless else ""
        return self.record(wrapped, "recover", step.mark, detail=detail)

    def _repeated(self, step: Step, node: Node, frame: Frame) -> Node:
        modifiers = step.modifiers
        if modifiers.repeat is not None:
            name = f"repeat {modifiers.repeat.source}"
            endless = isinstance(modifiers.repeat, Constant) and modifiers.repeat.value is None
            times = (
                frame.value(modifiers.repeat) if endless else frame.checked(modifiers.repeat, TIMES)
            )
            until = modifiers.until.bind(frame) if modifiers.until else None
            repeated = decorators.Repeat(
                name, node, self.execution, times, until, counts_runs=modifiers.every is None
            )
            node = self.record(repeated.taking(times), "repeat", step.mark)
        if modifiers.invert:
            node = self.record(
                decorators.Invert("invert", node, self.execution), "invert", step.mark
            )
        return node

    def _conditional(self, step: Step, node: Node, frame: Frame) -> Node:
        modifiers = step.modifiers
        if modifiers.while_ is not None:
            held = decorators.While(node, self.execution, modifiers.while_.bind(frame))
            node = self.record(held, "while", step.mark)
        if modifiers.keep_going:
            going = decorators.OnFailure("on_failure: continue", node, self.execution)
            node = self.record(going, "on_failure", step.mark)
        if modifiers.finally_ is not None:
            ended = decorators.Finally(node, self.step(modifiers.finally_, frame), self.execution)
            node = self.record(ended, "finally", step.mark)
        if modifiers.when is not None:
            when = decorators.When(node, self.execution, modifiers.when.bind(frame))
            node = self.record(when, "when", step.mark)
        return node

    def refuse(self, mark: Mark, sentence: str) -> None:
        """Report a node that cannot be built, once for its place in the file."""
        finding = Finding(mark, "E127", sentence)
        if finding not in self.findings.items:
            self.findings.items.append(finding)

    def record(  # noqa: PLR0913 - the fields of a record
        self, node: Node, kind: str, mark: Mark, label: str = "", detail: str = "",
        names: tuple[str, ...] = (), glyph: str = "",
    ) -> Node:  # fmt: skip
        """Record a node for drawings and the event log, and return it."""
        self.execution.records[id(node)] = Record(
            node, kind, label, detail, mark, names=names, glyph=glyph or glyph_of(kind)
        )
        return node
