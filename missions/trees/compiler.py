"""Compiles a checked mission into a tree.

Modifiers become decorators of their node, outermost first:
when > while > on_failure > repeat > recover > retry > timeout > every > node. Every `use` compiles
the used tree again; outputs that are not bound get their own slots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour
from behaviours.catalogue import build
from behaviours.timer import Timer
from missions.language.expressions.scope import Symbol
from missions.language.keys import ATTEMPTS, DELAY, HOLD, LIMIT, PERIOD, TIMES
from missions.language.kinds import NODES
from missions.language.model import (
    AssignmentList,
    Composite,
    Constant,
    ExpressionValue,
    FollowWaypoints,
    ForEach,
    Leaf,
    Mission,
    Step,
    Use,
)
from missions.language.reading.events import NO_HOLD
from missions.trees import composites, decorators, waypoints
from missions.trees.attempts import Attempts, Recover, Retry
from missions.trees.context import Execution, Record
from missions.trees.events import Event, Events, Trigger
from missions.trees.labels import detail_of, names_of, value_text
from missions.trees.leaves import LeafNode
from missions.trees.mission_tree import MissionTree
from missions.trees.node import Node
from missions.trees.slots import Frame, Read, Slot, Write
from stack.documents import Finding, Mark
from stack.errors import InputError, exception_sentence
from stack.types import Assignments

_FACTORIES: dict[str, Any] = {
    cls.__name__: cls
    for cls in (
        composites.Sequence, composites.ReactiveSequence, composites.Fallback,
        composites.ReactiveFallback, composites.RoundRobin,
    )
}  # fmt: skip
"""Composites that are built from their name, their children and the execution."""

StandIn = Callable[[Leaf | Use], RobotBehaviour | None]
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
    def __init__(self, mission: Mission, stand_in: StandIn) -> None:
        self.mission, self.execution, self.stand_in = mission, Execution(), stand_in
        self.execution.place_names = {pose: name for name, pose in mission.places.items()}
        self.slots = {name: Slot(symbol) for name, symbol in mission.blackboard.items()}
        symbols = mission.blackboard
        self.readers: dict[Symbol, Read] = {
            symbols[name]: slot.read for name, slot in self.slots.items()
        }
        self.writers: dict[Symbol, Write] = {
            symbols[name]: slot.write for name, slot in self.slots.items()
        }

    def tree(self) -> MissionTree:
        frame = Frame(self.execution, self.readers, self.writers)
        root = self.step(self.mission.root, frame)
        if self.mission.events:
            root = self._events(root, frame)
        return MissionTree(self.mission.name, root, self.execution, self.slots)

    def _events(self, root: Node, frame: Frame) -> Node:
        made = []
        for event in self.mission.events:
            trigger = Trigger(
                event.when.bind(frame), frame.checked(event.hold, HOLD), Timer(self.execution)
            )
            node = Event(event.name, self.step(event.step, frame), self.execution, trigger,
                         event.then)  # fmt: skip
            held = f", held for {value_text(event.hold)}" if event.hold != NO_HOLD else ""
            detail = f"when {event.when.source}{held}, then {event.then}"
            self._record(node, "event", event.mark, label=event.name, detail=detail)
            self.execution.record(node).names = (event.name,)
            made.append(node)
        return self._record(
            Events(made, root, self.execution), "events", self.mission.events[0].mark
        )

    def step(self, step: Step, frame: Frame) -> Node:
        """Compile a node with its decorators, from the inside out."""
        modifiers = step.modifiers
        base = replace(frame, skipped_fails=False)
        outer = inner = base
        if modifiers.recover:
            outer = inner = replace(base, attempts=self._attempts(modifiers.recover.attempts, base))
        if modifiers.retry:
            inner = replace(outer, attempts=self._attempts(modifiers.retry.attempts, outer))
        body = self.body(step, inner)
        self.execution.record(body).names = names_of(step)
        node = self._periodic(step, body, inner)
        node = self._timed(step, node, outer)
        if modifiers.retry and inner.attempts:
            delay = outer.checked(modifiers.retry.delay, DELAY)
            node = Retry(node, self.execution, inner.attempts, delay)
            node.name = f"retry {value_text(modifiers.retry.attempts)}"
            self._record(node, "retry", step.mark)
        node = self._recovering(step, node, outer)
        return self._conditional(step, self._repeated(step, node, base), frame)

    def _attempts(self, value: Any, frame: Frame) -> Attempts:
        return Attempts(frame.checked(value, ATTEMPTS))

    def _periodic(self, step: Step, node: Node, frame: Frame) -> Node:
        period = step.modifiers.every
        if period is None:
            return node
        name = f"every {value_text(period)}"
        every = decorators.Every(name, node, self.execution, frame.checked(period, PERIOD))
        return self._record(every, "every", step.mark)

    def _timed(self, step: Step, node: Node, frame: Frame) -> Node:
        limit = step.modifiers.timeout
        if limit is None:
            return node
        name = f"timeout {value_text(limit)}"
        timed = decorators.Timeout(name, node, self.execution, frame.checked(limit, LIMIT))
        return self._record(timed, "timeout", step.mark)

    def _recovering(self, step: Step, node: Node, frame: Frame) -> Node:
        recover = step.modifiers.recover
        if recover is None or frame.attempts is None:
            return node
        unless = recover.unless.bind(frame) if recover.unless else None
        recoveries = [self.step(recovery, frame) for recovery in recover.recoveries]
        wrapped = Recover([node, *recoveries], self.execution, frame.attempts, unless)
        detail = f"unless {recover.unless.source}" if recover.unless else ""
        wrapped.name = f"recover, {value_text(recover.attempts)} attempts"
        return self._record(wrapped, "recover", step.mark, detail=detail)

    def _repeated(self, step: Step, node: Node, frame: Frame) -> Node:
        modifiers = step.modifiers
        if modifiers.repeat is not None:
            name = f"repeat {value_text(modifiers.repeat)}"
            endless = isinstance(modifiers.repeat, Constant) and modifiers.repeat.value is None
            times = (
                frame.value(modifiers.repeat) if endless else frame.checked(modifiers.repeat, TIMES)
            )
            repeated = decorators.Repeat(name, node, self.execution, times)
            node = self._record(repeated, "repeat", step.mark)
        if modifiers.keep_going:
            going = decorators.OnFailure("on_failure: continue", node, self.execution)
            node = self._record(going, "on_failure", step.mark)
        return node

    def _conditional(self, step: Step, node: Node, frame: Frame) -> Node:
        modifiers = step.modifiers
        if modifiers.while_ is not None:
            held = decorators.While(node, self.execution, modifiers.while_.bind(frame))
            node = self._record(held, "while", step.mark)
        if modifiers.when is not None:
            skipped = Status.FAILURE if frame.skipped_fails else Status.SUCCESS
            when = decorators.When(node, self.execution, modifiers.when.bind(frame), skipped)
            node = self._record(when, "when", step.mark)
        return node

    # Nodes without their modifiers

    def body(self, step: Step, frame: Frame) -> Node:
        """Compile a node without its decorators."""
        detail = detail_of(step)
        if isinstance(step, Leaf | Use) and (other := self.stand_in(step)) is not None:
            for name, symbol in step.outputs.items():
                other.bind_output(name, frame.writers[symbol])
            mocked = LeafNode(other, self.execution)
            return self._record(mocked, step.kind, step.mark, label=other.name, detail=detail)
        if isinstance(step, Leaf):
            node = self._leaf(step, frame)
            return self._record(node, step.kind, step.mark, label=node.name, detail=detail)
        if isinstance(step, Use):
            used = self._use(step, frame)
            return self._record(used, "use", step.mark, label=used.name, detail=detail)
        if isinstance(step, ForEach):
            loop = self._for_each(step, frame)
            return self._record(loop, step.kind, step.mark, label=step.name, detail=detail)
        assert isinstance(step, Composite)
        inside = replace(frame, skipped_fails=NODES[step.kind].handles_failure)
        children = [self.step(child, inside) for child in step.children]
        name = step.name or step.kind
        if step.kind == "parallel":
            made: Node = composites.Parallel(name, children, self.execution, step.needed)
        else:
            made = _FACTORIES[NODES[step.kind].factory](name, children, self.execution)
        return self._record(made, step.kind, step.mark, label=step.name, detail=detail)

    def _for_each(self, step: ForEach, frame: Frame) -> Node:
        inside, slot = frame.with_slot(step.variable)
        loop = decorators.Loop(
            step.variable.name, frame.value(step.items), slot.write, step.skip_failures
        )
        name = step.name or step.kind
        if not isinstance(step, FollowWaypoints):
            return decorators.ForEach(name, self.step(step.child, inside), self.execution, loop)
        inside, number = inside.with_slot(step.number)
        inside, driven = inside.with_slot(step.driven)
        outputs = {name: frame.writers[symbol] for name, symbol in step.outputs.items()}
        counters = waypoints.WaypointSlots(number, driven, outputs)
        child = self.step(step.child, inside)
        return waypoints.FollowWaypoints(name, child, self.execution, loop, counters)

    def _use(self, step: Use, frame: Frame) -> Node:
        tree = self.mission.trees[step.tree]
        assert tree.root is not None
        readers, writers = dict(self.readers), dict(self.writers)
        for name, symbol in tree.inputs.items():
            readers[symbol] = frame.value(step.inputs[name])
        for name, symbol in tree.outputs.items():
            target = step.outputs.get(name)
            own = Slot(symbol)
            readers[symbol] = frame.readers[target] if target else own.read
            writers[symbol] = frame.writers[target] if target else own.write
        inside = Frame(self.execution, readers, writers, frame.attempts)
        return decorators.Subtree(
            step.name or step.tree, self.step(tree.root, inside), self.execution
        )

    def _leaf(self, step: Leaf, frame: Frame) -> Node:
        arguments: dict[str, Any] = {}
        for name, value in step.ports.items():
            if isinstance(value, ExpressionValue):
                arguments[name] = value.expression.bind(frame)
            elif isinstance(value, AssignmentList):
                arguments[name] = _assignments(value, frame)
            else:
                arguments[name] = value.value if isinstance(value, Constant) else None
        node = self._built(step, arguments)
        if isinstance(node, RobotBehaviour):
            for name, value in step.ports.items():
                if not isinstance(value, Constant | ExpressionValue | AssignmentList):
                    declared = step.behaviour.ports[name]
                    node.bind_input(name, frame.checked(value, declared))
            for name, symbol in step.outputs.items():
                node.bind_output(name, frame.writers[symbol])
        return LeafNode(node, self.execution)

    def _built(self, step: Leaf, arguments: dict[str, Any]) -> Behaviour:
        label = step.name or step.kind.rpartition(".")[2]
        try:
            node = build(step.behaviour, label, arguments)
        except Exception as error:
            sentence = f"{step.kind} cannot be built: {exception_sentence(error)}"
            raise InputError([Finding(step.mark, "E127", sentence)]) from error
        if node.children:
            sentence = f"{step.kind} has children; a mission can only use leaves"
            raise InputError([Finding(step.mark, "E127", sentence)])
        return node

    def _record(self, node: Node, kind: str, mark: Mark, label: str = "", detail: str = "") -> Node:
        self.execution.records[id(node)] = Record(node, kind, label, detail, mark)
        return node


def _assignments(value: AssignmentList, frame: Frame) -> Assignments:
    return Assignments(
        tuple(
            (symbol.name, expression.bind(frame), frame.writers[symbol])
            for symbol, expression in value.assignments
        )
    )
