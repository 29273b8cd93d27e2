"""Reader of YAML documents and their mappings; every finding has file, line and column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from stack.documents.findings import Finding, Findings, Mark
from stack.documents.yaml_nodes import Node, compose
from stack.errors import InputError, ParameterError
from stack.parameters import REQUIRED, Declaration, nearest, suggestion

MAX_BYTES = 1_000_000

T = TypeVar("T")


def read_file(path: Path, what: str = "file") -> Node:
    """Read the document in a YAML file.

    Args:
        path: of the file.
        what: kind of file for messages, such as "world file".

    Raises:
        InputError: the file is missing, a folder, not text, too large, empty, not YAML, or not
            one mapping.
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
    """Read the document in a file, or in the unsaved `text` of an editor for that file.

    Raises:
        InputError: as `read_file` and `read_text` do.
    """
    return read_file(path, what) if text is None else read_text(text, str(path), what)


@lru_cache(maxsize=64)
def read_text(text: str, name: str, what: str = "file") -> Node:
    """Read the document in a YAML text; `name` is the file name for messages.

    Equal texts give the same node, parsed once: each reader of a mission reads the same files.

    Raises:
        InputError: the text is empty, not YAML, or not one mapping.
    """
    findings = Findings()
    documents = compose(text, name, findings)
    if all(node.kind == "scalar" and node.value is None for node in documents):
        raise InputError([Finding(Mark(name), "E005", f"the {what} is empty")])
    node = documents[0]
    if len(documents) > 1:
        where = documents[1].mark
        raise InputError(
            [Finding(where, "E006", f"a {what} has only one document", "remove `---`")]
        )
    if not node.is_mapping:
        sentence = f"a {what} must be a mapping of keys, got {node.words()}"
        findings.error("E007", node.mark, sentence)
    findings.raise_errors()
    return node


class Section:
    """Reader of one mapping: getters read its keys, `done` reports the unknown ones.

    Every getter adds errors to `findings` and returns a fallback, so that one run reports all
    errors. With `keys`, the list of known keys, a misspelt key is reported and then read as the
    most similar known one: one mistake gives one finding.
    """

    def __init__(
        self, node: Node, findings: Findings, what: str, code: str, keys: Sequence[str] = ()
    ) -> None:
        self.findings, self.what, self.code = findings, what, code
        self.node = self._respelt(node, keys) if keys and node.is_mapping else node
        self._known: list[str] = []
        if not node.is_mapping:
            sentence = f"{what} must be a mapping of keys, got {node.words()}"
            findings.error(code, node.mark, sentence)

    def node_of(self, key: str, *, required: bool = False) -> Node | None:
        """The node under a key, or None, which is reported if the key is required."""
        self._known.append(key)
        found = self.node.get(key)
        if found is None and required and self.node.is_mapping:
            self.findings.error(self.code, self.node.mark, f"{self.what} needs the key {key!r}")
        return found

    def value(self, declared: Declaration) -> Any:
        """The checked value of a declared key; its default (or None) if absent or wrong."""
        fallback = None if declared.default is REQUIRED else declared.default
        node = self.node_of(declared.name, required=declared.required)
        return fallback if node is None else self.read(declared, node, fallback)

    def read(self, declared: Declaration, node: Node, fallback: T | None = None) -> Any | T:
        """The checked value of a node by its declaration; the fallback if it is wrong."""
        try:
            return declared.read(node.plain())
        except ParameterError as error:
            self.findings.error(
                self.code, _inner_mark(node), f"{declared.name}: {error.sentence}", error.hint
            )
            return fallback

    def section(self, key: str, *, required: bool = False) -> Section | None:
        """The mapping under a key as a Section."""
        node = self.node_of(key, required=required)
        return None if node is None else Section(node, self.findings, f"`{key}`", self.code)

    def sequence(self, key: str, *, required: bool = False) -> list[Node]:
        """The items of the list under a key."""
        node = self.node_of(key, required=required)
        if node is None:
            return []
        if not node.is_sequence:
            sentence = f"{key}: expected a list, got {node.words()}"
            self.findings.error(self.code, node.mark, sentence)
        return node.items

    def parts(
        self, name: str, node: Node, declared: Sequence[Declaration]
    ) -> tuple[Any, ...] | None:
        """The items of a list, each read by its own declaration and reported at its own position.

        None if the list has another length or an item is wrong, which is reported.
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
        """Report every key that no getter has read, with the most similar known one."""
        for key, _ in self.node.entries:
            if key.value not in self._known:
                self._unknown(key, self._known)


def _inner_mark(node: Node) -> Mark:
    return node.mark


def value_of(text: str) -> Any:
    """Read one YAML value, as on a command line: 3, true, [1, 2], 30 cm.

    Raises:
        InputError: the text is not YAML.
    """
    return read_text(f"value: {text}", "command line", "value").plain()["value"]
