"""Addresses of nodes: a node is found by number, name, path, or line in its file.

    12                                    the number in the event log and in `tell RUN nodes`
    drive to the shelf                    its name, its behaviour, or the tree that it uses
    patrol/inspect/drive to the shelf     a path of names; names in between can be omitted
    02_office_patrol.yaml:31              the node that starts in this line

An address can match several nodes: equal names, or a line of a tree that is used twice.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from missions.language.kinds import CONTROLS
from stack.errors import InputError
from stack.parameters import suggestion

WRAPPERS = frozenset(CONTROLS) - {"event"}
"""Nodes of modifiers; they have the file position of the node that they decorate."""

_LINE = re.compile(r"(?P<file>[^:]*\.ya?ml|):(?P<line>\d+)")
_SEPARATOR = re.compile(r"\s+>\s+|/")


@dataclass(frozen=True, slots=True)
class Addressed:
    """The address of a node.

    Attributes:
        names: its names; the first one is shown.
        file, line, column: start of the node; "" and 0 if unknown.
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
        """File and line, without folders; empty if unknown."""
        return f"{self.file.rpartition('/')[2]}:{self.line}" if self.line else ""


def find_nodes(nodes: Sequence[Addressed], text: str) -> list[int]:
    """Return the ids of the nodes with this address, in drawing order.

    Raises:
        InputError: no node matches; the message suggests similar addresses.
    """
    by_id = {node.id: node for node in nodes}
    wanted = text.strip()
    number = wanted.removeprefix("#")
    if number.isdecimal():
        if int(number) not in by_id:
            raise InputError(f"there is no node {number}; nodes are numbered 0 to {max(by_id)}")
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
    near: str = suggestion(last, names)
    if last in names:  # the last name exists, so the path above it is wrong
        near = f"{last!r} is at {', '.join(path_of(by_id, i) for i in find_nodes(nodes, last))}"
    raise InputError(f"no node is called {text!r}; {near}")


def path_of(by_id: dict[int, Addressed], number: int) -> str:
    """Return the names from the root to a node, without decorators."""
    chain = reversed(list(_upwards(by_id, number)))
    return "/".join(
        node.names[0] for node in chain if node.id == number or node.kind not in WRAPPERS
    )


def _upwards(by_id: dict[int, Addressed], number: int) -> Iterator[Addressed]:
    while number in by_id:
        yield by_id[number]
        number = by_id[number].parent


def _by_path(by_id: dict[int, Addressed], parts: list[str]) -> list[int]:
    """Return the nodes with the last name whose ancestors have the others, in this order."""
    return [number for number in by_id if _matches_path(list(_upwards(by_id, number)), parts[::-1])]


def _matches_path(chain: list[Addressed], wanted: list[str]) -> bool:
    if wanted[0] not in chain[0].names:
        return False
    above = iter(chain[1:])
    return all(any(part in node.names for node in above) for part in wanted[1:])


def _at_line(nodes: Sequence[Addressed], file: str, line: int, text: str) -> list[int]:
    """Return the outermost nodes that start in a line, without their decorators."""
    main = nodes[0].file if nodes else ""
    in_file = [
        node for node in nodes
        if node.line and (node.file == (file or main) or node.file.endswith(f"/{file}"))
    ]  # fmt: skip
    if file and not in_file:
        files = sorted({node.file.rpartition("/")[2] for node in nodes if node.file})
        raise InputError(f"no node is in {file!r}; {suggestion(file, files)}")
    begins = [node for node in in_file if node.line == line]
    if not begins:
        near = sorted(in_file, key=lambda node: (abs(node.line - line), node.line))[:2]
        nearest = ", ".join(f"{node.names[0]!r} in line {node.line}" for node in near)
        raise InputError(f"no node starts at {text}; the nearest are {nearest}")
    column = min(node.column for node in begins)
    first = [node for node in begins if node.column == column]
    return [node.id for node in first if node.kind not in WRAPPERS] or [first[-1].id]
