"""Reader of `tests`: the test cases of a mission, checked against the mission."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from missions.language.analysis.data_flow import steps_of
from missions.language.case_model import (
    FAILURE,
    RUNNING,
    SUCCESS,
    Case,
    Change,
    Expectation,
    Mock,
)
from missions.language.expressions.expression import NameContext
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.scope import Scope
from missions.language.expressions.value_types import type_of
from missions.language.foreign_words import MOCK_WORDS, meant_or_near
from missions.language.keys import CASE, EXPECTATION, MOCK, STATUS_WORDS, TAKES, WITHIN
from missions.language.reading.declarations import Layer
from missions.language.reading.port_expressions import text_of
from missions.language.reading.values import ValueReader
from missions.language.reading.words import WordRole, Words
from missions.language.step import Event, Step, Tree
from missions.language.values import Constant
from stack.documents import Findings, Mark, Node
from stack.errors import ParameterError
from stack.parameters import Declaration, suggestion
from stack.types import FailureCode

_FORMS = {
    "ran": "write {navigate_to_pose: 2}: names with numbers of starts",
    "mock": "write {navigate_to_pose: {returns: failure}}",
    "at": "write {5 s: {battery.charge: 0.1}}",
    "expect": "write {status: failure}",
    "arguments": "write {name: value}",
    "sets": "write {output: value}",
}
FIXED_VALUES = ("time", "error", "attempt")
_CHANGE_TIME = Declaration("at", float, unit="s", at_least=0.0)
_COUNT = Declaration("ran", int, at_least=0)


@dataclass(frozen=True)
class MissionNames:
    """The names of a mission that test cases can use."""

    arguments: Mapping[str, Declaration]
    places: Layer
    keys: Layer
    events: tuple[Event, ...]
    trees: Mapping[str, Tree]
    roots: tuple[Step, ...]

    def steps(self) -> Iterator[Step]:
        """Yield all nodes."""
        return (step for root in self.roots for step in steps_of(root))

    @property
    def all_events(self) -> tuple[Event, ...]:
        """The events of the mission and of its trees."""
        return (*self.events, *(event for tree in self.trees.values() for event in tree.events))


class CaseReader:
    """Reads the section `tests`."""

    def __init__(self, known: MissionNames, findings: Findings, words: Words) -> None:
        self.known, self.findings, self.words = known, findings, words
        self.context = NameContext(Scope((known.places,)))
        self.outputs = _outputs_by_name(known)
        self.sure = _names_that_never_fail(known)
        self.names = [*self.outputs, *_unmockable_names(known)]
        words.names = tuple(self.names)

    def cases(self, node: Node | None) -> tuple[Case, ...]:
        """Return the cases; report all errors in them."""
        if node is None or (node.kind == "scalar" and node.value is None):
            return ()
        if not node.is_sequence:
            self._error(node, f"tests must be a list of cases, got {node.words()}")
        cases = tuple(self._case(number, item) for number, item in enumerate(node.items, 1))
        first: dict[str, Case] = {}
        for case in cases:
            other = first.setdefault(case.name, case)
            if other is not case:
                sentence = f"there are two tests {case.name!r} (line {other.mark.line})"
                self.findings.add("E115", case.mark, sentence, "rename one of them")
        return cases

    def _case(self, number: int, node: Node) -> Case:
        self.words.keys(node, "case")
        self._only(node, CASE, "a case")
        title = node.get("name")
        name = str(title.value) if title is not None else f"case {number}"
        return Case(
            name, node.mark, self._arguments(node.get("arguments")), self._mocks(node.get("mock")),
            tuple(self._changes(node.get("at"))), self._expect(node.get("expect")),
        )  # fmt: skip

    def _arguments(self, node: Node | None) -> dict[str, Node]:
        found = {}
        if node is not None and not node.is_mapping:
            self.words.add(node, WordRole.ARGUMENT)
        for key, value in self._entries(node, "arguments"):
            self.words.add(key, WordRole.ARGUMENT)
            declared = self.known.arguments.get(str(key.value))
            if declared is None:
                self._unknown(key, "argument", self.known.arguments)
                continue
            self._value(declared, value)
            found[declared.name] = value
        return found

    # Mocks

    def _mocks(self, node: Node | None) -> dict[str, Mock]:
        found = {}
        if node is not None and not node.is_mapping:
            self.words.choice(node, self.outputs, WordRole.NODE_NAME)
        for key, value in self._entries(node, "mock"):
            name = str(key.value)
            self.words.choice(key, self.outputs, WordRole.NODE_NAME)
            self.words.keys(value, "mock")
            if name not in self.outputs:
                self._unknown(key, "behaviour, tree or named leaf", self.outputs)
                continue
            found[name] = self._mock(value, self.outputs[name])
            failures = {item for item in found[name].returns if item not in (SUCCESS, RUNNING)}
            if failures and name in self.sure:
                sentence = f"{name} never fails: its mock cannot return {min(failures)}"
                self._error(value, sentence, "mock a node that can fail")
        return found

    def _mock(self, node: Node, outputs: Mapping[str, Declaration]) -> Mock:
        if node.value == "real":
            return Mock(is_real=True)
        if not node.is_mapping:
            return Mock(returns=self._outcomes(node))
        self._only(node, MOCK, "a mock")
        returns, takes = node.get("returns"), node.get("takes")
        sets = {}
        for key, value in self._entries(node.get("sets"), "sets"):
            self.words.choice(key, outputs)
            if str(key.value) not in outputs:
                self._unknown(key, "output", outputs)
            else:
                sets[str(key.value)] = self._value(outputs[str(key.value)], value)
        times = [self._value(TAKES, item) for item in _items(takes)]
        return Mock(
            self._outcomes(returns) if returns else (SUCCESS,),
            tuple(time or 0.0 for time in times) or (0.0,), sets,
        )  # fmt: skip

    def _outcomes(self, node: Node) -> tuple[str, ...]:
        words = (*STATUS_WORDS, *FailureCode.__members__)
        for item in _items(node):
            self.words.choice(item, words)
            if item.value not in words and not _is_own_code(item):
                self._error(item, f"expected an outcome, got {item.words()}", _hint(item, words))
        return tuple(str(item.value) for item in _items(node)) or (SUCCESS,)

    # Changes

    def _changes(self, node: Node | None) -> list[Change]:
        changes = []
        for key, body in self._entries(node, "at"):
            if not body.is_mapping:
                self.words.add(body, WordRole.CHANGE)
            if not body.is_mapping and str(key.value).startswith(("$", "event", *ROBOT_VALUES)):
                hint = f"write the time first: at: {{5 s: {{{key.value}: {text_of(body)}}}}}"
                sentence = "`at` has changes below times: {5 s: {…}}"
                self._error(key, f"{sentence}, got {key.words()}", hint)
                continue
            time = self._value(_CHANGE_TIME, key) or 0.0
            for name, value in self._entries(body, "changes"):
                changes += self._change(time, name, value)
        return sorted(changes, key=lambda change: change.at)

    def _change(self, at: float, key: Node, node: Node) -> list[Change]:
        name = str(key.value)
        self.words.add(key, WordRole.CHANGE)
        if name == "event":
            names = [event.name for event in self.known.all_events]
            self.words.choice(node, names, WordRole.NODE_NAME)
            if node.value not in names:
                self._unknown(node, "event", names)
            return [Change(at, "event", str(node.value))]
        if name.startswith("$"):
            symbol = self.known.keys.get(name[1:])
            if symbol is None:
                self._unknown(key, "key", [f"${one}" for one in self.known.keys])
                return []
            value = self._value(symbol.type.declaration(symbol.name), node)
            return [Change(at, "key", symbol.name, value)]
        values = {one: item for one, item in ROBOT_VALUES.items() if one not in FIXED_VALUES}
        if name not in values:
            self._unknown(key, "robot value", values)
            return []
        known = values[name]
        limits = {
            "at_least": known.least if known.least > -inf else None,
            "at_most": known.most if known.most < inf else None,
        }
        return [
            Change(at, "value", name, self._value(known.type.declaration(name, **limits), node))
        ]

    # Expectations

    def _expect(self, node: Node | None) -> Expectation:
        if node is None:
            return Expectation(status=SUCCESS)
        if not node.is_mapping:
            self.words.add(node, WordRole.EXPECTATION)
        found: dict[str, Any] = {
            "status": None, "failure": None, "order": (), "keys": {}, "ran": {}, "within_each": {},
            "marks": {},
        }  # fmt: skip
        for key, value in self._entries(node, "expect"):
            word = str(key.value)
            self.words.add(key, WordRole.EXPECTATION)
            found["marks"][word] = value.mark
            if word in ("status", "failure"):
                found[word] = self._word(word, value)
            elif word == "ran":
                self._ran(value, found)
            elif word == "order":
                found["order"] = tuple(self._name(item) for item in _items(value))
            elif word == "within":
                self._within(value, found)
            else:
                self._key(key, value, found)
        self._contradictions(node, found)
        if found["status"] is None:
            found["status"] = SUCCESS if found["failure"] is None else FAILURE
        return Expectation(**found)

    def _contradictions(self, node: Node, found: dict[str, Any]) -> None:
        """Report expectations that cannot be met together."""
        marks, status, failure = found["marks"], found["status"], found["failure"]
        if failure is not None and status not in (None, FAILURE):
            sentence = f"a mission that ends with {status} has no failure {failure}"
            if status == RUNNING:
                sentence = f"a mission that is still running has no failure {failure}"
            self._error_at(marks["failure"], sentence, "remove `status` or `failure`")
        for name in dict.fromkeys(found["order"]):
            most, wanted = found["ran"].get(name, (0, inf))[1], found["order"].count(name)
            if most < wanted:
                sentence = f"order has {wanted} starts of {name!r}, but ran allows {most:g}"
                self._error_at(marks[f"ran {name}"], sentence)

    def _word(self, word: str, node: Node) -> str:
        is_code = word == "failure"
        words = tuple(FailureCode.__members__) if is_code else STATUS_WORDS
        self.words.choice(node, words)
        if node.value not in words and not (is_code and _is_own_code(node)):
            hint = _hint(node, words) if is_code else suggestion(str(node.value), words)
            self._error(node, f"{word} cannot be {node.words()}", hint)
        return str(node.value)

    def _key(self, key: Node, node: Node, found: dict[str, Any]) -> None:
        name = str(key.value).removeprefix("$")
        symbol = self.known.keys.get(name)
        if symbol is None:
            self._unknown(key, "expectation", [*EXPECTATION, *self.known.keys])
            return
        if name in found["keys"]:
            self._error(key, f"two expectations for the key {name!r}", "remove one")
        found["marks"][f"${name}"] = node.mark
        value = None
        if node.value is not None:
            value = self._value(symbol.type.declaration(name), node)
        found["keys"][name] = value

    def _ran(self, node: Node, found: dict[str, Any]) -> None:
        for key, value in self._entries(node, "ran"):
            counts = [self._value(_COUNT, item) or 0 for item in _items(value)]
            if len(counts) not in (1, 2):
                self._error(value, f"expected a number or [least, most], got {value.words()}")
                continue
            if counts[0] > counts[-1]:
                hint = f"write [{counts[-1]}, {counts[0]}]"
                self._error(value, f"expected [least, most], got [{counts[0]}, {counts[-1]}]", hint)
            name = self._name(key)
            found["ran"][name] = (counts[0], counts[-1])
            found["marks"][f"ran {name}"] = value.mark

    def _within(self, node: Node, found: dict[str, Any]) -> None:
        if not node.is_mapping:
            found["within"] = self._value(WITHIN, node)
            return
        for key, value in node.entries:
            name = self._name(key)
            found["within_each"][name] = self._value(WITHIN, value) or inf
            found["marks"][f"within {name}"] = value.mark

    # Findings

    def _name(self, node: Node) -> str:
        self.words.choice(node, self.names, WordRole.NODE_NAME)
        if str(node.value) not in self.names:
            self._unknown(node, "node, behaviour, tree or event", self.names)
        return str(node.value)

    def _value(self, declared: Declaration, node: Node) -> Any:
        try:
            if node.kind == "scalar" and type_of(declared).of is float:
                return declared.read(node.plain())
        except ParameterError as error:
            self._error(node, str(error), error.hint)
            return None
        found = Findings()
        value = ValueReader(found, self.words).value(declared, node, self.context)
        for item in found.items:
            self.findings.add("E115", item.mark, item.sentence, item.hint)
        return value.value if isinstance(value, Constant) else None

    def _entries(self, node: Node | None, what: str) -> list[tuple[Node, Node]]:
        if node is not None and not node.is_mapping and node.value is not None:
            self._error(node, f"{what} must be a mapping, got {node.words()}", _FORMS.get(what, ""))
        return node.entries if node is not None else []

    def _only(self, node: Node, known: Iterable[str], what: str) -> None:
        if not node.is_mapping:
            self._error(node, f"{what} must be a mapping, got {node.words()}")
        for key, _ in node.entries:
            if key.value not in known:
                words = MOCK_WORDS if what == "a mock" else {}
                hint = meant_or_near(str(key.value), words, known)
                self._error(key, f"{what} has no {key.value!r}", hint)

    def _unknown(self, node: Node, what: str, known: Iterable[str]) -> None:
        self._error(node, f"there is no {what} {node.value!r}", suggestion(str(node.value), known))

    def _error(self, node: Node, sentence: str, hint: str = "") -> None:
        self._error_at(node.mark, sentence, hint)

    def _error_at(self, mark: Mark, sentence: str, hint: str = "") -> None:
        self.findings.add("E115", mark, sentence, hint)


def _is_own_code(node: Node) -> bool:
    """Return whether a node is a failure code of the author: capitals in quotes."""
    return isinstance(node.value, str) and node.quoted and node.value.isupper()


def _hint(node: Node, words: Iterable[str]) -> str:
    """Return the hint for an unknown failure code."""
    own = "; write your own codes in quotes" if str(node.value).isupper() else ""
    return f"{suggestion(str(node.value), words)}{own}"


def _items(node: Node | None) -> list[Node]:
    if node is None:
        return []
    return node.items if node.is_sequence else [node]


def _outputs_by_name(known: MissionNames) -> dict[str, dict[str, Declaration]]:
    """Return the outputs of everything that can be mocked, by each of its names."""
    found: dict[str, dict[str, Declaration]] = {}
    for step in known.steps():
        outputs = step.mock_outputs(known.trees[step.uses].outputs if step.uses else {})
        for name in step.names if outputs is not None else ():
            found.setdefault(name, {}).update(outputs or {})
    return found


def _names_that_never_fail(known: MissionNames) -> set[str]:
    """Return the names whose behaviours all succeed if they end: `wait`, `say`."""
    leaves = [
        step for step in known.steps()
        if not step.uses and step.mock_outputs({}) is not None
    ]  # fmt: skip
    fail = {name for step in leaves if step.outcomes(()).failure for name in step.names}
    return {name for step in leaves for name in step.names} - fail


def _unmockable_names(known: MissionNames) -> list[str]:
    named = [step.name for step in known.steps() if step.name]
    unmocked = [step for step in known.steps() if not step.uses and step.mock_outputs({}) is None]
    named += [step.own_name for step in unmocked if step.own_name]
    return [*named, *(event.name for event in known.all_events)]
