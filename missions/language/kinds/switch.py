"""`switch`: the node of one case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.expression import CheckedExpression, NameContext
from missions.language.expressions.scope import Symbol
from missions.language.expressions.terms import Named
from missions.language.expressions.value_types import TEXT
from missions.language.keys import Form, Key, required, section
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.step import Claims, Codes, Order, Outcomes, Step, TreeBuilder
from missions.language.values import Computed, Value
from missions.trees.context import Execution
from missions.trees.node import Decorator, InnerNode, Node, run
from missions.trees.slots import Frame
from stack.documents import Findings
from stack.documents import Node as YamlNode
from stack.parameters import suggestion
from stack.types import Expression, Failure, FailureCode

KEYS = section(
    Key("value", "the text that chooses: an expression, for example `$mode` or `error`",
        Form.EXPRESSION, required=True),
    Key("cases", "text -> node", Form.CASES, required=True),
    Key("default", "the node for all other texts", Form.NODE),
)  # fmt: skip


class Case(Decorator):
    """One case of a `switch`; its outcome is that of its node."""

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        return self.outcome_of_child()


class Switch(InnerNode, composites.Composite):
    """Runs the case of a text; chooses at the start, and keeps to it until the case ends.

    Args:
        cases: text -> node.
        default: node for all other texts; without one the node fails.
    """

    def __init__(
        self, name: str, execution: Execution, value: Expression, cases: Mapping[str, Behaviour],
        default: Behaviour | None,
    ) -> None:  # fmt: skip
        super().__init__(name, [*cases.values(), *([default] if default else [])])
        self.execution, self.value, self.cases, self.default = execution, value, cases, default

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            text = self.value()
            self.current_child = self.cases.get(text, self.default)
            self.feedback_message = self.value.explain()
            if self.current_child is None:
                sentence = f"no case for {text!r}: {self.value.explain()}"
                return self.execution.fail(self, Failure(FailureCode.CHECK_FAILED, sentence))
        child: Any = self.current_child
        run(child)
        return self.outcome_of(child)


@dataclass(frozen=True, slots=True)
class SwitchStep(Step):
    """`switch`: the node of one case.

    Attributes:
        value: the text that chooses.
        cases: text -> node, in the order of the file.
        default: node for all other texts.
    """

    value: CheckedExpression
    cases: Mapping[str, Step]
    default: Step | None

    order = Order.ONE

    def children(self) -> tuple[Step, ...]:
        return (*self.cases.values(), *((self.default,) if self.default else ()))

    def reads(self) -> Iterator[Value]:
        yield Computed(self.value, TEXT)

    def writes(self) -> tuple[Symbol, ...]:
        return ()

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        return Outcomes(
            any(item.success for item in children),
            self.default is None or any(item.failure for item in children),
            any(item.skip for item in children),
        )

    def least_time(self, children: Sequence[float]) -> float:
        return min(children, default=0.0)

    def begins(self, children: Sequence[Claims]) -> Claims:
        return frozenset.intersection(*children) if children else frozenset()

    def fails_with(self) -> Codes:
        return frozenset() if self.default else frozenset((FailureCode.CHECK_FAILED,))

    @property
    def detail(self) -> str:
        return self.value.source

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        def case(name: str, step: Step) -> Node:
            node = Case(name, builder.step(step, frame), builder.execution)
            return builder.record(node, CASE.word, step.mark)

        cases = {text: case(f"case {text}", step) for text, step in self.cases.items()}
        default = case("default", self.default) if self.default else None
        name, value = self.name or self.kind, self.value.bind(frame)
        return Switch(name, builder.execution, value, cases, default)


def _read(reader: NodeReading, written: Written, context: NameContext) -> SwitchStep | None:
    """Read `switch: {value: $mode, cases: {fast: …}, default: …}`."""
    head, body = written.head, written.body
    if body is None or not body.is_mapping:
        got = "nothing" if body is None else body.words()
        sentence = f"switch must be {{value: …, cases: {{…}}, default: …}}, got {got}"
        hint = "indent `value:` and `cases:` below `switch:`"
        reader.findings.add("E170", body.mark if body else head.mark, sentence, hint)
        return None
    reader.values.keys(body, "switch", KEYS, "E170", context)
    for word in required(KEYS):
        if body.get(word) is None:
            reader.findings.add("E170", head.mark, f"switch needs `{word}`")
    given, listed, other = (body.get(word) for word in ("value", "cases", "default"))
    value = reader.values.expression(given, context, TEXT) if given else None
    default = reader.read(other, context) if other else None
    cases = _cases(reader, listed, context) if listed else {}
    if value is None or not cases or (other and default is None):
        return None
    if listed is not None:
        _check_cases(reader.findings, value, listed, default)
    return SwitchStep(*head, value, cases, default)


def _cases(reader: NodeReading, listed: YamlNode, context: NameContext) -> dict[str, Step]:
    if not listed.is_mapping or not listed.entries:
        sentence = f"cases must be a mapping {{text: node}}, got {listed.words()}"
        hint = "remove the `- `: each text is a key" if listed.is_sequence else ""
        reader.findings.add("E170", listed.mark, sentence, hint)
    cases: dict[str, Step] = {}
    for key, node in listed.entries:
        if not isinstance(key.value, str):
            hint = f'write "{key.value}" in quotes'
            reader.findings.add("E170", key.mark, f"a case is a text, got {key.words()}", hint)
        step = reader.read(node, context)
        if step is not None:
            cases[str(key.value)] = step
    return cases


def _check_cases(
    findings: Findings, value: CheckedExpression, listed: YamlNode, default: Step | None
) -> None:
    """Report cases that the value cannot have, and values of an enum without a case."""
    options, own = _options(value)
    if not options:
        return
    for key, _ in listed.entries:
        if key.value not in options and not (own and key.quoted):
            sentence = f"{value.source} is never {key.value!r}"
            hint: str = suggestion(str(key.value), options)
            if key.value in ("default", "else", "otherwise"):
                hint = "write `default:` beside `cases:`, not below it"
            findings.add("E170", key.mark, sentence, hint)
    missing = [word for word in options if word not in [key.value for key, _ in listed.entries]]
    if missing and default is None and not own:
        sentence = f"no case for {', '.join(missing)}, and no `default`: the node fails then"
        findings.add("W170", listed.mark, sentence)


def _options(value: CheckedExpression) -> tuple[tuple[str, ...], bool]:
    """Return the texts that a value can have (empty: any), and whether others in quotes can be."""
    if isinstance(value.term, Named) and value.term.name == "error":
        return tuple(FailureCode.__members__), True
    symbols = list(value.read.values())
    if len(symbols) == 1 and value.source.strip() == f"${symbols[0].name}":
        return symbols[0].one_of, False
    return (), False


SWITCH = NodeKind(
    "switch",
    "the node of one case, chosen at the start: `{switch: {value: $mode, cases: {fast: …, "
    "slow: …}, default: …}}`; without a case and a `default` it fails (CHECK_FAILED)",
    Shape.CASES, "⑂", Outline.OCTAGON, Switch,
    "{switch: {value: $m, cases: {a: {say: a}}}}\narguments: {m: {type: text, default: a}}",
    keeps="the chosen case", empty="another case was chosen", keys=KEYS,
    read=_read, step=SwitchStep,
)  # fmt: skip
CASE = NodeKind(
    "case", "one case of a `switch`", Shape.CHILD, "⊢", Outline.HEXAGON, Case,
    SWITCH.example, empty="another case was chosen",
)  # fmt: skip
