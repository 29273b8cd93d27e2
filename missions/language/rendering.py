"""Findings as text: the sentence, then the source line with a caret under the position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from stack.documents import Finding


def render(findings: Iterable[Finding], sources: Mapping[str, str]) -> str:
    """Render findings with their source lines.

    Args:
        findings: in the order to show.
        sources: text by file name as in the marks; without a text the line is not shown.
    """
    return "\n".join(render_each(findings, sources))


def render_each(findings: Iterable[Finding], sources: Mapping[str, str]) -> list[str]:
    """As `render`, one text per finding."""
    lines = {file: source.splitlines() for file, source in sources.items()}
    return [_one(finding, lines.get(finding.mark.file, [])) for finding in findings]


def _one(finding: Finding, lines: Sequence[str]) -> str:
    if not 1 <= finding.mark.line <= len(lines):
        return str(finding)
    line = lines[finding.mark.line - 1]
    column = min(finding.mark.column, len(line) + 1)
    # Tabs in front of the caret keep it aligned at any tab width.
    gap = "".join("\t" if character == "\t" else " " for character in line[: column - 1])
    number = f"{finding.mark.line:>5}"
    return f"{finding}\n{number} | {line}\n{' ' * len(number)} | {gap}^"
