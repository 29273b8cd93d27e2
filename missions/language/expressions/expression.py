"""Checked expressions, and bound expressions of a running tree."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from missions.language.expressions.grammar import parse
from missions.language.expressions.robot_values import EvaluationContext
from missions.language.expressions.scope import UNSET, NotSet, Scope, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.terms import Bindings, Check, Evaluate, Names, Term
from missions.language.expressions.tokens import ExpressionError
from missions.language.expressions.value_types import ANYTHING, BOOL, INT, ValueType
from stack.documents import Mark
from stack.errors import EvaluationError

SHOWN = 80
"""Characters of a value in an explanation."""


@dataclass(frozen=True, slots=True)
class NameContext:
    """The names that an expression or a node can use.

    Attributes:
        scope: meaning of `$name`.
        knows_error: `error` is defined, because a failure is being handled.
        knows_attempt: `attempt` is defined, because of an outer retry or recover.
    """

    scope: Scope
    knows_error: bool = False
    knows_attempt: bool = False


@dataclass(frozen=True, slots=True)
class CheckedExpression:
    """An expression whose names and types have been checked.

    Attributes:
        read: symbols whose values it reads, by name.
        tested: symbols that it tests with `is set`, by name.
        mark: position in the file, if any.
        may_fail: the evaluation can fail although its names have values.
        reads_robot: it reads a value of the robot, `error` or `attempt`.
    """

    source: str
    term: Term
    type: ValueType
    read: dict[str, Symbol]
    tested: dict[str, Symbol]
    mark: Mark | None = None
    may_fail: bool = False
    reads_robot: bool = False

    @property
    def is_constant(self) -> bool:
        """Whether its value is known before the mission runs."""
        symbols = (*self.read.values(), *self.tested.values())
        return not self.reads_robot and all(
            symbol.is_constant and symbol.value is not UNSET for symbol in symbols
        )

    def constant(self) -> Any:
        """Return the value of a constant expression.

        Raises:
            EvaluationError: it has none.
        """
        return self.bind(_Constants())()

    def bind(self, bindings: Bindings) -> BoundExpression:
        """Bind the expression to the values of a running tree."""
        names = Names({**self.tested, **self.read}, bindings)
        shows = tuple(
            (end, term.bind(names)) for end, term in sorted(self.term.named(), key=itemgetter(0))
        )
        return BoundExpression(self.source, self.term.bind(names), shows)


class BoundExpression:
    """A `stack.types.Expression` with bound names."""

    __slots__ = ("_evaluate", "_shows", "source")

    def __init__(
        self, source: str, evaluate: Evaluate, shows: tuple[tuple[int, Evaluate], ...]
    ) -> None:
        self.source, self._evaluate, self._shows = source, evaluate, shows

    def __call__(self) -> Any:
        """Evaluate the expression.

        Raises:
            EvaluationError: a key has no value yet, a division by zero, an overflow.
        """
        try:
            return self._evaluate()
        except NotSet:
            raise
        except EvaluationError as error:
            sentence = f"{error.sentence} in {self.explain()}"
            raise EvaluationError(error.code, sentence) from None

    def explain(self) -> str:
        """Return the source with the values of its names: `battery.charge (0.18) > 0.3`."""
        parts, done = [], 0
        for end, read in self._shows:
            now = _now(read)
            parts += [self.source[done:end], f" ({now})" if now else ""]
            done = end
        return "".join([*parts, self.source[done:]])


class _Constants:
    """The bindings of a constant expression: places and arguments."""

    @property
    def context(self) -> EvaluationContext:
        raise AssertionError("a constant expression reads no robot")

    def reader(self, symbol: Symbol) -> Evaluate:
        return lambda: symbol.value

    def attempt(self) -> int:
        raise AssertionError("a constant expression reads no attempt")

    def error(self) -> str:
        raise AssertionError("a constant expression reads no attempt")


def check_expression(
    source: str, context: NameContext, wanted: ValueType = BOOL
) -> tuple[CheckedExpression | None, list[ExpressionError]]:
    """Parse and check an expression. Returns None and the problems if it is invalid."""
    try:
        term = parse(source)
    except ExpressionError as error:
        return None, [error]
    check = Check(context.scope, context.knows_error, context.knows_attempt)
    found = term.check(check)
    if not check.problems and not wanted.accepts(found) and wanted is not ANYTHING:
        hint = "`/` always gives a number: use a key of the type float" if wanted == INT else ""
        hint = hint if found.of is float and "/" in source else ""
        if wanted == BOOL and found.is_number:
            hint = f"compare it: {source} > …"
        check.problem("E153", 0, f"expected {wanted}, got {found}", hint)
    if check.problems:
        return None, check.problems
    expression = CheckedExpression(
        source, term, found, check.read, check.tested, None, check.may_fail, check.reads_robot
    )
    return expression, []


def _now(read: Evaluate) -> str:
    try:
        text = shown(read(), SHOWN // 4)
    except NotSet:
        return "not set"
    except EvaluationError:
        return ""  # the sentence of the failure says why
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 1]}…"
