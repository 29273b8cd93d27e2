"""A parameter file of Nav2 laid open: servers, sections of them, and which values were taken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from missions.nav2.equivalents import Equivalent, Table
from missions.nav2.reasons import STRUCTURE, reason
from stack.documents import Findings, Mark, Node

CODE = "E116"


@dataclass(frozen=True, slots=True)
class Taken:
    """A parameter that was taken over: `controller_server.FollowPath.vx_max` as `cruise_speed`."""

    path: str
    mark: Mark
    kind: str
    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class Left:
    """A parameter that was not taken over, and why."""

    path: str
    mark: Mark
    why: str


def class_name(plugin: object) -> str:
    """`MPPIController` of `nav2_mppi_controller::MPPIController`, also with a slash."""
    return str(plugin).replace("::", "/").rpartition("/")[2]


@dataclass(frozen=True, slots=True)
class Part:
    """A mapping of the file, and its name from the server down."""

    path: str
    node: Node

    def get(self, key: str) -> Part | None:
        """What stands under a key; with dots in it, also further down."""
        found = self.node.get(key)
        head, dot, rest = key.partition(".")
        if found is None and dot:
            section = self.node.get(head)
            return None if section is None else Part(f"{self.path}.{head}", section).get(rest)
        return None if found is None else Part(f"{self.path}.{key}", found)

    def texts(self, key: str) -> list[str]:
        """A list of names; a single name is a list of one."""
        part = self.get(key)
        if part is None:
            return []
        items = part.node.items if part.node.is_sequence else [part.node]
        return [item.value for item in items if isinstance(item.value, str)]

    @property
    def plugin(self) -> str:
        """Class of the plugin in this section, without its package."""
        part = self.get("plugin")
        return "" if part is None else class_name(part.node.value)


@dataclass
class Values:
    """Parameters of one kind of ours, as they stand in the file."""

    use: str | None = None
    use_mark: Mark | None = None
    values: dict[str, Any] = field(default_factory=dict)
    marks: dict[str, Mark] = field(default_factory=dict)


class Sheet:
    """Collects what is taken over; what nobody took is left."""

    def __init__(self, top: Node, findings: Findings) -> None:
        self.top, self.findings = top, findings
        self.servers = dict(_servers(top))
        self.kinds: dict[str, Values] = {}
        self.taken: list[Taken] = []
        self._seen: list[Node] = []

    def server(self, name: str) -> Part | None:
        """The parameters of a server."""
        return self.servers.get(name)

    def use(self, kind: str, part: Part, name: str) -> None:
        """Choose a component, for the plugin that a section names."""
        chosen = self.kinds.setdefault(kind, Values())
        plugin = part.get("plugin") or part
        chosen.use, chosen.use_mark = name, plugin.node.mark
        self._take(plugin, kind, "use", name)

    def take(self, part: Part | None, kind: str, table: Table) -> None:
        """Take over what a table knows of a section."""
        for key, equivalent in table.items() if part is not None else ():
            found = part.get(key) if part is not None else None
            if found is not None:
                self.set(kind, found, equivalent)

    def set(self, kind: str, part: Part, equivalent: Equivalent) -> None:
        """Take over one value."""
        value = self.converted(part, equivalent.convert)
        if value is None:
            return
        target = self.kinds.setdefault(kind, Values())
        target.values[equivalent.name] = value
        target.marks[equivalent.name] = part.node.mark
        self._take(part, kind, equivalent.name, value)

    def converted(self, part: Part, convert: Callable[[Any], Any]) -> Any:
        """A value in our terms; None, and a finding, when it is not of the kind expected."""
        raw = part.node.plain()
        try:
            return convert(raw)
        except (TypeError, ValueError, IndexError, KeyError):
            sentence = f"{part.path}: {part.node.words()} cannot be what Nav2 expects there"
            self.findings.error(CODE, part.node.mark, sentence)
            return None

    def seen(self, part: Part) -> None:
        """Say that a value was taken over piece by piece."""
        self._seen.append(part.node)

    def note(self, part: Part, kind: str, name: str, value: Any) -> None:
        """Say that a value was taken over into a list."""
        self._take(part, kind, name, value)

    def left(self) -> Iterator[Left]:
        """What was not taken over, in the order of the file, but for the words that only join."""
        for server in self.servers.values():
            yield from (item for item in self._left(server) if item.why != STRUCTURE)

    def _left(self, part: Part) -> Iterator[Left]:
        if any(part.node is node for node in self._seen):
            return
        if part.node.is_mapping:
            for key, value in part.node.entries:
                yield from self._left(Part(f"{part.path}.{key.value}", value))
        else:
            yield Left(part.path, part.node.mark, reason(part.path))

    def _take(self, part: Part, kind: str, name: str, value: Any) -> None:
        self._seen.append(part.node)
        self.taken.append(Taken(part.path, part.node.mark, kind, name, value))


def _servers(node: Node) -> Iterator[tuple[str, Part]]:
    """Every `name: {ros__parameters: …}`, under any namespace."""
    for key, value in node.entries:
        inner = value.get("ros__parameters")
        name = str(key.value).strip("/") or str(key.value)
        if inner is not None and inner.is_mapping:
            yield name, Part(name, inner)
        else:
            yield from _servers(value)
