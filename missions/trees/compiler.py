"""Compiles a checked mission into a tree.

Modifiers become decorators of their node, outermost first:
when > finally > on_failure > while > invert > repeat > recover > retry > timeout > every > node.
Every `use` compiles the used tree again; outputs that are not bound get their own slots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure

from behaviours.base import RobotBehaviour
from behaviours.catalogue import build
from behaviours.timer import Timer
from missions.language.expressions.scope import Symbol
from missions.language.keys import AGAIN, ATTEMPTS, DELAY, HOLD, LIMIT, PERIOD, TIMES
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
    Switch,
    Unset,
    Use,
)
from missions.language.model import Event as EventModel
from missions.language.reading.events import NO_HOLD
from missions.trees import branches, composites, decorators, waypoints
from missions.trees.attempts import Attempts, Recover, Retry
from missions.trees.context import Execution, HandledFailure, Record
from missions.trees.events import Event, Events, Trigger
from missions.trees.labels import detail_of, names_of, value_text
from missions.trees.latch import Read, latches
from missions.trees.leaves import LeafNode, UnsetKeys
from missions.trees.mission_tree import MissionTree
from missions.trees.node import Node
from missions.trees.outputs import Outputs
from missions.trees.slots import Frame, Slot, Write
from stack.documents import Finding, Findings, Mark
from stack.errors import exception_sentence
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
        self.findings = Findings()
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
        """Compile the mission; report every behaviour that cannot be built."""
        frame = Frame(self.execution, self.readers, self.writers)
        root = self.step(self.mission.root, frame)
        root = self._events(self.mission.events, root, frame)
        self.findings.raise_errors()
        return MissionTree(self.mission.name, root, self.execution, self.slots)

    def _events(self, events: tuple[EventModel, ...], root: Node, frame: Frame) -> Node:
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
            held = f", held for {value_text(event.hold)}" if event.hold != NO_HOLD else ""
            again = f", again after {value_text(event.again)}" if event.again else ""
            detail = f"when {event.when.source}{held}{again}, then {event.then}"
            self._record(node, "event", event.mark, label=event.name, detail=detail)
            self.execution.record(node).names = (event.name,)
            made.append(node)
        return self._record(Events(made, root, self.execution), "events", events[0].mark)

    def step(self, step: Step, frame: Frame) -> Node:
        """Compile a node with its decorators, from the inside out."""
        modifiers = step.modifiers
        outer = inner = frame
        if modifiers.recover:
            attempts = self._attempts(modifiers.recover.attempts, frame)
            outer = inner = replace(frame, attempts=attempts)
        if modifiers.retry:
            inner = replace(outer, attempts=self._attempts(modifiers.retry.attempts, outer))
        body = self.body(step, inner)
        self.execution.record(body).names = names_of(step)
        node = self._periodic(step, body, inner)
        node = self._timed(step, node, outer)
        if modifiers.retry and inner.attempts:
            delay = outer.checked(modifiers.retry.delay, DELAY)
            node = Retry(node, self.execution, inner.attempts, delay)
            node.latches = latches(inner.attempts.most, delay)
            node.name = f"retry {value_text(modifiers.retry.attempts)}"
            self._record(node, "retry", step.mark)
        node = self._recovering(step, node, outer)
        return self._conditional(step, self._repeated(step, node, frame), frame)

    def _attempts(self, value: Any, frame: Frame) -> Attempts:
        return Attempts(frame.checked(value, ATTEMPTS))

    def _periodic(self, step: Step, node: Node, frame: Frame) -> Node:
        period = step.modifiers.every
        if period is None:
            return node
        name = f"every {value_text(period)}"
        read = frame.checked(period, PERIOD)
        every = decorators.Every(name, node, self.execution, read)
        every.latches = latches(read)
        return self._record(every, "every", step.mark)

    def _timed(self, step: Step, node: Node, frame: Frame) -> Node:
        limit = step.modifiers.timeout
        if limit is None:
            return node
        name = f"timeout {value_text(limit)}"
        read = frame.checked(limit, LIMIT)
        timed = decorators.Timeout(name, node, self.execution, read)
        timed.latches = latches(read)
        return self._record(timed, "timeout", step.mark)

    def _recovering(self, step: Step, node: Node, frame: Frame) -> Node:
        recover = step.modifiers.recover
        if recover is None or frame.attempts is None:
            return node
        handled = HandledFailure(frame.handled)
        handling = replace(frame, handled=handled)
        unless = recover.unless.bind(handling) if recover.unless else None
        recoveries = [self.step(recovery, handling) for recovery in recover.recoveries]
        wrapped = Recover([node, *recoveries], self.execution, frame.attempts, unless, handled)
        wrapped.latches = latches(frame.attempts.most)
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
            until = modifiers.until.bind(frame) if modifiers.until else None
            repeated = decorators.Repeat(name, node, self.execution, times, until)
            repeated.latches = latches(times)
            node = self._record(repeated, "repeat", step.mark)
        if modifiers.invert:
            node = self._record(
                decorators.Invert("invert", node, self.execution), "invert", step.mark
            )
        return node

    def _conditional(self, step: Step, node: Node, frame: Frame) -> Node:
        modifiers = step.modifiers
        if modifiers.while_ is not None:
            held = decorators.While(node, self.execution, modifiers.while_.bind(frame))
            node = self._record(held, "while", step.mark)
        if modifiers.keep_going:
            going = decorators.OnFailure("on_failure: continue", node, self.execution)
            node = self._record(going, "on_failure", step.mark)
        if modifiers.finally_ is not None:
            ended = branches.Finally(node, self.step(modifiers.finally_, frame), self.execution)
            node = self._record(ended, "finally", step.mark)
        if modifiers.when is not None:
            when = decorators.When(node, self.execution, modifiers.when.bind(frame))
            node = self._record(when, "when", step.mark)
        return node

    # Nodes without their modifiers

    def body(self, step: Step, frame: Frame) -> Node:
        """Compile a node without its decorators."""
        detail = detail_of(step)
        if isinstance(step, Leaf | Use) and (other := self.stand_in(step)) is not None:
            mocked = LeafNode(other, self.execution, _bind_outputs(step, other, frame))
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
        if isinstance(step, Switch):
            chooses = self._switch(step, frame)
            return self._record(chooses, step.kind, step.mark, label=step.name, detail=detail)
        if isinstance(step, Unset):
            name = step.name or step.kind
            leaf = UnsetKeys(name, [frame.writers[symbol] for symbol in step.targets])
            removes = LeafNode(leaf, self.execution)
            return self._record(removes, step.kind, step.mark, label=name, detail=detail)
        assert isinstance(step, Composite)
        made = self._composite(step, frame)
        return self._record(made, step.kind, step.mark, label=step.name, detail=detail)

    def _switch(self, step: Switch, frame: Frame) -> Node:
        cases = {}
        for text, child in step.cases.items():
            cases[text] = self._case(f"case {text}", child, frame)
        default = self._case("default", step.default, frame) if step.default else None
        name, value = step.name or step.kind, step.value.bind(frame)
        return branches.Switch(name, self.execution, value, cases, default)

    def _case(self, name: str, step: Step, frame: Frame) -> Node:
        case = branches.Case(name, self.step(step, frame), self.execution)
        return self._record(case, "case", step.mark)

    def _composite(self, step: Composite, frame: Frame) -> Node:
        name, kind = step.name or step.kind, NODES[step.kind]
        if kind.handles_failure:
            handled = HandledFailure(frame.handled)
            later = replace(frame, handled=handled)
            first, rest = step.children[0], step.children[1:]
            children = [self.step(first, frame), *(self.step(child, later) for child in rest)]
            node: Node = _FACTORIES[kind.factory](name, children, self.execution, handled)
            return node
        children = [self.step(child, frame) for child in step.children]
        if step.kind == "parallel":
            return composites.Parallel(name, children, self.execution, step.needed)
        node = _FACTORIES[kind.factory](name, children, self.execution)
        return node

    def _for_each(self, step: ForEach, frame: Frame) -> Node:
        inside, slot = frame.with_slot(step.variable)
        items = frame.value(step.items)
        loop = decorators.Loop(step.variable.name, items, slot.write, step.skip_failures)
        name = step.name or step.kind
        if not isinstance(step, FollowWaypoints):
            return decorators.ForEach(name, self.step(step.child, inside), self.execution, loop)
        inside, number = inside.with_slot(step.number)
        driven = waypoints.Driven()
        inside = replace(inside, writers={**inside.writers, step.driven: driven.add})
        outputs = {name: frame.writers[symbol] for name, symbol in step.outputs.items()}
        counters = waypoints.WaypointSlots(number, driven, outputs)
        child = self.step(step.child, inside)
        return waypoints.FollowWaypoints(name, child, self.execution, loop, counters)

    def _use(self, step: Use, frame: Frame) -> Node:
        tree = self.mission.trees[step.tree]
        assert tree.root is not None
        readers, writers = dict(self.readers), dict(self.writers)
        unbound: list[Write] = []
        optional: list[Write] = []
        inputs: list[Read] = []
        for name, symbol in tree.inputs.items():
            readers[symbol] = frame.value(step.inputs[name])
            inputs.append(readers[symbol])
        for name, symbol in tree.outputs.items():
            target = step.outputs.get(name)
            own = Slot(symbol)
            readers[symbol] = frame.readers[target] if target else own.read
            writers[symbol] = frame.writers[target] if target else own.write
            if target is None:
                unbound.append(own.write)
            elif frame.can_be_unset(target):
                optional.append(frame.writers[target])
        always_set = frozenset(
            tree.outputs[name]
            for name, target in step.outputs.items()
            if not frame.can_be_unset(target)
        )
        inside = Frame(self.execution, readers, writers, frame.attempts, frame.handled, always_set)
        root = self._events(tree.events, self.step(tree.root, inside), inside)
        name = step.name or step.tree
        used = decorators.Subtree(name, root, self.execution, unbound, optional)
        used.latches = latches(*inputs)
        return used

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
        reads: list[Read] = []
        outputs: Outputs | None = None
        if isinstance(node, RobotBehaviour):
            for name, value in step.ports.items():
                if not isinstance(value, Constant | ExpressionValue | AssignmentList):
                    declared = step.behaviour.ports[name]
                    reads.append(frame.checked(value, declared))
                    node.bind_input(name, reads[-1])
            outputs = _bind_outputs(step, node, frame)
        leaf = LeafNode(node, self.execution, outputs)
        leaf.latches = latches(*reads)
        return leaf

    def _built(self, step: Leaf, arguments: dict[str, Any]) -> Behaviour:
        label = step.name or step.kind.rpartition(".")[2]
        try:
            node = build(step.behaviour, label, arguments)
        except Exception as error:
            return self._unbuilt(step, f"cannot be built: {exception_sentence(error)}")
        if node.children:
            return self._unbuilt(step, "has children; a mission can only use leaves")
        return node

    def _unbuilt(self, step: Leaf, reason: str) -> Behaviour:
        """Report a leaf that cannot be built, once for its place in the file; stand in for it."""
        finding = Finding(step.mark, "E127", f"{step.kind} {reason}")
        if finding not in self.findings.items:
            self.findings.items.append(finding)
        return Failure(step.kind)

    def _record(self, node: Node, kind: str, mark: Mark, label: str = "", detail: str = "") -> Node:
        self.execution.records[id(node)] = Record(node, kind, label, detail, mark)
        return node


def _bind_outputs(step: Leaf | Use, node: RobotBehaviour, frame: Frame) -> Outputs | None:
    """Bind the outputs of a leaf; an internal variable is written at once, also by a failure."""
    outputs = Outputs()
    for name, symbol in step.outputs.items():
        write = frame.writers[symbol]
        if symbol.is_writable:
            write = outputs.target(write, optional=frame.can_be_unset(symbol))
        node.bind_output(name, write)
    return outputs if any(symbol.is_writable for symbol in step.outputs.values()) else None


def _assignments(value: AssignmentList, frame: Frame) -> Assignments:
    return Assignments(
        tuple(
            (symbol.name, expression.bind(frame), frame.writers[symbol])
            for symbol, expression in value.assignments
        )
    )
