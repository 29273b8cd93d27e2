"""Checked expressions, and what they become in a running tree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from missions.language.expressions.grammar import parse
from missions.language.expressions.robot_values import EvaluationContext
from missions.language.expressions.scope import NotSet, Scope, Symbol
from missions.language.expressions.terms import Check, Evaluate, Term, shown
from missions.language.expressions.tokens import ExpressionError
from missions.language.expressions.value_types import ANYTHING, BOOL, ValueType
from stack.documents import Mark


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Where an expression or a node stands: which names it knows.

    Attributes:
        scope: what `$name` means.
        knows_error: a failure is being dealt with, so that `error` means something.
        knows_attempt: a retry or recover stands around it, so that `attempt` does.
    """

    scope: Scope
    knows_error: bool = False
    knows_attempt: bool = False


class Bindings(Protocol):
    """Where a running tree keeps what symbols stand for."""

    @property
    def sight(self) -> EvaluationContext:
        """The robot, and the failure being dealt with."""
        ...

    def reader(self, symbol: Symbol) -> Evaluate:
        """A function that reads the symbol's value; it raises NotSet when there is none."""
        ...

    def attempt(self) -> int:
        """The attempt under way in the nearest retry or recover."""
        ...


@dataclass(frozen=True, slots=True)
class CheckedExpression:
    """An expression whose names and types have been checked.

    Attributes:
        read: symbols whose value it needs, by name.
        tested: symbols it asks `is set` of, by name.
        mark: where it stands, if it stands in a file.
    """

    source: str
    term: Term
    type: ValueType
    read: dict[str, Symbol]
    tested: dict[str, Symbol]
    mark: Mark | None = None

    def bind(self, bindings: Bindings) -> BoundExpression:
        """The expression on a running tree's values."""
        names = _Names({**self.tested, **self.read}, bindings)
        shows = tuple((end, term.bind(names)) for end, term in sorted_by_end(self.term))
        return BoundExpression(self.source, self.term.bind(names), shows)


class BoundExpression:
    """Satisfies stack.types.Expression."""

    __slots__ = ("_evaluate", "_shows", "source")

    def __init__(
        self, source: str, evaluate: Evaluate, shows: tuple[tuple[int, Evaluate], ...]
    ) -> None:
        self.source, self._evaluate, self._shows = source, evaluate, shows

    def __call__(self) -> Any:
        """The value now.

        Raises:
            NotSet: it reads a key that nothing has written yet.
            ZeroDivisionError: as it says.
        """
        return self._evaluate()

    def explain(self) -> str:
        """The source with the values of its names: `battery.charge (0.18) > $least (0.3)`."""
        parts, done = [], 0
        for end, read in self._shows:
            parts += [self.source[done:end], f" ({_now(read)})"]
            done = end
        return "".join([*parts, self.source[done:]])


@dataclass(frozen=True, slots=True)
class _Names:
    """Satisfies terms.Names: bindings, and which symbol a name of this expression is."""

    symbols: dict[str, Symbol]
    inner: Bindings

    @property
    def sight(self) -> EvaluationContext:
        return self.inner.sight

    def reader(self, name: str) -> Evaluate:
        return self.inner.reader(self.symbols[name])

    def attempt(self) -> int:
        return self.inner.attempt()


def check_expression(
    source: str, around: Surroundings, wanted: ValueType = BOOL
) -> tuple[CheckedExpression | None, list[ExpressionError]]:
    """An expression, parsed and checked; None with the problems when it cannot be used."""
    try:
        term = parse(source)
    except ExpressionError as error:
        return None, [error]
    check = Check(around.scope, around.knows_error, around.knows_attempt)
    found = term.check(check)
    if not check.problems and not wanted.accepts(found) and wanted is not ANYTHING:
        check.problem("E153", 0, f"expected {wanted}, got {found}")
    if check.problems:
        return None, check.problems
    return CheckedExpression(source, term, found, check.read, check.tested), []


def sorted_by_end(term: Term) -> list[tuple[int, Term]]:
    """The terms whose values an explanation shows, in the order of the source."""
    return sorted(term.named(), key=lambda pair: pair[0])


def _now(read: Evaluate) -> str:
    try:
        return shown(read())
    except NotSet:
        return "not set"
    except ArithmeticError as error:
        return str(error)
