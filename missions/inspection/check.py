"""`treepilot check` and `treepilot show`: the findings and the tree of a mission."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib.metadata import packages_distributions
from pathlib import Path

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import find_mission
from missions.inspection.diagnosis import findings_of, text_of
from missions.inspection.drafting.fixes import fix_of
from missions.trees import show
from missions.trees.compiler import compile_mission
from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.types.printable import printable

SHOWN = 200
"""Characters of a line of a file."""

OUR_PACKAGES = ("treepilot", "missions", "behaviours", "stack", "tui", "robots")


@dataclass(frozen=True)
class CheckLine:
    """One finding, with its text as printed."""

    text: str
    is_error: bool
    finding: Finding | None = None


def check_files(names: list[str], arguments: Mapping[str, str] | None = None) -> list[CheckLine]:
    """Return the errors and warnings of mission and world files.

    Args:
        names: files, or names of shipped missions.
        arguments: values of the missions' arguments, as text.
    """
    with redirect_stdout(sys.stderr):  # plugins may print
        return [line for name in names for line in _check(name, dict(arguments or {}))]


def _check(name: str, arguments: dict[str, str]) -> list[CheckLine]:
    try:
        path = find_mission(name)
        return _lines(findings_of(path, arguments=arguments))
    except InputError as error:
        return lines_of(name, error)


def lines_of(name: str, error: InputError) -> list[CheckLine]:
    """Return the lines of an error of a file."""
    return _lines(error.findings) if error.findings else [CheckLine(f"{name}: {error}", True)]


_OURS = re.compile(
    r"^(mission|run|trees|places|robot|world|image|navigation)\s*:|ros__parameters"
    r"|<sdf\b|<robot\b|\"FeatureCollection\"",
    re.MULTILINE,
)
"""Finds what files of treepilot contain; lines of other files are not shown."""


def _lines(findings: Iterable[Finding]) -> list[CheckLine]:
    found = list(findings)
    sources = {file: text_of(Path(file)) for file in {item.mark.file for item in found}}
    lines = {file: text.splitlines() for file, text in sources.items() if _OURS.search(text)}
    return [
        CheckLine(
            with_source_line(item, lines.get(item.mark.file, ())), item.severity == "error", item
        )
        for item in found
    ]


def with_source_line(finding: Finding, lines: Sequence[str]) -> str:
    """Return a finding as text, with its line of the file and a caret under the position."""
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


def as_json(lines: Iterable[CheckLine]) -> str:
    """Return findings as a JSON list, for editors and for programs that write missions.

    Each has `file`, `line`, `column`, `code`, `severity`, `sentence` and `hint`; `fix` is the text
    that replaces `word` there, both empty where none is known.
    """
    plain = [_plain(line) for line in lines]
    text = json.dumps(plain, indent=2, ensure_ascii=False)
    return text if printable(text) == text else json.dumps(plain, indent=2)


def _plain(line: CheckLine) -> dict[str, str | int]:
    severity = "error" if line.is_error else "warning"
    item = line.finding
    if item is None:
        mark, code, sentence, hint = Mark(""), "E001", line.text, ""
    else:
        mark, code, sentence, hint = item.mark, item.code, item.sentence, item.hint
    fix = None if item is None else fix_of(item, text_of(Path(mark.file)).splitlines())
    return {
        "file": mark.file, "line": mark.line, "column": mark.column, "code": code,
        "severity": severity, "sentence": sentence, "hint": hint,
        "word": "" if fix is None else fix.word, "fix": "" if fix is None else fix.text,
    }  # fmt: skip


def check_install() -> list[CheckLine]:
    """Report other distributions that install one of our packages: one would hide the other."""
    owners = packages_distributions()
    return [
        CheckLine(f"the package {package!r} is also installed by {other}; uninstall {other}", True)
        for package in OUR_PACKAGES
        for other in sorted(set(owners.get(package, ())) - {"treepilot"})
    ]


def drawing(
    name: str, style: str, *, colours: bool, arguments: Mapping[str, str] | None = None
) -> str:
    """Return the compiled tree of a mission as text, Graphviz or Mermaid.

    Raises:
        InputError: the mission has errors.
    """
    options = RunOptions(arguments=dict(arguments or {}))
    draw = {"text": show.text, "dot": show.dot, "mermaid": show.mermaid}[style]
    return draw(compile_mission(prepare(name, options).mission), colour=colours)
