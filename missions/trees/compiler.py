"""From a checked mission to a running tree.

Modifiers become decorators around their node, outermost first:
when > while > on_failure > repeat > recover > retry > timeout > every > node. A used tree is put
in where it is used, with slots of its own for its `out` where they are not bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour
from behaviours.catalogue import build
from missions.language.expressions.scope import Symbol
from missions.language.model import (
    AssignmentList,
    Catalogue,
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
from missions.language.reading.events import HOLD, NO_HOLD
from missions.language.reading.modifiers import ATTEMPTS, DELAY, LIMIT, PERIOD, TIMES
from missions.trees import composites, decorators, waypoints
from missions.trees.attempts import Attempts, Recover, Retry
from missions.trees.context import Execution, Record
from missions.trees.events import Event, Events, Trigger
from missions.trees.labels import detail_of, names_of, value_text
from missions.trees.leaves import LeafNode
from missions.trees.mission_tree import MissionTree
from missions.trees.slots import Frame, Read, Slot, Write
from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.types import Assignments

_COMPOSITES: dict[str, Any] = {
    "sequence": composites.Sequence,
    "reactive": composites.ReactiveSequence,
    "fallback": composites.Fallback,
    "reactive_fallback": composites.ReactiveFallback,
    "round_robin": composites.RoundRobin,
}
_TRIES_OTHERS = ("fallback", "reactive_fallback", "round_robin")


StandIn = Callable[[Leaf | Use], RobotBehaviour | None]
"""What to put in the place of a behaviour or tree, for tests of missions; None leaves it."""


def compile_mission(
    mission: Mission, catalogue: Catalogue | None = None, stand_in: StandIn = lambda step: None
) -> MissionTree:
    """The tree of a mission, ready for `setup`.

    Args:
        mission: read and checked; its nodes already carry the behaviours' classes.
        catalogue: not needed; taken so that reading and compiling are called alike.
        stand_in: asked for every behaviour and used tree.

    Raises:
        InputError: a behaviour's class refuses to be built with the ports it declares.
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

    def _events(self, root: Behaviour, frame: Frame) -> Behaviour:
        made = []
        for event in self.mission.events:
            trigger = Trigger(event.when.bind(frame), frame.checked(event.hold, HOLD))
            node = Event(event.name, self.step(event.step, frame), self.execution, trigger,
                         event.then)  # fmt: skip
            held = f", held for {value_text(event.hold)}" if event.hold != NO_HOLD else ""
            detail = f"when {event.when.source}{held}, then {event.then}"
            self._note(node, "event", event.mark, label=event.name, detail=detail)
            self.execution.record(node).names = (event.name,)
            made.append(node)
        return self._note(Events(made, root, self.execution), "events", self.mission.events[0].mark)

    def step(self, step: Step, frame: Frame) -> Behaviour:
        """A node with its decorators, inside out."""
        given = step.modifiers
        again = replace(frame, skipped_fails=False)
        around = within = again
        if given.recover:
            around = within = replace(again, attempts=self._attempts(given.recover.attempts, again))
        if given.retry:
            within = replace(around, attempts=self._attempts(given.retry.attempts, around))
        body = self.body(step, within)
        self.execution.record(body).names = names_of(step)
        node = self._periodic(step, body, within)
        node = self._timed(step, node, around)
        if given.retry and within.attempts:
            delay = around.checked(given.retry.delay, DELAY)
            node = Retry(node, self.execution, within.attempts, delay)
            node.name = f"retry {value_text(given.retry.attempts)}"
            self._note(node, "retry", step.mark)
        node = self._recovering(step, node, around)
        return self._conditional(step, self._repeated(step, node, again), frame)

    def _attempts(self, value: Any, frame: Frame) -> Attempts:
        return Attempts(frame.checked(value, ATTEMPTS))

    def _periodic(self, step: Step, node: Behaviour, frame: Frame) -> Behaviour:
        period = step.modifiers.every
        if period is None:
            return node
        name = f"every {value_text(period)}"
        every = decorators.Every(name, node, self.execution, frame.checked(period, PERIOD))
        return self._note(every, "every", step.mark)

    def _timed(self, step: Step, node: Behaviour, frame: Frame) -> Behaviour:
        limit = step.modifiers.timeout
        if limit is None:
            return node
        name = f"timeout {value_text(limit)}"
        timed = decorators.Timeout(name, node, self.execution, frame.checked(limit, LIMIT))
        return self._note(timed, "timeout", step.mark)

    def _recovering(self, step: Step, node: Behaviour, frame: Frame) -> Behaviour:
        recover = step.modifiers.recover
        if recover is None or frame.attempts is None:
            return node
        unless = recover.unless.bind(frame) if recover.unless else None
        recoveries = [self.step(recovery, frame) for recovery in recover.recoveries]
        wrapped = Recover([node, *recoveries], self.execution, frame.attempts, unless)
        detail = f"unless {recover.unless.source}" if recover.unless else ""
        wrapped.name = f"recover, {value_text(recover.attempts)} attempts"
        return self._note(wrapped, "recover", step.mark, detail=detail)

    def _repeated(self, step: Step, node: Behaviour, frame: Frame) -> Behaviour:
        given = step.modifiers
        if given.repeat is not None:
            name = f"repeat {value_text(given.repeat)}"
            endless = isinstance(given.repeat, Constant) and given.repeat.value is None
            times = frame.value(given.repeat) if endless else frame.checked(given.repeat, TIMES)
            repeated = decorators.Repeat(name, node, self.execution, times)
            node = self._note(repeated, "repeat", step.mark)
        if given.keep_going:
            going = decorators.OnFailure("on_failure: continue", node, self.execution)
            node = self._note(going, "on_failure", step.mark)
        return node

    def _conditional(self, step: Step, node: Behaviour, frame: Frame) -> Behaviour:
        given = step.modifiers
        if given.while_ is not None:
            held = decorators.While(node, self.execution, given.while_.bind(frame))
            node = self._note(held, "while", step.mark)
        if given.when is not None:
            skipped = Status.FAILURE if frame.skipped_fails else Status.SUCCESS
            when = decorators.When(node, self.execution, given.when.bind(frame), skipped)
            node = self._note(when, "when", step.mark)
        return node

    # Nodes without their modifiers

    def body(self, step: Step, frame: Frame) -> Behaviour:
        """A node without its decorators."""
        detail = detail_of(step)
        if isinstance(step, Leaf | Use) and (other := self.stand_in(step)) is not None:
            for name, symbol in step.outputs.items():
                other.bind_output(name, frame.writers[symbol])
            LeafNode(other, self.execution)
            return self._note(other, step.kind, step.mark, label=other.name, detail=detail)
        if isinstance(step, Leaf):
            node = self._leaf(step, frame)
            return self._note(node, step.kind, step.mark, label=node.name, detail=detail)
        if isinstance(step, Use):
            used = self._use(step, frame)
            return self._note(used, "use", step.mark, label=used.name, detail=detail)
        if isinstance(step, ForEach):
            loop = self._for_each(step, frame)
            return self._note(loop, step.kind, step.mark, label=step.name, detail=detail)
        assert isinstance(step, Composite)
        inside = replace(frame, skipped_fails=step.kind in _TRIES_OTHERS)
        children = [self.step(child, inside) for child in step.children]
        name = step.name or step.kind
        if step.kind == "parallel":
            made: Behaviour = composites.Parallel(name, children, self.execution, step.needed)
        else:
            made = _COMPOSITES[step.kind](name, children, self.execution)
        return self._note(made, step.kind, step.mark, label=step.name, detail=detail)

    def _for_each(self, step: ForEach, frame: Frame) -> Behaviour:
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
        account = waypoints.Account(number, driven, outputs)
        child = self.step(step.child, inside)
        return waypoints.FollowWaypoints(name, child, self.execution, loop, account)

    def _use(self, step: Use, frame: Frame) -> Behaviour:
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

    def _leaf(self, step: Leaf, frame: Frame) -> Behaviour:
        given: dict[str, Any] = {}
        for name, value in step.ports.items():
            if isinstance(value, ExpressionValue):
                given[name] = value.expression.bind(frame)
            elif isinstance(value, AssignmentList):
                given[name] = _assignments(value, frame)
            else:
                given[name] = value.value if isinstance(value, Constant) else None
        node = self._built(step, given)
        if isinstance(node, RobotBehaviour):
            for name, value in step.ports.items():
                if not isinstance(value, Constant | ExpressionValue | AssignmentList):
                    declared = step.behaviour.ports[name]
                    node.bind_input(name, frame.checked(value, declared))
            for name, symbol in step.outputs.items():
                node.bind_output(name, frame.writers[symbol])
        LeafNode(node, self.execution)
        return node

    def _built(self, step: Leaf, given: dict[str, Any]) -> Behaviour:
        label = step.name or step.kind.rpartition(".")[2]
        try:
            node = build(step.behaviour, label, given)
        except Exception as error:
            sentence = f"{step.kind} cannot be built: {type(error).__name__}: {error}"
            raise InputError([Finding(step.mark, "E127", sentence)]) from error
        if node.children:
            sentence = f"{step.kind} has children of its own; only leaves can stand in a mission"
            raise InputError([Finding(step.mark, "E127", sentence)])
        return node

    def _note(
        self, node: Behaviour, kind: str, mark: Mark, label: str = "", detail: str = ""
    ) -> Behaviour:
        self.execution.records[id(node)] = Record(node, kind, label, detail, mark)
        return node


def _assignments(value: AssignmentList, frame: Frame) -> Assignments:
    return Assignments(
        tuple(
            (symbol.name, expression.bind(frame), frame.writers[symbol])
            for symbol, expression in value.assignments
        )
    )
