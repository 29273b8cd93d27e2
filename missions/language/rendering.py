"""Findings as people see them: the sentence, then the line with a caret under the place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from stack.documents import Finding


def render(findings: Iterable[Finding], sources: Mapping[str, str]) -> str:
    """The findings with the lines they are about.

    Args:
        findings: in the order in which they are to be shown.
        sources: text by file as the marks name it; a file that is missing shows no line.
    """
    return "\n".join(render_each(findings, sources))


def render_each(findings: Iterable[Finding], sources: Mapping[str, str]) -> list[str]:
    """As `render`, one text a finding."""
    lines = {file: source.splitlines() for file, source in sources.items()}
    return [_one(finding, lines.get(finding.mark.file, [])) for finding in findings]


def _one(finding: Finding, lines: Sequence[str]) -> str:
    if not 1 <= finding.mark.line <= len(lines):
        return str(finding)
    line = lines[finding.mark.line - 1]
    column = min(finding.mark.column, len(line) + 1)
    # Tabs are kept in front of the caret, so that it stands right however wide they are drawn.
    gap = "".join("\t" if character == "\t" else " " for character in line[: column - 1])
    number = f"{finding.mark.line:>5}"
    return f"{finding}\n{number} | {line}\n{' ' * len(number)} | {gap}^"
