"""Words and positions in lines of text; columns count from 1, as in findings."""

from __future__ import annotations

import re
from dataclasses import dataclass

_WORD = re.compile(r"\$?[A-Za-z_][\w.]*")
_TYPED = re.compile(r"\$?[\w.]*$")


@dataclass(frozen=True)
class TextWord:
    """A word of a line and its first column."""

    text: str
    column: int

    @property
    def end(self) -> int:
        """Column after its last character."""
        return self.column + len(self.text)


def word_at(line: str, column: int) -> TextWord | None:
    """Return the word at a column, with its `$`; None in a comment or between words."""
    if re.search(r"(^|\s)#", line[: column - 1]):
        return None
    for found in _WORD.finditer(line):
        if found.start() < column <= found.end() + 1:
            return TextWord(found[0], found.start() + 1)
    return None


def typed_word(line: str, column: int) -> TextWord:
    """Return the part of a word before a column; may be empty."""
    found = _TYPED.search(line[: column - 1])
    text = found[0] if found else ""
    return TextWord(text, column - len(text))


def in_placeholder(before: str) -> bool:
    """Return whether a text ends inside a `${…}` that is not closed; `$${` opens none."""
    opened = before.rfind("${")
    return opened > before.rfind("}") and before[max(0, opened - 1) : opened] != "$"
