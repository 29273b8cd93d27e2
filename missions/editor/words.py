"""Words and positions in lines of text; everything counts from 1, as findings do."""

from __future__ import annotations

import re
from dataclasses import dataclass

_WORD = re.compile(r"\$?[A-Za-z_][\w.]*")
_UNDER_WAY = re.compile(r"\$?[\w.]*$")
_PLAIN = re.compile(r"([^\s,\[\]{}#:]|:(?=\S)|#|[ ](?![#\s]))+")
_QUOTED = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\]|\\.)*\"")


@dataclass(frozen=True)
class Word:
    """A word and the column it begins in."""

    text: str
    column: int

    @property
    def end(self) -> int:
        """The column after its last character."""
        return self.column + len(self.text)


def word_at(line: str, column: int) -> Word | None:
    """The word around a column, with its `$`; None in a comment and between words."""
    if re.search(r"(^|\s)#", line[: column - 1]):
        return None
    for found in _WORD.finditer(line):
        if found.start() < column <= found.end() + 1:
            return Word(found[0], found.start() + 1)
    return None


def under_way(line: str, column: int) -> Word:
    """What has been typed of the word before a column; may be empty."""
    found = _UNDER_WAY.search(line[: column - 1])
    text = found[0] if found else ""
    return Word(text, column - len(text))


def end_of_value(line: str, column: int) -> int:
    """The column after the key or value that begins at one; at least one character."""
    text = line[column - 1 :]
    found = _QUOTED.match(text) or _PLAIN.match(text)
    length = len(found[0].rstrip()) if found else 0
    return column + max(1, length)
