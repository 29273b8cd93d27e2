"""Lexer of expressions: `battery.charge < 20 % and not $done`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from stack.errors import Hint
from stack.parameters import units

MAX_LENGTH = 500


class ExpressionError(Exception):
    """An error at an offset of an expression; the reader turns it into a finding."""

    def __init__(self, at: int, sentence: str, hint: str = "", code: str = "E150") -> None:
        self.at, self.sentence, self.hint, self.code = at, sentence, hint, code
        super().__init__(sentence)


@dataclass(frozen=True, slots=True)
class Token:
    """A token.

    Attributes:
        kind: number | text | name | reference | operator | end.
        text: as written; a text without its quotes, a reference without `$`.
        at: offset in the source.
        end: offset after the token.
        unit: unit of a number, or "".
    """

    kind: str
    text: str
    at: int
    end: int
    unit: str = ""


_WORDS = [unit for unit in sorted(units(), key=len, reverse=True) if unit != "%"]
# After a number `%` is per cent, except before an operand: `7 % 2` is a remainder.
_UNIT = (
    rf"(?:{'|'.join(map(re.escape, _WORDS))})(?![\w²^])"
    r"|%(?![\w²^])(?!\s*(?:[\d$('\"]|\.\d|(?!(?:and|or|is)\b)[A-Za-z_]))"
)
_PATTERN = re.compile(
    rf"""\s*(?:
      (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s*(?P<unit>{_UNIT}))?
    | (?P<text>'[^']*'|"[^"]*")
    | \$(?P<reference>[A-Za-z_]\w*)
    | (?P<name>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)
    | (?P<operator>==|!=|<=|>=|[-+*/%<>().,[\]])
    )""",
    re.VERBOSE,
)
_HINTS = {
    "=": Hint("compare with ==", "=="), "&": Hint("write `and`", "and"),
    "|": Hint("write `or`", "or"), "!": Hint("write `not`", "not "),
    "$": "write a name directly after the $", "'": "the closing quote is missing",
    '"': "the closing quote is missing",
}  # fmt: skip


def balance(source: str) -> int:
    """Return how many brackets a text opens but does not close."""
    return sum(source.count(one) for one in "([") - sum(source.count(one) for one in ")]")


def tokens(source: str) -> list[Token]:
    """Split an expression into tokens; the last one is an `end` token.

    Raises:
        ExpressionError: an unexpected character, or an expression that is too long.
    """
    if len(source) > MAX_LENGTH:
        raise ExpressionError(
            0, f"the expression has {len(source)} characters; at most {MAX_LENGTH}"
        )
    found: list[Token] = []
    position, end = 0, len(source.rstrip())
    while position < end:
        match = _PATTERN.match(source, position)
        if match is None:
            at = position + len(source[position:]) - len(source[position:].lstrip())
            character = source[at]
            raise ExpressionError(
                at, f"unexpected character {character!r}", _HINTS.get(character, "")
            )
        found.append(_token(match))
        position = match.end()
    found.append(Token("end", "", end, end))
    return found


def _token(match: re.Match[str]) -> Token:
    kind = next(kind for kind in ("number", "text", "reference", "name", "operator") if match[kind])
    at = match.start(kind) - (kind == "reference")
    text = match[kind][1:-1] if kind == "text" else match[kind]
    return Token(kind, text, at, match.end(), match["unit"] or "")
