"""Translates PyYAML's syntax errors to plain sentences with a suggested fix."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from yaml import MarkedYAMLError

PROSE = 4
"""Words of a line without a colon from which on it is taken for a sentence."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A syntax error: position (line and column count from 1), sentence and hint."""

    line: int
    column: int
    sentence: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class _Case:
    """One error of PyYAML with the lines of the text.

    Attributes:
        found: match of the table's pattern in PyYAML's message.
        context: PyYAML's description of what it was reading.
        here: (line, column) at which PyYAML stopped, from 0.
        opened: (line, column) at which the unfinished construct begins; `here` if unknown.
        lines: of the text.
    """

    found: re.Match[str]
    context: str
    here: tuple[int, int]
    opened: tuple[int, int]
    lines: list[str]

    def at(self, place: tuple[int, int], sentence: str, hint: str = "") -> Problem:
        return Problem(place[0] + 1, place[1] + 1, sentence, hint)

    def above(self, line: int) -> int | None:
        """The nearest line above that is neither empty nor a comment."""
        for number in range(min(line, len(self.lines)) - 1, -1, -1):
            if self.lines[number].strip() and not self.lines[number].lstrip().startswith("#"):
                return number
        return None

    def indents(self) -> list[int]:
        """Indentations of the blocks that are open above this line, innermost first."""
        found: list[int] = []
        line = self.above(self.here[0])
        while line is not None and 0 not in found:
            indent = _indent(self.lines[line])
            if not found or indent < found[-1]:
                found.append(indent)
            line = self.above(line)
        return found

    @property
    def before(self) -> str:
        """The part of the line before the position at which PyYAML stopped."""
        line, column = self.here
        return self.lines[line][:column] if line < len(self.lines) else ""


def explain(error: MarkedYAMLError, text: str) -> Problem:
    """Explain an error without the terms of the YAML specification."""
    here = _place(error.problem_mark or error.context_mark)
    opened = _place(error.context_mark) if error.context_mark else here
    problem, context = error.problem or "", error.context or ""
    fence = _fence(text.split("\n"), here[0])
    if fence is not None:
        hint = "keep only the lines between the fences"
        return Problem(fence + 1, 1, "a Markdown fence is not YAML", hint)
    for context_pattern, pattern, make_problem in _TABLE:
        found = re.search(pattern, problem, re.DOTALL)
        if found and re.search(context_pattern, context):
            return make_problem(_Case(found, context, here, opened, text.split("\n")))
    return Problem(here[0] + 1, here[1] + 1, f"not YAML: {problem}".replace("\n", " "))


def _place(mark: Any) -> tuple[int, int]:
    return (mark.line, mark.column) if mark else (0, 0)


def _first(case: _Case) -> Problem:
    character = _unquoted(case.found[1])
    if character == "\t":
        return case.at(case.here, "a tab is not allowed here", "indent with spaces")
    hint = f"put it in quotes: '{character}…'"
    return case.at(case.here, f"a value cannot begin with {character}", hint)


def _fence(lines: list[str], near: int) -> int | None:
    """The first line of a Markdown fence at a position or above it."""
    for number, line in enumerate(lines[: near + 1]):
        if line.lstrip().startswith(("```", "~~~")):
            return number
    return None


def _no_colon(case: _Case) -> Problem:
    line = case.lines[case.opened[0]].strip()
    if line.startswith("//"):
        return case.at(case.opened, "this line is not `key: value`", "a comment begins with #")
    if len(line.split()) >= PROSE and not line.endswith(":"):
        sentence = "this line is a sentence, not `key: value`"
        return case.at(case.opened, sentence, "remove the line, or begin it with # as a comment")
    hint = "is a `:` missing? To continue the text above, indent this line deeper than its key"
    return case.at(case.opened, "this line is not `key: value`", hint)


def _second_colon(case: _Case) -> Problem:
    if re.search(r":\s", case.before.rstrip() + " "):
        hint = "put the value in quotes, or the second key on its own line"
        return case.at(case.here, "a second `: ` in one value", hint)
    line, column = case.here[0], _indent(case.before)
    above = case.above(line)
    if above is not None and _indent(case.lines[above]) >= column:
        place = (above, _indent(case.lines[above]))
        hint = "is a `:` missing? A space must follow it"
        if case.lines[above].lstrip().startswith("//"):
            hint = "a comment begins with #"
        return case.at(place, "this line is not `key: value`", hint)
    bare = re.fullmatch(r"(\s*(?:- +)?)(\w+)\s*", "" if above is None else case.lines[above])
    if above is not None and bare and len(bare[1]) < column:
        place, word = (above, len(bare[1])), bare[2]
        return case.at(place, f"a `:` is missing after {word!r}", f"write `{word}:`")
    place = (line, column)
    sentence = "this line is indented deeper than the line above, which already has a value"
    return case.at(place, sentence, "begin both lines in the same column")


def _item(case: _Case) -> Problem:
    hint = "put it on its own line, below the key of the list"
    return case.at(case.here, "a list item `- ` is not allowed here", hint)


def _question(case: _Case) -> Problem:
    return case.at(case.here, "a value cannot begin with `? `", "put it in quotes")


def _block(case: _Case) -> Problem:
    """Something that is neither the next key, the next item nor the end of a block."""
    found, among_keys = case.found[1], "mapping" in case.context
    if found in ("}", "]"):
        hint = "remove it, or add the opening bracket"
        return case.at(case.here, f"unmatched `{found}`", hint)
    if found == ",":
        return case.at(case.here, "a comma is not allowed here", "put the value in quotes")
    if found == "-" and among_keys:
        hint = "indent it below the key of its list"
        return case.at(case.here, "unexpected list item `- ` among keys", hint)
    if found in ("?", "<block mapping start>") and not among_keys and case.before.strip() == "":
        hint = f"begin it with `- `, or indent it deeper than column {case.opened[1] + 1}"
        return case.at(case.here, "unexpected key among list items", hint)
    if case.before.strip() == "":
        columns = " or ".join(str(indent + 1) for indent in case.indents())
        sentence = "the indentation of this line matches no line above"
        hint = f"the open blocks begin in column {columns}" if columns else ""
        return case.at(case.here, sentence, hint)
    sentence = "unexpected text after the value"
    return case.at(case.here, sentence, "put the whole value in quotes")


def _bracket(case: _Case) -> Problem:
    close = case.found[1]
    what, sign = {"]": ("list", "["), "}": ("mapping", "{")}[close]
    if case.here[0] == case.opened[0] and case.found[2] not in ("<stream end>", "<document start>"):
        sentence = f"a `,` or the closing `{close}` is missing here"
        hint = "inside brackets, put texts with `: ` or brackets in quotes"
        return case.at(case.here, sentence, hint)
    sentence = f"the {what} that opens here with `{sign}` is not closed"
    hint = f"add `{close}`"
    if " #" in case.lines[case.opened[0]][case.opened[1] :]:
        hint = f"` #` begins a comment: put a text with it in quotes, or add `{close}` before it"
        return case.at(case.opened, sentence, hint)
    if case.found[2] != "<stream end>":
        hint += f", or a `,` before line {case.here[0] + 1}"
    return case.at(case.opened, sentence, hint)


def _quote(case: _Case) -> Problem:
    line, column = case.opened
    sign = case.lines[line][column : column + 1] if line < len(case.lines) else "'"
    hint = f"close it with {sign}; inside '…' an apostrophe is written ''"
    return case.at(case.opened, f"the quote {sign} that opens here is not closed", hint)


def _escape(case: _Case) -> Problem:
    sign = _unquoted(case.found[1])
    hint = f"write \\\\{sign} for a backslash, or use single quotes"
    return case.at(case.here, f"\\{sign} is not a valid escape in double quotes", hint)


def _digits(case: _Case) -> Problem:
    sentence = f"this escape needs {case.found[1]} hexadecimal digits"
    return case.at(case.here, sentence, "use single quotes for a literal backslash")


def _after_the_end(case: _Case) -> Problem:
    if case.found[1] in ("}", "]"):
        return case.at(case.here, f"unmatched `{case.found[1]}`", "remove it")
    hint = "begin all top-level keys in the same column"
    return case.at(case.here, "unexpected text after the end of the document", hint)


def _percent(case: _Case) -> Problem:
    place = (case.opened[0], 0)
    return case.at(place, "a line cannot begin with %", "put the value in quotes")


def _star(case: _Case) -> Problem:
    sign = "*" if "alias" in case.context else "&"
    hint = f"put a value that begins with {sign} in quotes"
    return case.at(case.opened, f"a name is missing after {sign}", hint)


def _tag(case: _Case) -> Problem:
    hint = "write `not` for a negation, or put it in quotes"
    return case.at(case.opened, "a value cannot begin with !", hint)


def _block_text(case: _Case) -> Problem:
    sentence = "the text after `|` or `>` must begin on the next line"
    return case.at(case.here, sentence, "insert a line break")


def _no_value(case: _Case) -> Problem:
    found = case.found[1]
    opened = _last_open("\n".join(case.lines)) if found == "<stream end>" else None
    if opened is not None:
        return case.at(opened[0], f"the `{opened[1]}` that opens here is not closed", "close it")
    before = f" before `{found}`" if len(found) == 1 else ""
    return case.at(case.here, f"a value is missing{before}", "write it, or `null` for none")


def _stray_colon(case: _Case) -> Problem:
    hint = "put a space after it, or put the text in quotes"
    return case.at(case.here, "unexpected `:` inside a value", hint)


def _deep(case: _Case) -> Problem:
    return case.at(case.here, case.found[0], "is a bracket or an indentation wrong?")


def _alias(case: _Case) -> Problem:
    hint = "write `&` and the name before a value above, or quote a text that begins with *"
    return case.at(case.here, "there is no value with the name of this alias", hint)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


_QUOTED = re.compile(r"'[^']*'|\"(?:\\\\.|[^\"\\\\])*\"|(?:^|(?<=\s))#[^\n]*", re.MULTILINE)


def _last_open(text: str) -> tuple[tuple[int, int], str] | None:
    """Position and sign of the innermost bracket that is not closed."""
    blanked = _QUOTED.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    stack: list[tuple[tuple[int, int], str]] = []
    for number, line in enumerate(blanked.split("\n")):
        for column, sign in enumerate(line):
            if sign in "[{":
                stack.append(((number, column), sign))
            elif sign in "]}" and stack:
                stack.pop()
    return stack[-1] if stack else None


def _unquoted(shown: str) -> str:
    """The character of which PyYAML shows Python's repr."""
    inner = shown[1:-1]
    return {"\\t": "\t", "\\\\": "\\", "\\'": "'"}.get(inner, inner)


_FOUND = r"'(.+)'"
_TABLE: tuple[tuple[str, str, Callable[[_Case], Problem]], ...] = (
    ("directive", "", _percent),
    ("", r"duplicate YAML directive|incompatible YAML document|duplicate tag handle", _percent),
    ("an alias|an anchor", "expected alphabetic", _star),
    ("a tag", "", _tag),
    ("", "undefined tag handle", _tag),
    ("block scalar", "", _block_text),
    ("", r"found character (.+) that cannot start any token", _first),
    ("simple key", "could not find expected ':'", _no_colon),
    ("", "mapping values are not allowed", _second_colon),
    ("", "sequence entries are not allowed", _item),
    ("", "mapping keys are not allowed", _question),
    ("", rf"expected <block end>, but found {_FOUND}", _block),
    ("", rf"expected ',' or '(.)', but got {_FOUND}", _bracket),
    ("quoted scalar", "found unexpected (end of stream|document separator)", _quote),
    ("", r"found unknown escape character (.+)", _escape),
    ("", r"expected escape sequence of (\d) hexadecimal", _digits),
    ("", rf"expected '<document start>', but found {_FOUND}", _after_the_end),
    ("", rf"expected the node content, but found {_FOUND}", _no_value),
    ("", "found unexpected ':'", _stray_colon),  # libyaml's only
    ("", r"nested more than \d+ deep", _deep),
    ("", rf"found undefined alias {_FOUND}", _alias),
)
"""(pattern of the context, pattern of the problem, explanation); the first match is used."""
