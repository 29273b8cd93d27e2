"""YAML files read with positions, strictly: what missions, worlds, robots and maps are written in.

PyYAML composes the nodes; values are YAML 1.2 core scalars only (`on`, `yes`, `012` and `1:30` are
text or what they look like), duplicate keys and tags are refused, aliases cannot explode. Every
finding carries file, line and column; a reader collects all of them before it raises.

Codes: E001..E019 files and YAML · E1xx missions · E2xx worlds · E3xx robots · E4xx maps and
components.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import yaml

from stack.errors import InputError, ParameterError
from stack.parameters import REQUIRED, Declaration, suggestion

MAX_BYTES, MAX_NODES, MAX_DEPTH = 1_000_000, 50_000, 60

T = TypeVar("T")


@dataclass(frozen=True, slots=True, order=True)
class Mark:
    """A position in a file; line and column count from 1."""

    file: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing wrong with a file: `file:line:column error[E012] sentence; hint`."""

    mark: Mark
    code: str
    sentence: str
    hint: str = ""
    severity: str = "error"

    def __str__(self) -> str:
        hint = f"; {self.hint}" if self.hint else ""
        return f"{self.mark} {self.severity}[{self.code}] {self.sentence}{hint}"


@dataclass
class Findings:
    """Collects everything wrong, so that one reading reports it all."""

    items: list[Finding] = field(default_factory=list)

    def error(self, code: str, mark: Mark, sentence: str, hint: str = "") -> None:
        """Note something that makes the file unusable."""
        self._add(Finding(mark, code, sentence, hint))

    def warning(self, code: str, mark: Mark, sentence: str, hint: str = "") -> None:
        """Note something that is probably not meant."""
        self._add(Finding(mark, code, sentence, hint, "warning"))

    @property
    def errors(self) -> list[Finding]:
        """Only the errors, by position."""
        return sorted((f for f in self.items if f.severity == "error"), key=lambda f: f.mark)

    def raise_errors(self) -> None:
        """Raise InputError with every error, if there is one."""
        if self.errors:
            raise InputError(self.errors)

    def _add(self, finding: Finding) -> None:
        if finding not in self.items:
            self.items.append(finding)


@dataclass(frozen=True, slots=True)
class Node:
    """A YAML value with its position.

    Attributes:
        value: None, bool, int, float or str of a scalar; list[Node] of a sequence; for a mapping a
            list of (key Node, value Node), keys unique.
        kind: "scalar", "sequence" or "mapping".
        mark: where it begins.
        quoted: a scalar written in quotes or as a block: always text.
    """

    value: Any
    kind: str
    mark: Mark
    quoted: bool = False

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

    def plain(self) -> Any:
        """The value without positions: dict, list, str, int, float, bool or None."""
        if self.kind == "mapping":
            return {key.value: value.plain() for key, value in self.value}
        if self.kind == "sequence":
            return [item.plain() for item in self.value]
        return self.value

    def words(self) -> str:
        """What this is, for messages: `the number 3`, `a list`…"""
        if self.kind != "scalar":
            return {"mapping": "a mapping", "sequence": "a list"}[self.kind]
        if self.value is None:
            return "nothing"
        if isinstance(self.value, bool):
            return "true" if self.value else "false"
        text = repr(self.value)
        return text if len(text) <= 60 else text[:57] + "...'"


def read_file(path: Path, what: str = "file") -> Node:
    """The document in a YAML file.

    Raises:
        InputError: missing, a folder, not text, too large, empty, not YAML, or not one mapping.
    """
    start = Mark(str(path))

    def refuse(code: str, sentence: str, hint: str = "") -> InputError:
        return InputError([Finding(start, code, sentence, hint)])

    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        near = path.parent.glob(f"*{path.suffix}") if path.parent.is_dir() else iter(())
        hint = suggestion(path.name, [item.name for item in near])
        raise refuse("E001", f"there is no such {what}", hint) from None
    except IsADirectoryError:
        raise refuse("E001", f"this is a folder, not a {what}") from None
    except OSError as error:
        raise refuse("E001", f"cannot be read: {error.strerror}") from None
    if len(raw) > MAX_BYTES:
        raise refuse("E002", f"{len(raw)} bytes; a {what} may have at most {MAX_BYTES}")
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        where = Mark(str(path), line, column)
        sentence = f"not a text file: byte 0x{raw[error.start]:02x} is not UTF-8"
        raise InputError([Finding(where, "E003", sentence, "save it as UTF-8")]) from None
    return read_text(text, str(path), what)


def read_document(path: Path, what: str = "file", text: str | None = None) -> Node:
    """The document in a file, or in a text that an editor has not saved there yet.

    Raises:
        InputError: as `read_file` and `read_text` do.
    """
    return read_file(path, what) if text is None else read_text(text, str(path), what)


def read_text(text: str, name: str, what: str = "file") -> Node:
    """The document in a YAML text; `name` stands for the file in messages.

    Raises:
        InputError: empty, not YAML, or not one mapping at the top.
    """
    findings = Findings()
    try:
        composed = list(yaml.compose_all(text, Loader=_Loader))
    except yaml.MarkedYAMLError as error:
        mark = _mark(name, error.problem_mark or error.context_mark)
        sentence = (error.problem or str(error)).replace("\n", " ")
        context = f" {error.context}" if error.context else ""
        hint = "indent with spaces" if "\\t" in sentence else ""
        raise InputError([Finding(mark, "E004", f"not YAML:{context} {sentence}", hint)]) from None
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        mark = Mark(name, before.count("\n") + 1, error.position - before.rfind("\n"))
        sentence = f"not a text file: character U+{ord(str(text[error.position])):04X}"
        raise InputError([Finding(mark, "E003", sentence)]) from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        sentence = f"not YAML: {type(error).__name__} {error}".splitlines()[0]
        raise InputError([Finding(Mark(name), "E004", sentence)]) from None
    documents = [node for node in composed if node is not None]
    if not documents:
        raise InputError([Finding(Mark(name), "E005", f"the {what} is empty")])
    if len(documents) > 1:
        mark = _mark(name, documents[1].start_mark)
        raise InputError([Finding(mark, "E006", f"a {what} holds one document", "remove `---`")])
    node = _Reader(name, findings).read(documents[0], 0)
    if not node.is_mapping:
        findings.error("E007", node.mark, f"a {what} is a mapping of keys, got {node.words()}")
    findings.raise_errors()
    return node


class Section:
    """A mapping being read: each key is taken once; `done` reports what nobody took.

    Every getter notes what is wrong in `findings` and returns the fallback, so that reading goes
    on and one run reports everything.
    """

    def __init__(self, node: Node, findings: Findings, what: str, code: str) -> None:
        self.node, self.findings, self.what, self.code = node, findings, what, code
        self._known: list[str] = []
        if not node.is_mapping:
            findings.error(code, node.mark, f"{what} is a mapping of keys, got {node.words()}")

    def node_of(self, key: str, *, required: bool = False) -> Node | None:
        """The node under a key, or None (an error when it is required)."""
        self._known.append(key)
        found = self.node.get(key)
        if found is None and required and self.node.is_mapping:
            self.findings.error(self.code, self.node.mark, f"{self.what} needs the key {key!r}")
        return found

    def value(self, declared: Declaration) -> Any:
        """The checked value of a declared key; its default (or None) when absent or wrong."""
        fallback = None if declared.default is REQUIRED else declared.default
        node = self.node_of(declared.name, required=declared.required)
        return fallback if node is None else self.read(declared, node, fallback)

    def read(self, declared: Declaration, node: Node, fallback: T | None = None) -> Any | T:
        """The checked value of a node under a declaration; the fallback when it is wrong."""
        try:
            return declared.read(node.plain())
        except ParameterError as error:
            self.findings.error(
                self.code, _inner_mark(node), f"{declared.name}: {error.sentence}", error.hint
            )
            return fallback

    def section(self, key: str, *, required: bool = False) -> Section | None:
        """The mapping under a key as a section of its own."""
        node = self.node_of(key, required=required)
        return None if node is None else Section(node, self.findings, f"`{key}`", self.code)

    def sequence(self, key: str, *, required: bool = False) -> list[Node]:
        """The items of the list under a key."""
        node = self.node_of(key, required=required)
        if node is None:
            return []
        if not node.is_sequence:
            self.findings.error(self.code, node.mark, f"{key} is a list, got {node.words()}")
        return node.items

    def parts(
        self, name: str, node: Node, declared: Sequence[Declaration]
    ) -> tuple[Any, ...] | None:
        """The items of a list, each read under its own declaration and reported at its own place.

        None, with everything noted, when the list has another length or an item is wrong.
        """
        wanted = f"[{', '.join(part.name for part in declared)}]"
        if not node.is_sequence or len(node.items) != len(declared):
            got = f"a list of {len(node.items)}" if node.is_sequence else node.words()
            self.findings.error(self.code, node.mark, f"{name}: expected {wanted}, got {got}")
            return None
        values = [self.read(part, item) for part, item in zip(declared, node.items, strict=True)]
        return None if any(value is None for value in values) else tuple(values)

    def done(self) -> None:
        """Report every key that nobody asked for, with the nearest one that exists."""
        for key, _ in self.node.entries:
            if key.value not in self._known:
                self.findings.error(
                    self.code, key.mark, f"{self.what} has no key {key.value!r}",
                    suggestion(str(key.value), self._known),
                )  # fmt: skip


def _inner_mark(node: Node) -> Mark:
    return node.mark


class _Loader(yaml.SafeLoader):
    """SafeLoader that composes with YAML 1.2 core scalars (resolved in _Reader, not here)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        # PyYAML's composer recurses; refuse deep nesting before Python does.
        self.depth = getattr(self, "depth", 0) + 1
        if self.depth > MAX_DEPTH:
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(
                problem=f"nested more than {MAX_DEPTH} deep", problem_mark=event.start_mark
            )
        try:
            return super().compose_node(parent, index)
        finally:
            self.depth -= 1


_INT = re.compile(r"[-+]?[0-9]+")
_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
}  # fmt: skip
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_PLAIN_TAGS = ("tag:yaml.org,2002:",)


class _Reader:
    """Turns PyYAML's nodes into ours, counting nodes so that aliases cannot explode."""

    def __init__(self, name: str, findings: Findings) -> None:
        self.name, self.findings, self.count = name, findings, 0
        self.open: set[int] = set()

    def read(self, node: yaml.Node, depth: int) -> Node:
        self.count += 1
        mark = _mark(self.name, node.start_mark)
        if self.count > MAX_NODES:
            sentence = f"more than {MAX_NODES} values once aliases are followed"
            raise InputError([Finding(mark, "E008", sentence)])
        if id(node) in self.open or depth > MAX_DEPTH:
            raise InputError([Finding(mark, "E008", "an alias contains itself")])
        if not node.tag.startswith(_PLAIN_TAGS) or self._tagged(node):
            self.findings.error("E009", mark, f"tags are not used here, got {node.tag!r}")
        self.open.add(id(node))
        try:
            if isinstance(node, yaml.MappingNode):
                return Node(self._entries(node, depth), "mapping", mark)
            if isinstance(node, yaml.SequenceNode):
                items = [self.read(item, depth + 1) for item in node.value]
                return Node(items, "sequence", mark)
            assert isinstance(node, yaml.ScalarNode)
            return self._scalar(node, mark)
        finally:
            self.open.discard(id(node))

    def _tagged(self, node: yaml.Node) -> bool:
        text, at = node.start_mark.buffer, node.start_mark.pointer
        return bool(text) and str(text)[at : at + 1] == "!"

    def _entries(self, node: yaml.MappingNode, depth: int) -> list[tuple[Node, Node]]:
        entries: list[tuple[Node, Node]] = []
        seen: dict[Any, Mark] = {}
        for key_node, value_node in node.value:
            key = self.read(key_node, depth + 1)
            if key.kind != "scalar":
                self.findings.error("E010", key.mark, f"a key is a word, got {key.words()}")
                continue
            if key.value in seen:
                first = seen[key.value]
                self.findings.error(
                    "E011", key.mark, f"the key {key.value!r} stands twice",
                    f"first in line {first.line}",
                )  # fmt: skip
            else:
                seen[key.value] = key.mark
                entries.append((key, self.read(value_node, depth + 1)))
        return entries

    def _scalar(self, node: yaml.ScalarNode, mark: Mark) -> Node:
        if node.style in ("'", '"', "|", ">"):
            return Node(node.value, "scalar", mark, quoted=True)
        return Node(self._core_value(node.value, mark), "scalar", mark)

    def _core_value(self, text: str, mark: Mark) -> Any:
        if text in _WORDS:
            return _WORDS[text]
        if _INT.fullmatch(text):
            if len(text) > 18:
                self.findings.error("E012", mark, f"the number {text[:20]}... is too large")
                return 0
            return int(text)
        if _BASED.fullmatch(text):
            return int(text, 0)
        if _FLOAT.fullmatch(text):
            return float(text)
        if _SPECIAL.fullmatch(text):
            self.findings.error("E012", mark, f"{text} is not a finite number")
            return 0.0
        return text


def _mark(name: str, mark: Any) -> Mark:
    return Mark(name, mark.line + 1, mark.column + 1) if mark is not None else Mark(name)


def value_of(text: str) -> Any:
    """What one value means that stands alone, as on a command line: 3, true, [1, 2], 30 cm.

    Raises:
        InputError: not YAML.
    """
    return read_text(f"value: {text}", "command line", "value").plain()["value"]


def as_yaml(value: Any) -> str:
    """Plain values as a YAML text that `read_text` understands."""
    text: str = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=100)
    return text


def iter_scalars(node: Node) -> Iterator[Node]:
    """Every scalar below a node, keys left out."""
    if node.kind == "scalar":
        yield node
    for _, value in node.entries:
        yield from iter_scalars(value)
    for item in node.items:
        yield from iter_scalars(item)
