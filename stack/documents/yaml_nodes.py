"""Strict parser of YAML texts to nodes with positions.

libyaml (through PyYAML) splits the text into events; without libyaml, PyYAML's own parser does.
PyYAML's parser also provides the error messages. Only YAML 1.2 core scalars are recognised: `on`,
`yes` and `1:30` are texts, `012` is the number 12. Duplicate keys and tags are errors. The number
of nodes is limited, so that aliases cannot expand without bound.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, isinf
from typing import Any, ClassVar

import yaml

from stack.documents.findings import Finding, Findings, Mark
from stack.documents.yaml_problems import Problem, explain
from stack.errors import InputError
from stack.types.printable import printable

MAX_NODES, MAX_DEPTH, MAX_DIGITS = 200_000, 60, 24
EXACT = 2**53
"""Every whole number up to this one has an exact floating-point value."""
_LIMITS = "whole numbers have 64 bits; numbers with a decimal point are exact up to 2^53"

LONGEST_EXPLAINED = 200_000
"""Characters before an error up to which the text is parsed again for a better explanation."""


@dataclass(frozen=True, slots=True)
class Node:
    """A YAML value with its position.

    Attributes:
        value: None, bool, int, float or str of a scalar; list[Node] of a sequence; for a mapping a
            list of (key Node, value Node) with unique keys.
        kind: "scalar", "sequence" or "mapping".
        mark: position of its start.
        quoted: a scalar in quotes or a block scalar, which is always text.
        folded: a scalar of several lines in the file.
    """

    value: Any
    kind: str
    mark: Mark
    quoted: bool = False
    folded: bool = False

    @property
    def is_mapping(self) -> bool:
        """Whether this is a mapping."""
        return self.kind == "mapping"

    @property
    def is_sequence(self) -> bool:
        """Whether this is a sequence."""
        return self.kind == "sequence"

    @property
    def entries(self) -> list[tuple[Node, Node]]:
        """Key and value nodes of a mapping, in order; empty for anything else."""
        return list(self.value) if self.kind == "mapping" else []

    @property
    def items(self) -> list[Node]:
        """Items of a sequence; empty for anything else."""
        return list(self.value) if self.kind == "sequence" else []

    def get(self, key: str) -> Node | None:
        """The value under a key of a mapping."""
        return next((value for name, value in self.entries if name.value == key), None)

    def key(self, word: str) -> Node | None:
        """A key of a mapping itself, with its position."""
        return next((name for name, _ in self.entries if name.value == word), None)

    def plain(self) -> Any:
        """The value without positions: dict, list, str, int, float, bool or None."""
        if self.kind == "mapping":
            return {key.value: value.plain() for key, value in self.value}
        if self.kind == "sequence":
            return [item.plain() for item in self.value]
        return self.value

    def words(self) -> str:
        """Description for messages: `a list`, `a mapping`, `'text'`, `3`…"""
        if self.kind != "scalar":
            return {"mapping": "a mapping", "sequence": "a list"}[self.kind]
        if self.value is None:
            return "nothing"
        if isinstance(self.value, bool):
            return "true" if self.value else "false"
        text = repr(self.value)
        return text if len(text) <= 60 else text[:57] + "...'"


def compose(
    text: str, name: str, findings: Findings, composer: type[Composer] | None = None
) -> list[Node]:
    """Parse the documents in a YAML text; `name` is the file name in positions.

    Args:
        text: of the file.
        name: of the file, for positions.
        findings: receives the findings.
        composer: the dialect; default: missions, worlds and the other files of treepilot.

    Raises:
        InputError: the text is not YAML, nested too deeply or too large. Other errors are added
            to `findings`.
    """
    try:
        events: Iterator[Any] = yaml.parse(text, Loader=_Parser)
        return (composer or Composer)(name, findings, events).documents()
    except yaml.YAMLError as error:
        raise InputError([_refusal(text, name, error)]) from None
    except (RecursionError, ValueError) as error:
        sentence = f"not YAML: {type(error).__name__} {error}".splitlines()[0]
        raise InputError([Finding(Mark(name), "E004", sentence)]) from None


class _Unsupported(yaml.MarkedYAMLError):
    """Valid YAML that is not accepted."""


def _too_deep(event: Any) -> _Unsupported:
    sentence = f"nested more than {MAX_DEPTH} deep"
    return _Unsupported(problem=sentence, problem_mark=event.start_mark)


_Parser: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


def _refusal(text: str, name: str, error: yaml.YAMLError) -> Finding:
    """The finding for a syntax error, from PyYAML's own parser: it tells more than libyaml."""
    if isinstance(error, yaml.MarkedYAMLError) and _is_far(error):
        problem = explain(error, text)
        return Finding(
            Mark(name, problem.line, problem.column), "E004", problem.sentence, problem.hint
        )
    try:
        # libyaml stopped at the same place, or reads ahead and reached its own limit of the depth.
        # PyYAML's scanner takes quadratic time in the depth.
        depth = -1
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if isinstance(error, _Unsupported):
                break
            if depth > MAX_DEPTH:
                error = _too_deep(event)
                break
    except yaml.YAMLError as own:
        error = own
    if isinstance(error, yaml.reader.ReaderError):
        before = text[: error.position]
        mark = Mark(name, before.count("\n") + 1, error.position - before.rfind("\n"))
        sentence = f"not a text file: character U+{ord(str(text[error.position])):04X}"
        return Finding(mark, "E003", sentence)
    if isinstance(error, yaml.MarkedYAMLError):
        problem = explain(error, text)
    else:
        problem = Problem(1, 1, f"not YAML: {error}".splitlines()[0])
    mark = Mark(name, problem.line, problem.column)
    return Finding(mark, "E004", problem.sentence, problem.hint)


def _is_far(error: yaml.MarkedYAMLError) -> bool:
    return error.problem_mark is not None and error.problem_mark.index > LONGEST_EXPLAINED


_INT = re.compile(r"[-+]?[0-9]+")
_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_WHOLE = re.compile(r"[-+]?[0-9]{1,20}(\.0*)?")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
CORE_WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
}  # fmt: skip
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


class Composer:
    """Composes nodes from events; counts them to limit the expansion of aliases."""

    words: ClassVar[Mapping[str, Any]] = CORE_WORDS

    def __init__(self, name: str, findings: Findings, events: Iterator[Any]) -> None:
        self.name, self.findings, self.events = name, findings, events
        self.count = 0
        self.anchors: dict[str, tuple[Node, int, int] | None] = {}

    def documents(self) -> list[Node]:
        """Return the documents; the mark of a later one is that of its `---`."""
        found: list[Node] = []
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                self.anchors.clear()
                node = self._node(next(self.events), 0)
                found.append(replace(node, mark=self._mark(event)) if found else node)
        return found

    def _node(self, event: Any, depth: int) -> Node:
        mark = self._mark(event)
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event, mark, depth)
        self._counted(1, mark)
        before = self.count
        if depth > MAX_DEPTH:
            raise _too_deep(event)
        if event.tag is not None:
            self.findings.add("E009", mark, f"tags are not supported, got {event.tag!r}")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        if isinstance(event, yaml.ScalarEvent):
            node = self._scalar(event, mark)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = Node(list(self._items(yaml.SequenceEndEvent, depth)), "sequence", mark)
        else:
            node = Node(self._entries(depth), "mapping", mark)
        if event.anchor is not None:
            self.anchors[event.anchor] = node, self.count - before, _height(node)
        return node

    def _alias(self, event: Any, mark: Mark, depth: int) -> Node:
        name = event.anchor
        if name not in self.anchors:
            raise _Unsupported(
                problem=f"found undefined alias {name!r}", problem_mark=event.start_mark
            )
        meant = self.anchors[name]
        if meant is None:
            raise InputError([Finding(mark, "E008", "an alias contains itself")])
        node, size, height = meant
        self._counted(size + 1, mark)
        if depth + height > MAX_DEPTH:
            sentence = f"nested more than {MAX_DEPTH} deep after expanding aliases"
            raise InputError([Finding(mark, "E008", sentence)])
        return node

    def _counted(self, number: int, mark: Mark) -> None:
        self.count += number
        if self.count > MAX_NODES:
            sentence = f"more than {MAX_NODES} values after expanding aliases"
            raise InputError([Finding(mark, "E008", sentence)])

    def _items(self, end: type, depth: int) -> Iterator[Node]:
        for event in self.events:
            if isinstance(event, end):
                return
            yield self._node(event, depth + 1)

    def _entries(self, depth: int) -> list[tuple[Node, Node]]:
        entries: list[tuple[Node, Node]] = []
        seen: dict[Any, Mark] = {}
        for key in self._items(yaml.MappingEndEvent, depth):
            value = self._node(next(self.events), depth + 1)
            if key.kind != "scalar":
                self.findings.add("E010", key.mark, f"a key must be a word, got {key.words()}")
            elif "\n" in str(key.value) or "\t" in str(key.value):
                self.findings.add("E010", key.mark, f"a key must be one line, got {key.words()}")
            elif key.value in seen:
                self._repeated((key, value), seen[key.value], entries)
            else:
                seen[key.value] = key.mark
                entries.append((key, value))
        return entries

    def _repeated(
        self, entry: tuple[Node, Node], first: Mark, entries: list[tuple[Node, Node]]
    ) -> None:
        """Deal with an entry whose key stands in the mapping already, at `first`."""
        key, _ = entry
        sentence = f"duplicate key {key.value!r}"
        hint = f"remove or rename one; the first is in line {first.line}"
        self.findings.add("E011", key.mark, sentence, hint)

    def _scalar(self, event: Any, mark: Mark) -> Node:
        if printable(event.value) != event.value:
            shown = printable(repr(event.value[:60]))
            sentence = f"the text {shown} contains control characters"
            self.findings.add("E013", mark, sentence, "remove them")
        folded = event.end_mark.line > event.start_mark.line
        if event.style in ("'", '"', "|", ">"):
            return Node(event.value, "scalar", mark, quoted=True, folded=folded)
        return Node(self._core_value(event.value, mark), "scalar", mark, folded=folded)

    def _core_value(self, text: str, mark: Mark) -> Any:
        if text in self.words:
            return self.words[text]
        if _INT.fullmatch(text):
            return self._whole(text, 10, mark)
        if _BASED.fullmatch(text):
            return self._whole(text, 0, mark)
        if _FLOAT.fullmatch(text):
            return self._in_range(float(text), text, mark)
        if _SPECIAL.fullmatch(text):
            return self._special(text, mark)
        return text

    def _special(self, text: str, mark: Mark) -> float:
        """Deal with an infinite number, or one that is not a number."""
        self.findings.add("E012", mark, f"{text} is not a finite number")
        return 0.0

    def _whole(self, text: str, base: int, mark: Mark) -> float:
        number = int(text, base) if len(text) <= MAX_DIGITS else inf
        fits = -(2**63) <= number < 2**63
        return self._in_range(number if fits else inf, text, mark)

    def _in_range(self, number: float, text: str, mark: Mark) -> float:
        if isinf(number):
            shown = text if len(text) <= 24 else f"{text[:20]}..."
            self.findings.add("E012", mark, f"the number {shown} is too large", _LIMITS)
            return 0
        if (
            abs(number) >= EXACT
            and _WHOLE.fullmatch(text)
            and number != int(text.partition(".")[0])
        ):
            sentence = f"the number {text} cannot be stored exactly"
            self.findings.add("E012", mark, sentence, _LIMITS)
        return number

    def _mark(self, event: Any) -> Mark:
        mark = event.start_mark
        return Mark(self.name, mark.line + 1, mark.column + 1)


def _height(node: Node) -> int:
    """Levels of lists and mappings below a node."""
    below = [*(value for _, value in node.entries), *node.items]
    return 0 if node.kind == "scalar" else 1 + max(map(_height, below), default=0)


def as_yaml(value: Any) -> str:
    """Write plain values as a YAML text that `read_text` can read."""
    text: str = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=100)
    return text


def iter_scalars(node: Node) -> Iterator[Node]:
    """All scalars below a node, without keys."""
    if node.kind == "scalar":
        yield node
    for _, value in node.entries:
        yield from iter_scalars(value)
    for item in node.items:
        yield from iter_scalars(item)
