"""Reads YAML documents and their mappings; every finding has file, line and column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from stack.documents.findings import Finding, Findings, Mark
from stack.documents.yaml_nodes import Node, compose
from stack.errors import InputError, ParameterError
from stack.parameters import REQUIRED, Declaration, nearest, suggestion

MAX_BYTES = 1_000_000

T = TypeVar("T")


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
    documents = compose(text, name, findings)
    if all(node.kind == "scalar" and node.value is None for node in documents):
        raise InputError([Finding(Mark(name), "E005", f"the {what} is empty")])
    node = documents[0]
    if len(documents) > 1:
        where = documents[1].mark
        raise InputError([Finding(where, "E006", f"a {what} holds one document", "remove `---`")])
    if not node.is_mapping:
        findings.error("E007", node.mark, f"a {what} is a mapping of keys, got {node.words()}")
    findings.raise_errors()
    return node


class Section:
    """A mapping being read: each key is taken once; `done` reports what nobody took.

    Every getter notes what is wrong in `findings` and returns the fallback, so that reading goes
    on and one run reports everything. With `keys`, the keys that there are, a misspelt key is
    reported and then read as the one that was meant: one mistake gives one finding.
    """

    def __init__(
        self, node: Node, findings: Findings, what: str, code: str, keys: Sequence[str] = ()
    ) -> None:
        self.findings, self.what, self.code = findings, what, code
        self.node = self._respelt(node, keys) if keys and node.is_mapping else node
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

    def _respelt(self, node: Node, keys: Sequence[str]) -> Node:
        written = [str(key.value) for key, _ in node.entries]
        free = [key for key in keys if key not in written]
        entries = []
        for key, value in node.entries:
            meant = nearest(str(key.value), free) if key.value not in keys else None
            if meant is not None:
                free.remove(meant)
                self._unknown(key, keys)
                key = replace(key, value=meant)
            entries.append((key, value))
        return replace(node, value=entries)

    def _unknown(self, key: Node, keys: Sequence[str]) -> None:
        sentence = f"{self.what} has no key {key.value!r}"
        self.findings.error(self.code, key.mark, sentence, suggestion(str(key.value), keys))

    def done(self) -> None:
        """Report every key that nobody asked for, with the nearest one that exists."""
        for key, _ in self.node.entries:
            if key.value not in self._known:
                self._unknown(key, self._known)


def _inner_mark(node: Node) -> Mark:
    return node.mark


def value_of(text: str) -> Any:
    """What one value means that stands alone, as on a command line: 3, true, [1, 2], 30 cm.

    Raises:
        InputError: not YAML.
    """
    return read_text(f"value: {text}", "command line", "value").plain()["value"]
