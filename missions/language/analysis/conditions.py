"""Conditions that cannot change: over keys that nothing has written, arguments and ranges.

A condition is evaluated where it stands, with the values that its names have for certain there. A
tree can be used several times; a condition in it is reported only if it is constant in every use.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from missions.language.analysis.intervals import (
    EITHER,
    Interval,
    TruthValues,
    truth_values,
)
from missions.language.analysis.ranges import constant_comparisons, range_hint, text_of_comparison
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, NotSet, Role, Symbol
from missions.language.values import Constant, Reference, Value
from stack.documents import Findings, Mark
from stack.errors import EvaluationError

Evaluate = Callable[[], Any]

CHECK, WAIT, LIMITED_WAIT = "check", "wait", "limited wait"
"""Words of the conditions of behaviours: evaluated once, or until they are true."""


class _Unknown(Exception):
    """The value of a name is not known before the mission runs."""


class _NoRobot:
    """An evaluation context without values: whatever is read from it is unknown."""

    @property
    def robot(self) -> Any:
        raise _Unknown


@dataclass
class KnownValues:
    """The values that names have for certain at one place of the mission.

    Attributes:
        written, later: keys that may have another value than their initial one.
        inputs: `in` of the trees around the place -> what it is bound to.
        attempts: most attempts of the innermost retry or recover; None if not known.
        unset: keys that an `unset` before it removed, with its position.
        of_argument: whether a value that was read is that of an argument.
    """

    written: Mapping[Symbol, None]
    later: Mapping[Symbol, None] = field(default_factory=dict)
    inputs: Mapping[Symbol, Value] = field(default_factory=dict)
    attempts: int | None = None
    unset: Mapping[Symbol, Mark] = field(default_factory=dict)
    context: Any = field(default_factory=_NoRobot)
    of_argument: bool = False

    def value(self, symbol: Symbol) -> Any:
        """Return the value of a name; UNSET for a key without one.

        Raises:
            _Unknown: it can have several values.
        """
        if symbol.role is Role.INPUT:
            return self._bound(self.inputs.get(symbol))
        if symbol.role is Role.VARIABLE or symbol in self.written or symbol in self.later:
            raise _Unknown
        if symbol.keep:  # it may begin with any value
            raise _Unknown
        self.of_argument |= symbol.role is Role.ARGUMENT
        return symbol.value

    def _bound(self, value: Value | None) -> Any:
        if isinstance(value, Reference):
            return self.value(value.symbol)
        if isinstance(value, Constant):
            # `with: {n: $most}`: the value of an argument, or of a place
            self.of_argument |= value.text.startswith("$")
            return value.value
        raise _Unknown

    def reader(self, symbol: Symbol) -> Evaluate:
        """Return a function that reads the symbol, as bindings of a running tree do."""

        def read() -> Any:
            found = self.value(symbol)
            if found is UNSET:
                raise NotSet(symbol.name)
            return found

        return read

    def attempt(self) -> int:
        """Raise: the attempt is a range."""
        raise _Unknown

    def error(self) -> str:
        """Raise: the code is not known."""
        raise _Unknown

    def truth(self, condition: CheckedExpression) -> TruthValues:
        """Return the possible values of a condition."""
        try:
            return frozenset((bool(condition.bind(self)()),))
        except EvaluationError:
            return EITHER
        except _Unknown:
            pass
        numbers: dict[str, Any] = {}
        if self.attempts is not None:
            numbers["attempt"] = Interval(1, self.attempts)
        for name, symbol in condition.read.items():
            try:
                numbers[f"${name}"] = self.value(symbol)
            except _Unknown:
                continue
        return truth_values(condition.term, numbers)


@dataclass
class _Verdict:
    """A condition with its possible values; `unset_in`: line that unsets a key of it, or 0."""

    word: str
    condition: CheckedExpression
    mark: Mark
    owner: str
    of_argument: bool = False
    truth: TruthValues = frozenset()
    unset_in: int = 0


class Verdicts:
    """Collects the possible values of every condition over all its places, and reports them."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.found: dict[int, _Verdict] = {}

    def note(
        self, word: str, condition: CheckedExpression, owner: str, mark: Mark, known: KnownValues
    ) -> None:
        """Add a place of a condition; `word` is its key or the behaviour that evaluates it."""
        verdict = self.found.setdefault(
            id(condition), _Verdict(word, condition, condition.mark or mark, owner)
        )
        if verdict.truth == EITHER:
            return
        known.of_argument = False
        verdict.truth |= known.truth(condition)
        verdict.of_argument |= known.of_argument
        for symbol in (*condition.read.values(), *condition.tested.values()):
            if symbol in known.unset and symbol not in known.written:
                verdict.unset_in = known.unset[symbol].line

    def dead_waits(self) -> set[int]:
        """Return the ids of the conditions of `wait_until` that never become true."""
        return {
            key
            for key, item in self.found.items()
            if item.word in (WAIT, LIMITED_WAIT) and item.truth == {False} and not item.of_argument
        }

    def report(self) -> None:
        """Report every condition that has one value only, and every comparison in the others."""
        for item in self.found.values():
            if len(item.truth) != 1 or not self._report(item, True in item.truth):
                self._comparisons(item)

    def _comparisons(self, item: _Verdict) -> None:
        """Report a comparison that is constant by the ranges of its sides."""
        for part, value in constant_comparisons(item.condition):
            text = text_of_comparison(part) or f"a comparison in {item.condition.source}"
            whole = part is item.condition.term
            effect = _EFFECTS.get((item.word, value), "") if whole else ""
            sentence = f"{item.condition.source if whole else text} is always "
            sentence += f"{'true' if value else 'false'}{effect}"
            hint = range_hint(item.condition) or "correct or remove the comparison"
            self.findings.add("W107", item.mark, sentence, hint)
            return

    def _report(self, item: _Verdict, value: bool) -> bool:
        """Report a condition with one value; return whether it is worth a finding."""
        source, mark, word = item.condition.source, item.mark, item.word
        symbols = {**item.condition.read, **item.condition.tested}
        names = [f"${name}" for name, symbol in symbols.items() if not symbol.is_constant]
        if word in (WAIT, "event") and not value:
            what = "this waits forever" if word == WAIT else f"{item.owner} never fires"
            if item.of_argument:
                sentence = f"{what}: {source} is false, and arguments do not change"
                hint = "wait for something that changes, or use `check`"
                self.findings.add("W120", mark, sentence, hint)
                return True
            why = f"{source} is always false"
            hint = range_hint(item.condition) or "correct the condition"
            if names:
                why = f"{source} is false, and nothing that runs before or beside it writes "
                if item.unset_in:
                    why = f"{source} is false: line {item.unset_in} unsets it, and nothing writes "
                why += " or ".join(names)
                hint = f"write {names[0]} with `set` or `out`, or wait for another value"
            code = "E163" if word == WAIT else "E161"
            self.findings.add(code, mark, f"{what}: {why}", hint)
            return True
        if item.of_argument:
            return False
        if word == "while" and not value:
            sentence = f"{item.owner} fails as soon as it starts: {source} is false there"
            hint = f"write {names[0]} before it" if names else "correct the condition"
            self.findings.add("E164", mark, sentence, hint)
            return True
        state = "true" if value else "false"
        effect = _EFFECTS.get((word, value), "")
        if not names:
            hint = range_hint(item.condition) or "correct or remove the condition"
            self.findings.add("W107", mark, f"{source} is always {state}{effect}", hint)
            return True
        who = " or ".join(names)
        sentence = f"{source} is always {state} here{effect}; nothing has written {who}"
        if item.unset_in:
            sentence += f" since line {item.unset_in} unsets it"
        hint = f"write {names[0]} before with `set` or `out`, or remove the condition"
        self.findings.add("W107", mark, sentence, hint)
        return True


_EFFECTS = {
    ("when", False): ": the node never runs",
    (CHECK, False): ": the check always fails",
    ("unless", False): ": it never ends the recovery",
    ("unless", True): ": no recovery runs",
    ("until", False): ": the repetition never ends",
    ("until", True): ": it runs once",
    (LIMITED_WAIT, False): ": only the time limit or `while` around it ends the wait",
    (LIMITED_WAIT, True): ": it does not wait",
    ("event", True): ": the event fires once, at the start",
}
