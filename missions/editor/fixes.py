"""Quick fixes: the word that a finding suggests, in place of the one that it reports."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from missions.editor.text_positions import end_of_value
from stack.documents import Finding

_NAME = re.compile(r"\$?\{?[A-Za-z_][\w.]*\}?")


@dataclass(frozen=True)
class Fix:
    """A replacement of columns [first, end) of a line; columns count from 1."""

    title: str
    line: int
    first: int
    end: int
    text: str


def fix_of(finding: Finding, lines: Sequence[str]) -> Fix | None:
    """Return the edit for the fix of a finding; None if it has none."""
    text = finding.fix
    line, column = finding.mark.line, finding.mark.column
    if not text or not 1 <= line <= len(lines):
        return None
    row = lines[line - 1].rstrip("\r\n")
    if row[column - 1 : column] in ("'", '"') and not text.startswith("$"):
        column += 1
    name = _NAME.match(row, column - 1)
    if name is None:
        return None
    end = name.end() + 1 if _is_name(text) else end_of_value(row, column)
    old = row[column - 1 : end - 1]
    if old.startswith("${"):  # the suggestion names the key alone
        text = f"${{{text.lstrip('$')}}}"
    return Fix(f"Replace {old!r} by {text!r}", line, column, end, text)


def _is_name(text: str) -> bool:
    return re.fullmatch(r"\$?[\w.]+", text) is not None
