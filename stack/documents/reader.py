"""Reader of YAML documents and their mappings; every finding has file, line and column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Any, Self, TypeVar

from stack.documents.file_kinds import require_kind
from stack.documents.files import decoded, read_input
from stack.documents.findings import Finding, Findings, Mark
from stack.documents.ros_parameters import RosComposer
from stack.documents.yaml_nodes import Node, compose
from stack.errors import InputError, ParameterError
from stack.parameters import REQUIRED, Declaration, did_you_mean, nearest, superfluous

T = TypeVar("T")


def read_file(path: Path, what: str = "file", like: Sequence[str] = ()) -> Node:
    """Read the document in a YAML file.

    Args:
        path: of the file.
        what: kind of file for messages, such as "world file".
        like: keys of which such a file has at least one, perhaps misspelt. A file without them is
            of another kind, and findings must not quote from it.

    Raises:
        InputError: the file is missing, a folder, a device, not text, too large, empty, not YAML,
            not one mapping, or of another kind.
    """
    return _of_kind(read_text(decoded(read_input(path, what), path), str(path), what), what, like)


def read_document(
    path: Path, what: str = "file", text: str | None = None, like: Sequence[str] = ()
) -> Node:
    """Read the document in a file, or in the unsaved `text` of an editor for that file.

    Raises:
        InputError: as `read_file` and `read_text` do.
    """
    if text is None:
        return read_file(path, what, like)
    return _of_kind(read_text(text, str(path), what), what, like)


def _of_kind(node: Node, what: str, like: Sequence[str]) -> Node:
    """The node, if one of its keys is or resembles a known one.

    Raises:
        InputError: none does, or they are those of another kind of file.
    """
    if not like:
        return node
    require_kind(node, what)
    written = [str(key.value)[:60] for key, _ in node.entries]
    if not any(get_close_matches(word, like, 1, cutoff=0.75) for word in written):
        sentence = f"not a {what}: it has none of the keys {', '.join(like[:4])}…"
        raise InputError([Finding(Mark(node.mark.file), "E007", sentence)])
    return node


@lru_cache(maxsize=64)
def read_text(text: str, name: str, what: str = "file") -> Node:
    """Read the document in a YAML text; `name` is the file name for messages.

    Equal texts give the same node, parsed once: each reader of a mission reads the same files.

    Raises:
        InputError: the text is empty, not YAML, or not one mapping.
    """
    findings = Findings()
    node = _only_mapping(compose(text, name, findings), name, what, findings)
    findings.raise_errors()
    return node


def _only_mapping(documents: list[Node], name: str, what: str, findings: Findings) -> Node:
    """The only document of a text; a finding if it is not a mapping.

    Raises:
        InputError: it is empty, or there are several.
    """
    if all(node.kind == "scalar" and node.value is None for node in documents):
        raise InputError([Finding(Mark(name), "E005", f"the {what} is empty")])
    node = documents[0]
    if len(documents) > 1:
        where = documents[1].mark
        raise InputError(
            [Finding(where, "E006", f"a {what} has only one document", "remove `---`")]
        )
    if not node.is_mapping:
        got = "a list" if node.is_sequence else "a text or number"
        findings.add("E007", node.mark, f"not a {what}: expected keys with values, got {got}")
    return node


def read_ros_parameters(path: Path, what: str, text: str | None = None) -> tuple[Node, Findings]:
    """Read a parameter file of ROS, with warnings about duplicate keys.

    Args:
        path: of the file.
        what: kind of file for messages.
        text: to read instead of the file's.

    Raises:
        InputError: as `read_file`.
    """
    findings = Findings()
    text = decoded(read_input(path, what), path) if text is None else text
    documents = compose(text, str(path), findings, RosComposer)
    node = _only_mapping(documents, str(path), what, findings)
    findings.raise_errors()
    return node, findings


class Section:
    """Reader of one mapping: getters read its keys, `done` reports the unknown ones.

    Every getter adds errors to `findings` and returns a fallback, so that one run reports all
    errors. With `keys`, the list of known keys, a misspelt key is reported and then read as the
    most similar known one: one mistake gives one finding. `keys` can also be a
    mapping of words, known keys and those of other tools, to the known keys.
    """

    def __init__(
        self, node: Node, findings: Findings, what: str, code: str,
        keys: Sequence[str] | Mapping[str, str] = (),
    ) -> None:  # fmt: skip
        self.findings, self.what, self.code = findings, what, code
        self.mark = node.mark
        self._elsewhere = keys if isinstance(keys, Mapping) else {}
        keys = [key for key in keys if self._elsewhere.get(key, key) == key]
        self.node = self._respelt(node, keys) if keys and node.is_mapping else node
        self._known: list[str] = []
        if not node.is_mapping:
            sentence = f"{what} must be a mapping of keys, got {node.words()}"
            findings.add(code, node.mark, sentence)

    def at(self, key: Node) -> Self:
        """Report what is missing at the key whose value this is, not at the value."""
        self.mark = key.mark
        return self

    def node_of(self, key: str, *, required: bool = False) -> Node | None:
        """The node under a key, or None, which is reported if the key is required."""
        self._known.append(key)
        found = self.node.get(key)
        if found is None and required and self.node.is_mapping:
            sentence = f"{self.what} needs the key {key!r}"
            self.findings.add(self.code, self.mark, sentence, f"add `{key}: …`")
        return found

    def value(self, declared: Declaration) -> Any:
        """The checked value of a declared key; its default (or None) if absent or wrong."""
        fallback = None if declared.default is REQUIRED else declared.default
        node = self.node_of(declared.name, required=declared.required)
        return fallback if node is None else self.read(declared, node, fallback)

    def name(self, declared: Declaration) -> str:
        """The checked value of a declared key that is a name: one line of text."""
        value = self.value(declared)
        if value is not None and not is_one_line(value):
            node = self.node_of(declared.name) or self.node
            self.findings.add(self.code, node.mark, f"{declared.name}: expected one line")
        return value or ""

    def read(self, declared: Declaration, node: Node, fallback: T | None = None) -> Any | T:
        """The checked value of a node by its declaration; the fallback if it is wrong."""
        try:
            return declared.read(node.plain())
        except ParameterError as error:
            self.findings.add(
                self.code, node.mark, f"{declared.name}: {error.sentence}", error.hint
            )
            return fallback

    def section(self, key: str, *, required: bool = False) -> Section | None:
        """The mapping under a key as a Section."""
        node = self.node_of(key, required=required)
        return None if node is None else self.part(key, node)

    def part(self, key: str, node: Node) -> Section:
        """A mapping, read under a key, as a Section."""
        found = Section(node, self.findings, f"`{key}`", self.code)
        found.mark = self.key_mark(key)
        return found

    def mark_of(self, key: str) -> Mark:
        """The position of a key's value; that of the section if the key is not written."""
        node = self.node.get(key)
        return self.mark if node is None else node.mark

    def key_mark(self, key: str) -> Mark:
        """The position of a key; that of the section if it is not written."""
        node = self.node.key(key)
        return self.mark if node is None else node.mark

    def sequence(self, key: str, *, required: bool = False) -> list[Node]:
        """The items of the list under a key."""
        node = self.node_of(key, required=required)
        if node is None:
            return []
        if not node.is_sequence:
            sentence = f"{key}: expected a list, got {node.words()}"
            hint = f"write {key}: [{node.value}]" if node.value is not None else ""
            self.findings.add(self.code, node.mark, sentence, hint)
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
            self.findings.add(self.code, node.mark, f"{name}: expected {wanted}, got {got}")
            return None
        values = [self.read(part, item) for part, item in zip(declared, node.items, strict=True)]
        return None if any(value is None for value in values) else tuple(values)

    def _respelt(self, node: Node, keys: Sequence[str]) -> Node:
        written = [str(key.value) for key, _ in node.entries]
        free = [key for key in keys if key not in written]
        entries = []
        for key, value in node.entries:
            meant = self._meant(key, free) if key.value not in keys else None
            if meant is not None:
                free.remove(meant)
                self._unknown(key, keys, did_you_mean(meant))
                key = replace(key, value=meant)
            entries.append((key, value))
        return replace(node, value=entries)

    def _meant(self, key: Node, free: Sequence[str]) -> str | None:
        word = self._elsewhere.get(str(key.value), "")
        return word if word in free else nearest(str(key.value), free)

    def _unknown(self, key: Node, keys: Sequence[str], hint: str = "") -> None:
        sentence = f"{self.what} has no key {key.words()}"
        hint = hint or superfluous(str(key.value), keys)
        self.findings.add(self.code, key.mark, sentence, hint)

    def unread(self) -> list[Node]:
        """The keys that no getter has read."""
        return [key for key, _ in self.node.entries if key.value not in self._known]

    def done(self) -> None:
        """Report every key that no getter has read, with the most similar known one."""
        for key in self.unread():
            self._unknown(key, self._known)


def is_one_line(name: str) -> bool:
    """Whether a name can be shown in one line of a list."""
    return "\n" not in name and "\t" not in name


def value_of(text: str) -> Any:
    """Read one YAML value, as on a command line: 3, true, [1, 2], 30 cm.

    Raises:
        InputError: the text is not YAML.
    """
    return read_text(f"value: {text}", "command line", "value").plain()["value"]
