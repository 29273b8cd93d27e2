"""The grammar of expressions: precedence climbing (Pratt 1973). Nothing is evaluated here.

Operators from weak to strong:

or < and < not < == != < <= > >= < is set < + - < * / % < unary minus < .field [index]
"""

from __future__ import annotations

from typing import Any

from missions.language.expressions.arithmetic import GREATEST_INT
from missions.language.expressions.compound_terms import Call, Index, ListTerm
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import DISTANCE, ROBOT_VALUES
from missions.language.expressions.terms import (
    Binary,
    Distance,
    Field,
    IsSet,
    Literal,
    Named,
    Reference,
    Term,
    Unary,
)
from missions.language.expressions.tokens import ExpressionError, Token, tokens
from missions.language.expressions.value_types import BOOL, INT, SHARE, TEXT, ValueType
from stack.errors import Hint, ParameterError
from stack.parameters import read_quantity, suggestion, unit_elsewhere, units

MAX_DEPTH = 40
_POWER = {
    "or": 1, "and": 2, "==": 4, "!=": 4, "<": 4, "<=": 4, ">": 4, ">=": 4, "is": 5,
    "+": 6, "-": 6, "*": 7, "/": 7, "%": 7, ".": 9, "[": 9,
}  # fmt: skip
_NOT, _COMPARISON, _IS, _MINUS = 3, 4, 5, 8
_HINTS = {"+": "there is no ++ and no sign +: write `$n + 1`", "*": "write a product: `$n * $n`"}
_CONSTANTS = {"true": True, "false": False}


def parse(source: str) -> Term:
    """Parse an expression.

    Raises:
        ExpressionError: a syntax error, with its offset.
    """
    parser = _Parser(tokens(source))
    term = parser.expression(0)
    rest = parser.next
    if rest.kind != "end":
        hint = _hint_before(rest, parser.words[parser.position - 1])
        raise ExpressionError(rest.at, f"unexpected {rest.text!r}", hint)
    return term


def _hint_before(token: Token, last: Token) -> str:
    """Return the hint for a token behind a complete expression."""
    unit = unit_elsewhere(token.text)
    if unit and last.kind == "number":
        return Hint(f"write {last.text} {unit}", unit)
    if token.text == "in":
        return "compare with each: `$a == 'x' or $a == 'y'`"
    if token.text == "set":
        return "write `$key is set`"
    if token.kind in ("name", "reference", "number", "text"):
        return "an operator is missing before it"
    return "remove it, or open a bracket before" if token.text == ")" else ""


class _Parser:
    def __init__(self, words: list[Token]) -> None:
        self.words, self.position, self.depth = words, 0, 0

    @property
    def next(self) -> Token:
        return self.words[self.position]

    def take(self) -> Token:
        token = self.next
        self.position += token.kind != "end"
        return token

    def expect(self, text: str, hint: str = "") -> Token:
        token = self.take()
        if token.text != text or token.kind == "text":
            found = repr(token.text) if token.kind != "end" else "the end"
            raise ExpressionError(token.at, f"expected {text!r}, got {found}", hint)
        return token

    def expression(self, power: int) -> Term:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(
                self.next.at, f"the expression is nested more than {MAX_DEPTH} levels deep"
            )
        term = self.prefix()
        while self.next.kind in ("operator", "name"):
            strength = _POWER.get(self.next.text, 0)
            if strength <= power:
                break
            term = self.infix(term, strength)
            if strength == _COMPARISON and _POWER.get(self.next.text) == _COMPARISON:
                raise ExpressionError(
                    self.next.at,
                    "comparisons cannot be chained",
                    "combine two comparisons with `and`",
                )
        self.depth -= 1
        return term

    def infix(self, left: Term, strength: int) -> Term:
        token = self.take()
        if token.text == "is":
            return self.is_set(left)
        if token.text == ".":
            name = self.take()
            if name.kind != "name":
                raise ExpressionError(name.at, "expected the name of a field after the dot")
            return Field(token.at, name.end, left, name.text)
        if token.text == "[":
            index = self.expression(0)
            return Index(left.at, self.expect("]").end, left, index)
        return Binary(token.at, token.text, left, self.expression(strength))

    def is_set(self, left: Term) -> Term:
        negated = self.next.text == "not"
        if negated:
            self.take()
        end = self.expect("set", "write `is set` or `is not set`; compare values with ==")
        if not isinstance(left, Reference):
            raise ExpressionError(left.at, "`is set` needs a $name before it")
        return IsSet(left.at, end.end, left.name, not negated)

    def prefix(self) -> Term:
        token = self.take()
        if token.kind == "name":
            return self.word(token)
        if token.kind == "number":
            return Literal(token.at, *_number(token))
        if token.kind == "text":
            return Literal(token.at, token.text, TEXT)
        if token.kind == "reference":
            return Reference(token.at, token.end, token.text)
        if token.text == "-":
            return Unary(token.at, "-", self.expression(_MINUS))
        if token.text == "(":
            inner = self.expression(0)
            self.expect(")")
            return inner
        if token.text == "[":
            return ListTerm(token.at, self.sequence("]"))
        found = repr(token.text) if token.kind == "operator" else "the end"
        hint = _HINTS.get(token.text, "") if token.kind == "operator" else "write a value behind it"
        raise ExpressionError(token.at, f"expected a value, got {found}", hint)

    def word(self, token: Token) -> Term:
        if token.text == "not":
            return Unary(token.at, "not", self.expression(_NOT))
        if token.text in _CONSTANTS:
            return Literal(token.at, _CONSTANTS[token.text], BOOL)
        if token.text in _POWER:
            raise ExpressionError(token.at, f"expected a value, got {token.text!r}")
        if self.next.text == "(" and self.next.kind == "operator":
            return self.call(token)
        if token.text in FUNCTIONS and token.text not in ROBOT_VALUES:
            sentence, hint = f"{token.text} is a function", FUNCTIONS[token.text].signature
            raise ExpressionError(token.at, sentence, f"write {hint}", "E155")
        return Named(token.at, token.end, token.text)

    def call(self, token: Token) -> Term:
        if token.text != DISTANCE and token.text not in FUNCTIONS:
            raise ExpressionError(
                token.at,
                f"there is no function {token.text!r}",
                suggestion(token.text, (*FUNCTIONS, DISTANCE)),
                "E155",
            )
        self.take()
        if token.text == DISTANCE:
            target = self.expression(0)
            return Distance(token.at, self.expect(")").end, target)
        return Call(token.at, token.text, self.sequence(")"))

    def sequence(self, closing: str) -> tuple[Term, ...]:
        """Read terms separated by commas, and the closing bracket."""
        terms: list[Term] = []
        while not (self.next.kind == "operator" and self.next.text == closing):
            if terms or self.next.kind == "end":
                self.separator(closing)
            terms.append(self.expression(0))
        self.take()
        return tuple(terms)

    def separator(self, closing: str) -> None:
        """Read a comma; in a YAML mapping in braces an unquoted expression ends at its comma."""
        token = self.take()
        if token.text == "," and token.kind == "operator":
            return
        found = repr(token.text) if token.kind != "end" else "the end"
        hint = "put an expression with commas in quotes: YAML ends it at a comma inside {…} and […]"
        sentence = f"expected ',' or {closing!r}, got {found}"
        raise ExpressionError(token.at, sentence, hint if token.kind == "end" else "")


def _number(token: Token) -> tuple[Any, ValueType]:
    if not token.unit:
        if token.text.isdigit():
            return _whole_number(token), INT
        return _quantity(token, token.text, ""), ValueType(float)
    dimension = units()[token.unit][0]
    if not dimension:
        return _quantity(token, f"{token.text} {token.unit}", ""), SHARE
    return _quantity(token, f"{token.text} {token.unit}", dimension), ValueType(float, dimension)


def _whole_number(token: Token) -> int:
    # A numeral of 20 digits exceeds 64 bits; Python refuses to read one of 5000 digits.
    number = int(token.text) if len(token.text) < 20 else GREATEST_INT + 1
    if number > GREATEST_INT:
        raise ExpressionError(token.at, f"the whole number {token.text:.30} exceeds 64 bits")
    return number


def _quantity(token: Token, text: str, unit: str) -> float:
    try:
        return read_quantity(text, unit)
    except ParameterError as error:
        raise ExpressionError(token.at, error.sentence, error.hint) from None
