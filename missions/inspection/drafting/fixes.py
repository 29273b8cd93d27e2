"""Fixes: the text that a finding suggests, in place of the one that it reports."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from stack.documents import Finding

_NAME = re.compile(r"\$\{[A-Za-z_][\w.]*\}|\$?[A-Za-z_][\w.]*")
_OPERATOR = re.compile(r"[=&|!<>%]+")
_PLAIN = re.compile(r"([^\s,\[\]{}#:]|:(?=\S)|#|[ ](?![#\s]))+")
_QUOTED = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\]|\\.)*\"")
_BRACKETS = {"[": "]", "{": "}"}


@dataclass(frozen=True)
class Fix:
    """A replacement of `word`, columns [first, end) of a line; columns count from 1."""

    line: int
    first: int
    end: int
    word: str
    text: str

    @property
    def title(self) -> str:
        """What it does, for people."""
        return f"Replace {self.word!r} by {self.text!r}"


def fix_of(finding: Finding, lines: Sequence[str]) -> Fix | None:
    """Return the edit for the fix of a finding; None if it has none."""
    text = finding.fix
    line, column = finding.mark.line, finding.mark.column
    if not text or not 1 <= line <= len(lines):
        return None
    row = lines[line - 1].rstrip("\r\n")
    end = _end(row, column, text)
    old = row[column - 1 : end - 1]
    if not old:
        return None
    if old.startswith("${"):  # the suggestion names the key alone
        text = f"${{{text.lstrip('$')}}}"
    return Fix(line, column, end, old, text)


def end_of_value(line: str, column: int) -> int:
    """Return the column after the key or value that begins at a column, at least one further.

    A list or mapping ends with its bracket, if that is in the line.
    """
    text = line[column - 1 :]
    if text[:1] in _BRACKETS:
        return column + max(1, _balanced(text))
    found = _QUOTED.match(text) or _PLAIN.match(text)
    length = len(found[0].rstrip()) if found else 0
    return column + max(1, length)


def _end(row: str, column: int, text: str) -> int:
    """Return the column after what a text replaces: a word, an operator, or a whole value."""
    operator, name = _OPERATOR.match(row, column - 1), _NAME.match(row, column - 1)
    if operator is not None:
        return operator.end() + 1
    if name is not None and (_is_name(text) or _OPERATOR.fullmatch(text)):
        return name.end() + 1
    return end_of_value(row, column)


def _is_name(text: str) -> bool:
    return re.fullmatch(r"\$?[\w.]+", text) is not None


def _balanced(text: str) -> int:
    """Return the length of the bracket that a text begins with; 0 if it is not closed."""
    depth, at = 0, 0
    while at < len(text):
        quoted = _QUOTED.match(text, at)
        if quoted is not None:
            at = quoted.end()
            continue
        depth += (text[at] in "[{") - (text[at] in "]}")
        at += 1
        if not depth:
            return at
    return 0
