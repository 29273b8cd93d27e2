"""`use`: a tree of this file, with its inputs and the targets of its outputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Sequence as Items
from dataclasses import dataclass

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.texts import formatter
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.kinds.leaf import mocked, ports_text
from missions.language.reading.modifiers import RawModifiers, value_in
from missions.language.reading.ports import Owner
from missions.language.reading.words import WordRole
from missions.language.step import Outcomes, Step, TreeBuilder
from missions.language.values import Constant, Value
from missions.trees.context import Execution
from missions.trees.latch import Read as ReadValue
from missions.trees.node import Decorator, Node, run
from missions.trees.slots import Frame, Slot, Write
from stack.parameters import REQUIRED, Declaration, suggestion


class Subtree(Decorator):
    """`use`: a named subtree; its outcome is that of its root.

    Args:
        unbound: writers of outputs without a target, which are unset at the start of a run.
        optional: writers of targets without an initial value, which are unset after a failure.
    """

    def __init__(
        self, name: str, child: Behaviour, execution: Execution,
        unbound: Items[Write] = (), optional: Items[Write] = (),
    ) -> None:  # fmt: skip
        super().__init__(name, child, execution)
        self.unbound, self.optional = unbound, optional

    def advance(self, fresh: bool) -> Status:
        if fresh:
            for write in self.unbound:
                write(None)
        run(self.child)
        status = self.outcome_of_child()
        if status is Status.FAILURE:
            for write in self.optional:
                write(None)
        return status


@dataclass(frozen=True, slots=True)
class UseStep(Step):
    """A used tree, with its inputs and the targets of its outputs."""

    tree: str
    inputs: Mapping[str, Value]
    outputs: Mapping[str, Symbol]

    def children(self) -> tuple[Step, ...]:
        return ()

    @property
    def uses(self) -> str:
        return self.tree

    def reads(self) -> Iterator[Value]:
        return iter(self.inputs.values())

    def writes(self) -> tuple[Symbol, ...]:
        return tuple(self.outputs.values())

    def binds(self, inputs: Mapping[str, Symbol]) -> Iterator[tuple[Symbol, Value]]:
        return ((inputs[name], value) for name, value in self.inputs.items())

    def results(self) -> Mapping[str, Symbol]:
        return self.outputs

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        return children[0]

    def least_time(self, children: Sequence[float]) -> float:
        return children[0]

    @property
    def detail(self) -> str:
        return ports_text(self.inputs, self.outputs)

    def mock_outputs(self, outputs: Mapping[str, Symbol]) -> Mapping[str, Declaration]:
        return {name: symbol.type.declaration(name) for name, symbol in outputs.items()}

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        other = builder.stand_in(self)
        return mocked(self, other, builder, frame) if other else self._built(builder, frame)

    def _built(self, builder: TreeBuilder, frame: Frame) -> Node:
        tree, outermost = builder.trees[self.tree], builder.frame
        assert tree.root is not None
        readers, writers = dict(outermost.readers), dict(outermost.writers)
        unbound: list[Write] = []
        optional: list[Write] = []
        inputs: list[ReadValue] = []
        for name, symbol in tree.inputs.items():
            readers[symbol] = frame.value(self.inputs[name])
            inputs.append(readers[symbol])
        for name, symbol in tree.outputs.items():
            target = self.outputs.get(name)
            own = Slot(symbol)
            readers[symbol] = frame.readers[target] if target else own.read
            writers[symbol] = frame.writers[target] if target else own.write
            if target is None:
                unbound.append(own.write)
            elif frame.can_be_unset(target):
                optional.append(frame.writers[target])
        always_set = frozenset(
            tree.outputs[name]
            for name, target in self.outputs.items()
            if not frame.can_be_unset(target)
        )
        execution = builder.execution
        inside = Frame(execution, readers, writers, frame.attempts, frame.handled, always_set)
        root = builder.events(tree.events, builder.step(tree.root, inside), inside)
        used = Subtree(self.name or self.tree, root, execution, unbound, optional)
        return used.taking(*inputs)


def _read(reader: NodeReading, written: Written, context: NameContext) -> UseStep | None:
    head, body, raw = written.head, written.body, written.raw
    word = body.value if body is not None and not body.is_mapping else None
    tree = reader.trees.get(word) if isinstance(word, str) else None
    if body is not None:
        reader.values.words.add(body, WordRole.TREE, context.scope)
    if body is None or tree is None:
        _report_unknown(reader, written)
        _skim_passed(reader, raw, context)
        return None
    defaults = {
        name: symbol.value for name, symbol in tree.inputs.items() if symbol.value is not UNSET
    }
    declared = {
        name: symbol.type.declaration(name, default=defaults.get(name, REQUIRED))
        for name, symbol in tree.inputs.items()
    }
    owner = Owner(tree.name, body.mark, is_tree=True, misplaced=raw)
    inputs = reader.ports.by_name(declared, value_in(raw, "with"), owner, context, WordRole.INPUT)
    for name, value in defaults.items():
        text = formatter(tree.inputs[name].type, shown)(value)
        inputs.setdefault(name, Constant(value, text))
    results = {name: symbol.type for name, symbol in tree.outputs.items()}
    outputs = reader.ports.outputs(results, value_in(raw, "out"), owner, context)
    return UseStep(*head, tree.name, inputs, outputs)


def _report_unknown(reader: NodeReading, written: Written) -> None:
    body = written.body
    word = body.value if body is not None and not body.is_mapping else None
    mark = body.mark if body is not None and body.value is not None else written.head.mark
    hint = suggestion(str(word), reader.trees) if reader.trees else "declare it under `trees`"
    if word in reader.known:
        hint = f"{word} is a behaviour: write `{word}:`"
    sentence = f"there is no tree {word!r}"
    if not isinstance(word, str):
        got = body.words() if body is not None else "nothing"
        sentence, hint = f"use needs the name of a tree, got {got}", "write `use: NAME`"
    reader.findings.add("E122", mark, sentence, hint)


def _skim_passed(reader: NodeReading, raw: RawModifiers, context: NameContext) -> None:
    """Record the words under `with` and `out` of an unknown tree."""
    for word, role in (("with", WordRole.VALUE), ("out", WordRole.TARGET)):
        given = value_in(raw, word)
        for _, value in given.entries if given else []:
            reader.values.words.add(value, role, context.scope)


USE = NodeKind(
    "use", "a tree of this file: `{use: inspect, with: {…}, out: {…}}`",
    Shape.TREE, "▣", Outline.FOLDER, Subtree,
    "{use: greet}\ntrees: {greet: {do: {say: a}}}", takes_outputs=True, takes_inputs=True,
    also_known_as=("SubTree", "SubTreePlus"), read=_read, step=UseStep,
)  # fmt: skip
