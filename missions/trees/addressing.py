"""How people name a node of a tree: by number, by name, by path, or by the line of its file.

    12                                    the number that the event log and `tell RUN nodes` show
    drive to the shelf                    its name, its behaviour, or the tree that it uses
    patrol/inspect/drive to the shelf     names from above down to it; those between may be left out
    02_office_patrol.yaml:31              what begins in this line

A name that several nodes have means all of them, as a line of a tree that is used twice does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from stack.errors import InputError
from stack.parameters import suggestion

WRAPPERS = frozenset(
    {"when", "while", "on_failure", "repeat", "recover", "retry", "timeout", "every", "events"}
)
"""Kinds of nodes that begin where the node begins that they stand around."""

_LINE = re.compile(r"(?P<file>[^:]*\.ya?ml|):(?P<line>\d+)")
_SEPARATOR = re.compile(r"\s+>\s+|/")


@dataclass(frozen=True, slots=True)
class Addressed:
    """What a node can be found by.

    Attributes:
        names: what it may be called; the one to show first.
        file, line, column: where it begins; "" and 0 where nobody knows.
    """

    id: int
    parent: int
    kind: str
    names: tuple[str, ...]
    file: str = ""
    line: int = 0
    column: int = 0

    @property
    def where(self) -> str:
        """File and line, without folders; empty where nobody knows."""
        return f"{self.file.rpartition('/')[2]}:{self.line}" if self.line else ""


def find_nodes(nodes: Sequence[Addressed], text: str) -> list[int]:
    """The ids of the nodes that a text means, in drawing order.

    Raises:
        InputError: there is none; the message names what is near.
    """
    by_id = {node.id: node for node in nodes}
    wanted = text.strip()
    number = wanted.removeprefix("#")
    if number.isdecimal():
        if int(number) not in by_id:
            raise InputError(f"there is no node {number}; they are numbered 0 to {max(by_id)}")
        return [int(number)]
    line = _LINE.fullmatch(wanted)
    if line:
        return _at_line(nodes, line["file"], int(line["line"]), wanted)
    found = [node.id for node in nodes if wanted in node.names]
    found = found or _by_path(by_id, [part.strip() for part in _SEPARATOR.split(wanted)])
    if found:
        return found
    names = {name for node in nodes for name in node.names}
    last = _SEPARATOR.split(wanted)[-1].strip()
    near = suggestion(last, names)
    if last in names:  # the end is right, so something above it is not
        near = f"{last!r} stands at {', '.join(path_of(by_id, i) for i in find_nodes(nodes, last))}"
    raise InputError(f"no node is called {text!r}; {near}")


def path_of(by_id: dict[int, Addressed], number: int) -> str:
    """The names from the root to a node, decorators left out."""
    chain = reversed(list(_upwards(by_id, number)))
    return "/".join(
        node.names[0] for node in chain if node.id == number or node.kind not in WRAPPERS
    )


def _upwards(by_id: dict[int, Addressed], number: int) -> Iterator[Addressed]:
    while number in by_id:
        yield by_id[number]
        number = by_id[number].parent


def _by_path(by_id: dict[int, Addressed], parts: list[str]) -> list[int]:
    """Nodes with the last name that have the others above them, in this order."""
    return [number for number in by_id if _fits(list(_upwards(by_id, number)), parts[::-1])]


def _fits(chain: list[Addressed], wanted: list[str]) -> bool:
    if wanted[0] not in chain[0].names:
        return False
    above = iter(chain[1:])
    return all(any(part in node.names for node in above) for part in wanted[1:])


def _at_line(nodes: Sequence[Addressed], file: str, line: int, text: str) -> list[int]:
    """What begins in a line: of several there, the outermost; of its modifiers, the node itself."""
    main = nodes[0].file if nodes else ""
    there = [
        node for node in nodes
        if node.line and (node.file == (file or main) or node.file.endswith(f"/{file}"))
    ]  # fmt: skip
    if file and not there:
        files = sorted({node.file.rpartition("/")[2] for node in nodes if node.file})
        raise InputError(f"no node stands in {file!r}; {suggestion(file, files)}")
    begins = [node for node in there if node.line == line]
    if not begins:
        near = sorted(there, key=lambda node: (abs(node.line - line), node.line))[:2]
        shown = ", ".join(f"{node.names[0]!r} in line {node.line}" for node in near)
        raise InputError(f"no node begins at {text}; the nearest are {shown}")
    column = min(node.column for node in begins)
    first = [node for node in begins if node.column == column]
    return [node.id for node in first if node.kind not in WRAPPERS] or [first[-1].id]
