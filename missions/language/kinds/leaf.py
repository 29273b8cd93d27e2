"""A behaviour with its ports: every node that is no kind of the language."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure

from behaviours.base import RobotBehaviour
from behaviours.kind import BehaviourKind, build
from missions.language.analysis.intervals import truth_values
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Symbol
from missions.language.expressions.terms import Reference as Named
from missions.language.expressions.value_types import type_of
from missions.language.kinds.kind import NodeReading, Written
from missions.language.reading.modifiers import value_in
from missions.language.reading.ports import Owner
from missions.language.step import Claims, Codes, Outcomes, Step, TreeBuilder
from missions.language.values import (
    AssignmentList,
    Constant,
    ExpressionValue,
    Value,
)
from missions.trees.latch import Read
from missions.trees.leaves import LeafNode
from missions.trees.node import Node
from missions.trees.outputs import Outputs
from missions.trees.slots import Frame
from stack.documents import Finding, Findings, Mark
from stack.errors import exception_sentence
from stack.parameters import Declaration, did_you_mean, nearest
from stack.types import Assignments, FailureCode

CONDITION_GLYPH, LEAF_GLYPH = "◇", "⚙"
_ALWAYS = frozenset((FailureCode.EXCEPTION, FailureCode.FAILED, FailureCode.CANCELLED))
"""Codes that any behaviour can fail with."""
TYPING_SLIP = 0.9
"""Similarity from which a code counts as a misspelt one; that of DOOR_LOCKED is 0.82."""
_CODE = re.compile(r"[A-Z][A-Z0-9_]*")


@dataclass(frozen=True, slots=True)
class LeafStep(Step):
    """A behaviour with its ports and the targets of its outputs."""

    behaviour: BehaviourKind
    ports: Mapping[str, Value]
    outputs: Mapping[str, Symbol]

    def children(self) -> tuple[Step, ...]:
        return ()

    def reads(self) -> Iterator[Value]:
        return iter(self.ports.values())

    def writes(self) -> tuple[Symbol, ...]:
        written = (symbol for value in self.ports.values() for symbol in value.writes())
        return (*self.outputs.values(), *written)

    def results(self) -> Mapping[str, Symbol]:
        return self.outputs

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        truths = [truth_values(condition.term) for condition in self.conditions()]
        behaviour = self.behaviour
        can_fail = behaviour.can_fail or any(value.may_fail() for value in self.ports.values())
        can_succeed = behaviour.can_succeed and not self.missing_ends()
        if behaviour.is_condition:
            can_succeed = can_succeed and {False} not in truths
            can_fail = can_fail and not (behaviour.is_instant and {True} in truths)
        return Outcomes(can_succeed, can_fail)

    def least_time(self, children: Sequence[float]) -> float:
        value = self.ports.get(self.behaviour.duration_port)
        known = isinstance(value, Constant) and isinstance(value.value, int | float)
        return float(value.value) if known and isinstance(value, Constant) else 0.0

    def takes_time(self, children: Sequence[bool]) -> bool:
        return self.behaviour.takes_time

    def begins(self, children: Sequence[Claims]) -> Claims:
        return self.claims

    @property
    def ends_at_once(self) -> bool:
        return self.behaviour.is_instant

    @property
    def waits(self) -> bool:
        return self.behaviour.is_condition and not self.behaviour.is_instant

    @property
    def claims(self) -> Claims:
        return frozenset(self.behaviour.claims)

    @property
    def goal(self) -> object:
        value = self.ports.get(self.behaviour.arrival_port)
        is_known = isinstance(value, Constant) and self.modifiers.when is None
        return value.value if is_known and isinstance(value, Constant) else None

    def fails_with(self) -> Codes:
        known = self.behaviour.fails_with
        return _ALWAYS | frozenset(known) if known is not None else None

    def limits(self) -> Mapping[str, Value]:
        declared = self.behaviour.ports
        return {
            name: value for name, value in self.ports.items()
            if declared[name].unit == "s" and name != self.behaviour.duration_port
        }  # fmt: skip

    def missing_ends(self) -> tuple[str, ...]:
        ends = self.behaviour.ends_by
        return () if any(_is_given(self.ports.get(name)) for name in ends) else ends

    @property
    def own_name(self) -> str:
        return self.kind

    @property
    def glyph(self) -> str:
        return CONDITION_GLYPH if self.behaviour.is_condition else LEAF_GLYPH

    @property
    def detail(self) -> str:
        return ports_text(self.ports, self.outputs)

    def mock_outputs(self, outputs: Mapping[str, Symbol]) -> Mapping[str, Declaration]:
        return self.behaviour.outputs

    @property
    def runs_in_tests(self) -> bool:
        return self.behaviour.runs_in_tests or not self.behaviour.bindable

    def problems(self) -> Iterator[Finding]:
        time = self.ports.get(self.behaviour.duration_port)
        if isinstance(time, Constant) and time.value == 0.0 and time.is_written:
            sentence = f"a {self.kind} of 0 s has no effect"
            yield Finding(time.mark or self.mark, "W133", sentence, "remove it")
        for value in self.ports.values():
            if isinstance(value, AssignmentList):
                yield from _to_itself(value, self.mark)

    # The node of the tree

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        other = builder.stand_in(self)
        if other is not None:
            return mocked(self, other, builder, frame)
        leaf = self._leaf(builder, frame)
        reads: list[Read] = []
        outputs: Outputs | None = None
        if isinstance(leaf, RobotBehaviour):
            for name, value in self.ports.items():
                if not isinstance(value, Constant | ExpressionValue | AssignmentList):
                    reads.append(frame.checked(value, self.behaviour.ports[name]))
                    leaf.bind_input(name, reads[-1])
            outputs = _bind_outputs(self, leaf, frame)
        return LeafNode(leaf, builder.execution, outputs).taking(*reads)

    def _leaf(self, builder: TreeBuilder, frame: Frame) -> Behaviour:
        label = self.name or self.kind.rpartition(".")[2]
        arguments = {name: _argument(value, frame) for name, value in self.ports.items()}
        reason = "has children; a mission can only use leaves"
        try:
            found = build(self.behaviour, label, arguments)
            if not found.children:
                return found
        except Exception as error:
            reason = f"cannot be built: {exception_sentence(error)}"
        builder.refuse(self.mark, f"{self.kind} {reason}")
        return Failure(self.kind)


def _argument(value: Value, frame: Frame) -> Any:
    if isinstance(value, ExpressionValue):
        return value.expression.bind(frame)
    if isinstance(value, AssignmentList):
        return Assignments(tuple(
            (symbol.name, expression.bind(frame), frame.writers[symbol])
            for symbol, expression in value.assignments
        ))  # fmt: skip
    return value.value if isinstance(value, Constant) else None


def mocked(step: Step, other: RobotBehaviour, builder: TreeBuilder, frame: Frame) -> Node:
    """Return the node of a mock, with the outputs of the step."""
    return LeafNode(other, builder.execution, _bind_outputs(step, other, frame))


def _bind_outputs(step: Step, leaf: RobotBehaviour, frame: Frame) -> Outputs | None:
    """Bind the outputs of a leaf; an internal variable is written at once, also by a failure."""
    outputs, targets = Outputs(), step.results()
    for name, symbol in targets.items():
        write = frame.writers[symbol]
        if symbol.is_writable:
            write = outputs.target(write, optional=frame.can_be_unset(symbol))
        leaf.bind_output(name, write)
    return outputs if any(symbol.is_writable for symbol in targets.values()) else None


def ports_text(ports: Mapping[str, Value], outputs: Mapping[str, Symbol]) -> str:
    """Return ports or inputs, and the targets of outputs, as text in one line."""
    parts = [
        value.source if value.names_itself else f"{name} {value.source}"
        for name, value in ports.items()
    ]
    return ", ".join([*parts, *targets_text(outputs)])


def targets_text(outputs: Mapping[str, Symbol]) -> list[str]:
    """Return the targets of outputs as texts; internal variables are omitted."""
    return [f"{name} -> ${symbol.name}" for name, symbol in outputs.items() if symbol.is_writable]


def _to_itself(value: AssignmentList, mark: Mark) -> Iterator[Finding]:
    for symbol, expression in value.assignments:
        term = expression.term
        if isinstance(term, Named) and expression.read.get(term.name) is symbol:
            sentence = f"${symbol.name} is set to itself"
            yield Finding(expression.mark or mark, "W130", sentence, "write the new value")


def _is_given(value: Value | None) -> bool:
    if isinstance(value, Constant):
        return value.value is not None and value.value is not False
    return value is not None


def read_leaf(
    reader: NodeReading, kind: BehaviourKind, written: Written, context: NameContext
) -> Step:
    """Read a node whose type is a behaviour."""
    head = written.head
    owner = Owner(head.kind, head.mark, misplaced=written.raw)
    ports = reader.ports.of_behaviour(kind.ports, written.body, owner, context)
    if not kind.bindable:
        for name, value in ports.items():
            if not isinstance(value, Constant):
                sentence = f"{name}: a port of a plain py_trees class must be a literal"
                reader.findings.add("E132", head.mark, sentence)
    if kind.failure_ports:
        code, reason = (ports.get(name) for name in kind.failure_ports)
        _check_failure_code(code, reason, head.mark, reader.findings)
    results = {name: type_of(declared) for name, declared in kind.outputs.items()}
    outputs = reader.ports.outputs(results, value_in(written.raw, "out"), owner, context)
    return LeafStep(*head, kind, ports, outputs)


def _check_failure_code(
    code: Value | None, reason: Value | None, mark: Mark, findings: Findings
) -> None:
    """Report a code of `fail` that is misspelt, or that stands where the reason stands."""
    if isinstance(reason, Constant) and "_" in str(reason.value):
        text = str(reason.value)
        if code is None and _CODE.fullmatch(text):
            text = nearest(text, list(FailureCode.__members__)) or text
            sentence = f"{str(reason.value)!r} is the reason of the failure here, not its code"
            hint = f"write {{code: {text}, because: a sentence}}"
            findings.add("E172", mark, sentence, hint)
    if not isinstance(code, Constant) or code.value in FailureCode.__members__:
        return
    text = str(code.value)
    if _CODE.fullmatch(text) and not get_close_matches(
        text, FailureCode.__members__, 1, TYPING_SLIP
    ):
        return
    near = nearest(text.upper(), list(FailureCode.__members__))
    hint = did_you_mean(near) if near else "write capitals, digits and _: SHELF_EMPTY"
    findings.add("E172", mark, f"{text!r} is not a failure code", hint)
