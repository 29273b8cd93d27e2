"""Keys: only read, only written, written twice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from missions.language.analysis.data_flow import steps_of
from missions.language.analysis.order import OrderCheck
from missions.language.case_model import Case
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.step import Event, Order, Step
from missions.language.values import symbols_in
from stack.documents import Findings


class KeyFlowCheck:
    """Collects who reads and who writes each key, over run, events and trees."""

    def __init__(self, findings: Findings, order: OrderCheck) -> None:
        self.findings, self.order = findings, order
        self.read: set[Symbol] = set()
        self.variables: list[Symbol] = []
        self.written: dict[Symbol, Step] = {}
        self.results: set[Symbol] = set()

    def mission(self, roots: Sequence[Step], events: Sequence[Event]) -> None:
        """Check the nodes of run, events and trees."""
        for event in events:
            self.read.update(symbols_in(event.when))
            durations = [value for value in (event.hold, event.again) if value is not None]
            self.read.update(symbol for value in durations for symbol in value.symbols())
        for root in roots:
            for step in steps_of(root):
                self._step(step)
        for variable in self.variables:
            self._variable(variable)

    def keys(self, keys: Mapping[str, Symbol], cases: Sequence[Case]) -> None:
        """Report keys that are only read, or only written by `set`.

        Test cases read and write keys, too. The results of `out` are shown by the report.
        """
        expected = {name for case in cases for name in case.expect.keys}
        changed = keys_changed_by(cases)
        for key in keys.values():
            reads = key in self.read or key.name in expected
            self._one_sided(key, reads, writes=key in self.written or key.name in changed)

    def _one_sided(self, key: Symbol, reads: bool, *, writes: bool) -> None:
        if writes and not reads and not key.doc and key not in self.results:
            sentence = f"the key {key.name!r} is written, but nothing reads it"
            hint = "remove it; if it is for the report, describe it: `doc: …`"
            self.findings.add("W129", key.mark, sentence, hint)
        elif reads and not writes and key.value is not UNSET:
            sentence = f"the key {key.name!r} is read, but nothing writes it"
            hint = "write it with `set` or `out`, or make it an argument"
            self.findings.add("W129", key.mark, sentence, hint)
        elif reads and not writes:
            sentence = f"the key {key.name!r} never has a value: nothing writes it"
            hint = f"write it with `set`, or with `out: {{…: ${key.name}}}`"
            self.findings.add("W129", key.mark, sentence, hint)

    def _step(self, step: Step) -> None:
        self.read.update(_read_for_others(step))
        self.variables += step.variables()
        self._outputs(step, step.results())
        self.results.update(step.results().values())
        for symbol in step.writes():
            self.written.setdefault(symbol, step)
        if step.order is Order.TOGETHER:
            self._at_once(step)

    def _variable(self, variable: Symbol) -> None:
        if variable not in self.read:
            sentence = f"the loop variable {variable.name!r} is never used: each run does the same"
            hint = f"write ${variable.name} in the node under `do`, or use `repeat`"
            self.findings.add("W102", variable.mark, sentence, hint)

    def _outputs(self, step: Step, outputs: Mapping[str, Symbol]) -> None:
        names: dict[Symbol, str] = {}
        for name, symbol in outputs.items():
            if symbol in names:
                first = names[symbol]
                sentence = f"{first} and {name} of {step.title} both go to ${symbol.name}"
                hint = "use a key for each output"
                self.findings.add("E168", step.mark, sentence, hint)
            names[symbol] = name

    def _at_once(self, step: Step) -> None:
        """Report children of a parallel that write the same key."""
        first: dict[Symbol, Step] = {}
        for child in step.children():
            for symbol in self.order.writes(child):
                other = first.setdefault(symbol, child)
                if other is not child:
                    sentence = f"{child.title} and {other.title} (line {other.mark.line}) "
                    sentence += f"both write ${symbol.name}: the later one wins"
                    hint = "use a key for each child"
                    self.findings.add("W130", child.mark, sentence, hint)


def keys_changed_by(cases: Sequence[Case]) -> set[str]:
    """Return the names of the keys that `at` of a test case writes."""
    return {item.name for case in cases for item in case.changes if item.kind == "key"}


def _read_for_others(step: Step) -> set[Symbol]:
    """Return the symbols that a node reads; `n: $n + 1` alone does not count as reading n."""
    found = {
        symbol for condition in step.modifiers.conditions() for symbol in symbols_in(condition)
    }
    for value in (*step.modifiers.values(), *step.reads()):
        found |= {*value.symbols()} - {*value.reads_for_itself()}
    return found
