"""Terms of expressions: each checks its type and compiles to a function without arguments."""

from __future__ import annotations

import operator
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from missions.language.expressions import arithmetic
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES, EvaluationContext
from missions.language.expressions.scope import NotSet, Scope, Symbol
from missions.language.expressions.tokens import ExpressionError
from missions.language.expressions.units import product, quotient
from missions.language.expressions.value_types import ANYTHING, BOOL, INT, POSE, TEXT, ValueType
from stack.errors import Hint
from stack.parameters import nearest, suggestion, write
from stack.types import FailureCode

Evaluate = Callable[[], Any]


class Bindings(Protocol):
    """Access to the values of symbols in a running tree."""

    @property
    def context(self) -> EvaluationContext:
        """The robot, and the failure being handled."""
        ...

    def reader(self, symbol: Symbol) -> Evaluate:
        """Return a function that reads the symbol's value; it raises NotSet if there is none."""
        ...

    def attempt(self) -> int:
        """Return the current attempt of the innermost retry or recover."""
        ...

    def error(self) -> str:
        """Return the code of the failure that the innermost recover or fallback deals with."""
        ...


@dataclass(frozen=True, slots=True)
class Names:
    """The bindings, with the symbols of one expression by name."""

    symbols: Mapping[str, Symbol]
    bindings: Bindings

    def reader(self, name: str) -> Evaluate:
        """Return a function that reads `$name`."""
        return self.bindings.reader(self.symbols[name])


@dataclass
class Check:
    """State of the check of one expression: allowed names, names read, problems found.

    Attributes:
        reads_robot: the expression reads a value of the robot, `error` or `attempt`.
        may_fail: it has a term that can fail although its names have values, such as a division.
    """

    scope: Scope
    knows_error: bool = False
    knows_attempt: bool = False
    read: dict[str, Symbol] = field(default_factory=dict)
    tested: dict[str, Symbol] = field(default_factory=dict)
    problems: list[ExpressionError] = field(default_factory=list)
    reads_robot: bool = False
    may_fail: bool = False

    def problem(self, code: str, at: int, sentence: str, hint: str = "") -> ValueType:
        """Record a problem; the type ANYTHING avoids follow-up problems."""
        self.problems.append(ExpressionError(at, sentence, hint, code))
        return ANYTHING

    def symbol(self, name: str, at: int) -> Symbol | None:
        """Return the symbol of a `$name`; record a problem if there is none."""
        found = self.scope.lookup(name)
        if found is None and self.scope.complete:
            self.problem("E140", at, f"there is no ${name}", self.scope.hint(name))
        return found


@dataclass(frozen=True, slots=True)
class Term(ABC):
    """A part of an expression; `at` is its offset in the source."""

    at: int

    @abstractmethod
    def check(self, check: Check) -> ValueType:
        """Return the type; record problems in `check`."""

    @abstractmethod
    def bind(self, names: Names) -> Evaluate:
        """Return a function that evaluates the term."""

    def parts(self) -> tuple[Term, ...]:
        """Return the terms that it combines."""
        return ()

    def walk(self) -> Iterator[Term]:
        """Yield the term and all that it combines."""
        yield self
        for part in self.parts():
            yield from part.walk()

    def named(self) -> Iterator[tuple[int, Term]]:
        """Yield the terms whose values an explanation shows, with the offset after each."""
        for part in self.parts():
            yield from part.named()


@dataclass(frozen=True, slots=True)
class ShownTerm(Term):
    """A term whose value an explanation shows; `end` is the offset after it."""

    end: int

    def named(self) -> Iterator[tuple[int, Term]]:
        yield self.end, self


@dataclass(frozen=True, slots=True)
class Literal(Term):
    """A number, a text, true, false or a failure code."""

    value: Any
    type: ValueType

    def check(self, check: Check) -> ValueType:
        return self.type

    def bind(self, names: Names) -> Evaluate:
        value = self.value
        return lambda: value


@dataclass(frozen=True, slots=True)
class Reference(ShownTerm):
    """`$name`."""

    name: str

    def check(self, check: Check) -> ValueType:
        symbol = check.symbol(self.name, self.at)
        if symbol is None:
            return ANYTHING
        check.read[self.name] = symbol
        return symbol.type

    def bind(self, names: Names) -> Evaluate:
        return names.reader(self.name)


@dataclass(frozen=True, slots=True)
class Named(ShownTerm):
    """A value of the robot: `battery.charge`, or a failure code in capitals."""

    name: str

    def check(self, check: Check) -> ValueType:
        if self.name in FailureCode.__members__:
            return TEXT
        found = ROBOT_VALUES.get(self.name)
        check.reads_robot = True
        if found is None:
            return check.problem(
                "E151", self.at, f"there is no value {self.name!r}", self._hint(check)
            )
        if self.name == "error" and not check.knows_error:
            check.problem(
                "E154", self.at, "`error` is not defined here",
                "use it in `unless`, in recoveries or in later children of a fallback",
            )  # fmt: skip
        if self.name == "attempt" and not check.knows_attempt:
            check.problem(
                "E154", self.at, "`attempt` is not defined here",
                "use it inside a retry or recover, or in `unless`",
            )  # fmt: skip
        return found.type

    def _hint(self, check: Check) -> str:
        if check.scope.lookup(self.name):
            return write(f"${self.name}")
        if self.name.isupper():
            return suggestion(self.name, FailureCode.__members__) + "; write other codes in quotes"
        if self.name == DISTANCE:
            return f"write {DISTANCE}($place)"
        if self.name.upper() in FailureCode.__members__:
            return f"failure codes are in capitals: {self.name.upper()}"
        if self.name.lower() in ("null", "none", "nil", "unset"):
            return "a key without a value: `$key is not set`"
        if nearest(self.name, [*ROBOT_VALUES]) is None and "." not in self.name:
            return f"write a text in quotes: '{self.name}'; write $ before a name"
        return suggestion(self.name, ROBOT_VALUES)

    def bind(self, names: Names) -> Evaluate:
        if self.name in FailureCode.__members__:
            code = str(FailureCode[self.name])
            return lambda: code
        if self.name == "attempt":
            return names.bindings.attempt
        if self.name == "error":
            return names.bindings.error
        read, context = ROBOT_VALUES[self.name].read, names.bindings.context
        return lambda: read(context)

    def named(self) -> Iterator[tuple[int, Term]]:
        if self.name not in FailureCode.__members__:
            yield self.end, self


@dataclass(frozen=True, slots=True)
class Distance(ShownTerm):
    """`pose.distance_to(...)`."""

    target: Term

    def check(self, check: Check) -> ValueType:
        found = self.target.check(check)
        check.reads_robot = True
        if not POSE.accepts(found):
            check.problem("E152", self.target.at, f"{DISTANCE} needs a Pose, got {found}")
        return ValueType(float, "m")

    def bind(self, names: Names) -> Evaluate:
        target, context = self.target.bind(names), names.bindings.context
        return lambda: context.robot.localisation.pose.distance_to(target())

    def parts(self) -> tuple[Term, ...]:
        return (self.target,)


POSE_FIELDS = {
    "x": ValueType(float, "m"),
    "y": ValueType(float, "m"),
    "heading": ValueType(float, "rad"),
}


@dataclass(frozen=True, slots=True)
class Field(ShownTerm):
    """`$pose.x`, `.y` or `.heading`."""

    target: Term
    name: str

    def check(self, check: Check) -> ValueType:
        target = self.target
        if isinstance(target, Reference) and f"{target.name}.{self.name}" in ROBOT_VALUES:
            if check.scope.lookup(target.name) is None:
                name = f"{target.name}.{self.name}"
                sentence = f"${name} is not a key: {name} is a value of the robot"
                hint = Hint(f"write `{name}` without $", name)
                return check.problem("E140", target.at, sentence, hint)
        found = target.check(check)
        if self.name not in POSE_FIELDS or not POSE.accepts(found):
            return check.problem(
                "E152", self.at, f"{found} has no {self.name!r}", "a Pose has x, y and heading"
            )
        return POSE_FIELDS[self.name]

    def bind(self, names: Names) -> Evaluate:
        target, read = self.target.bind(names), operator.attrgetter(self.name)
        return lambda: read(target())

    def parts(self) -> tuple[Term, ...]:
        return (self.target,)


@dataclass(frozen=True, slots=True)
class IsSet(ShownTerm):
    """`$key is set`, `$key is not set`."""

    name: str
    wanted: bool

    def check(self, check: Check) -> ValueType:
        symbol = check.symbol(self.name, self.at)
        if symbol is not None:
            check.tested[self.name] = symbol
        return BOOL

    def bind(self, names: Names) -> Evaluate:
        read, wanted = names.reader(self.name), self.wanted

        def evaluate() -> bool:
            try:
                read()
            except NotSet:
                return not wanted
            return wanted

        return evaluate

    def named(self) -> Iterator[tuple[int, Term]]:
        yield self.end, Reference(self.at, self.end, self.name)


@dataclass(frozen=True, slots=True)
class Unary(Term):
    """`not a` or `-a`."""

    word: str
    operand: Term

    def check(self, check: Check) -> ValueType:
        found = self.operand.check(check)
        if self.word == "not":
            return _require_bool(check, self.operand, found, "not")
        if not found.is_number:
            return check.problem("E152", self.operand.at, f"`-` needs a number, got {found}")
        return found

    def bind(self, names: Names) -> Evaluate:
        value, negative = self.operand.bind(names), arithmetic.negative
        return (lambda: not value()) if self.word == "not" else (lambda: negative(value()))

    def parts(self) -> tuple[Term, ...]:
        return (self.operand,)


_FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt,
    ">=": operator.ge, "+": arithmetic.add, "-": arithmetic.subtract, "*": arithmetic.multiply,
    "/": arithmetic.divide, "%": arithmetic.remainder,
}  # fmt: skip
_LOGIC, _EQUALITY, _ORDER = ("and", "or"), ("==", "!="), ("<", "<=", ">", ">=")


@dataclass(frozen=True, slots=True)
class Binary(Term):
    """`a < b`, `a and b`, `a + b`…"""

    word: str
    left: Term
    right: Term

    def check(self, check: Check) -> ValueType:
        left, right = self.left.check(check), self.right.check(check)
        if self.word in _LOGIC:
            _require_bool(check, self.left, left, self.word)
            return _require_bool(check, self.right, right, self.word)
        if self.word in _EQUALITY:
            if not (left.accepts(right) or right.accepts(left)):
                check.problem("E152", self.at, f"cannot compare {left} with {right}")
            return BOOL
        for term, found in ((self.left, left), (self.right, right)):
            if not found.is_number:
                sentence = f"`{self.word}` needs numbers, got {found}"
                hint = "write append($list, $item)" if self.word == "+" and found.item else ""
                return check.problem("E152", term.at, sentence, hint)
        if self.word in _ORDER:
            common_number(check, self.at, left, right, "compare")
            return BOOL
        check.may_fail = True
        if self.word in ("/", "%") and isinstance(self.right, Literal) and self.right.value == 0:
            return check.problem("E157", self.right.at, "division by zero")
        if self.word in ("*", "/"):
            return self._product(left, right)
        verb = "divide" if self.word == "%" else "add"
        return common_number(check, self.at, left, right, verb)

    def _product(self, left: ValueType, right: ValueType) -> ValueType:
        if left.of is int and right.of is int and self.word == "*":
            return INT
        if object in (left.of, right.of):
            return ANYTHING
        combined = product if self.word == "*" else quotient
        return ValueType(float, combined(left.unit, right.unit))

    def bind(self, names: Names) -> Evaluate:
        left, right = self.left.bind(names), self.right.bind(names)
        if self.word == "and":
            return lambda: left() and right()
        if self.word == "or":
            return lambda: left() or right()
        apply = _FUNCTIONS[self.word]
        return lambda: apply(left(), right())

    def parts(self) -> tuple[Term, ...]:
        return self.left, self.right


def common_number(check: Check, at: int, left: ValueType, right: ValueType, verb: str) -> ValueType:
    """Return the type of a sum of two numbers; record a problem if it has none."""
    for found in (left, right):
        if not found.is_number:
            return check.problem("E152", at, f"expected numbers, got {found}")
    if not left.agrees_on_unit(right):
        return check.problem("E152", at, f"cannot {verb} {left} and {right}")
    if object in (left.of, right.of):
        return right if left.of is object else left
    if left.of is int and right.of is int:
        return INT
    return ValueType(float, left.unit or right.unit)


def _require_bool(check: Check, term: Term, found: ValueType, word: str) -> ValueType:
    if not BOOL.accepts(found):
        check.problem("E152", term.at, f"`{word}` needs true or false, got {found}")
    return BOOL
