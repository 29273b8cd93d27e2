"""Findings as text: the sentence, then the source line with a caret under the position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from stack.documents import Finding
from stack.types.printable import printable

SHOWN = 200
"""Characters of a source line."""


def render_each(findings: Iterable[Finding], sources: Mapping[str, str]) -> list[str]:
    """Render findings with their source lines, one text per finding.

    Args:
        findings: in the order to show.
        sources: text by file name as in the marks; without a text the line is not shown.
    """
    lines = {file: source.splitlines() for file, source in sources.items()}
    return [_one(finding, lines.get(finding.mark.file, [])) for finding in findings]


def _one(finding: Finding, lines: Sequence[str]) -> str:
    if not 1 <= finding.mark.line <= len(lines):
        return str(finding)
    line = lines[finding.mark.line - 1]
    column = min(finding.mark.column, len(line) + 1)
    first = column - 1 - SHOWN // 2 if len(line) > SHOWN else 0  # of the shown characters
    before = printable(line[max(0, first) : column - 1])
    line = before + printable(line[column - 1 : max(0, first) + SHOWN])
    # Tabs in front of the caret keep it aligned at any tab width.
    gap = "".join("\t" if character == "\t" else " " for character in before)
    number = f"{finding.mark.line:>5}"
    return f"{finding}\n{number} | {line}\n{' ' * len(number)} | {gap}^"
