"""Import of a Nav2 parameter file: its servers and sections, and which values were imported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from missions.nav2.equivalents import Equivalent, Table
from missions.nav2.reasons import STRUCTURE, reason
from stack.documents import Findings, Mark, Node

CODE = "E116"


@dataclass(frozen=True, slots=True)
class Imported:
    """An imported parameter: `controller_server.FollowPath.vx_max` as `cruise_speed`."""

    path: str
    mark: Mark
    kind: str
    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class Ignored:
    """A parameter that was not imported, and the reason."""

    path: str
    mark: Mark
    reason: str


def class_name(plugin: object) -> str:
    """Return `MPPIController` of `nav2_mppi_controller::MPPIController`, also with a slash."""
    return str(plugin).replace("::", "/").rpartition("/")[2]


@dataclass(frozen=True, slots=True)
class Section:
    """A node of the file and its path from the server: `controller_server.FollowPath`."""

    path: str
    node: Node

    def get(self, key: str) -> Section | None:
        """Return the value of a key; a key with dots also matches nested keys."""
        found = self.node.get(key)
        head, dot, rest = key.partition(".")
        if found is None and dot:
            section = self.node.get(head)
            return None if section is None else Section(f"{self.path}.{head}", section).get(rest)
        return None if found is None else Section(f"{self.path}.{key}", found)

    def texts(self, key: str) -> list[str]:
        """Return a list of names; a single name is a list of one."""
        part = self.get(key)
        if part is None:
            return []
        items = part.node.items if part.node.is_sequence else [part.node]
        return [item.value for item in items if isinstance(item.value, str)]

    @property
    def plugin(self) -> str:
        """Class of the section's plugin, without its package."""
        part = self.get("plugin")
        return "" if part is None else class_name(part.node.value)


@dataclass
class ComponentValues:
    """Imported component and parameters of one kind, with their positions in the file."""

    use: str | None = None
    use_mark: Mark | None = None
    values: dict[str, Any] = field(default_factory=dict)
    marks: dict[str, Mark] = field(default_factory=dict)


class Importer:
    """Imports values of a Nav2 parameter file and keeps track of the values it ignored."""

    def __init__(self, top: Node, findings: Findings) -> None:
        self.top, self.findings = top, findings
        self.servers = dict(_servers(top))
        self.kinds: dict[str, ComponentValues] = {}
        self.imported: list[Imported] = []
        self._seen: list[Node] = []

    def server(self, name: str) -> Section | None:
        """Return the parameters of a server."""
        return self.servers.get(name)

    def use(self, kind: str, part: Section, name: str) -> None:
        """Choose the component for the plugin of a section."""
        chosen = self.kinds.setdefault(kind, ComponentValues())
        plugin = part.get("plugin") or part
        chosen.use, chosen.use_mark = name, plugin.node.mark
        self.record(plugin, kind, "use", name)

    def copy(self, part: Section | None, kind: str, table: Table) -> None:
        """Import the parameters of a section that a table contains."""
        for key, equivalent in table.items() if part is not None else ():
            found = part.get(key) if part is not None else None
            if found is not None:
                self.set(kind, found, equivalent)

    def set(self, kind: str, part: Section, equivalent: Equivalent) -> None:
        """Import one value."""
        value = self.converted(part, equivalent.convert)
        if value is None:
            return
        target = self.kinds.setdefault(kind, ComponentValues())
        target.values[equivalent.name] = value
        target.marks[equivalent.name] = part.node.mark
        self.record(part, kind, equivalent.name, value)

    def converted(self, part: Section, convert: Callable[[Any], Any]) -> Any:
        """Return a converted value; None and a finding if its type is wrong."""
        raw = part.node.plain()
        try:
            return convert(raw)
        except (TypeError, ValueError, IndexError, KeyError):
            sentence = f"{part.path}: {part.node.words()} is not a value that Nav2 accepts"
            self.findings.error(CODE, part.node.mark, sentence)
            return None

    def mark_seen(self, part: Section) -> None:
        """Record that a list was imported item by item."""
        self._seen.append(part.node)

    def record(self, part: Section, kind: str, name: str, value: Any) -> None:
        """Record that a value was imported."""
        self._seen.append(part.node)
        self.imported.append(Imported(part.path, part.node.mark, kind, name, value))

    def ignored(self) -> Iterator[Ignored]:
        """Yield the parameters that were not imported, in the order of the file."""
        for server in self.servers.values():
            yield from (item for item in self._ignored(server) if item.reason != STRUCTURE)

    def _ignored(self, part: Section) -> Iterator[Ignored]:
        if any(part.node is node for node in self._seen):
            return
        if part.node.is_mapping:
            for key, value in part.node.entries:
                yield from self._ignored(Section(f"{part.path}.{key.value}", value))
        else:
            yield Ignored(part.path, part.node.mark, reason(part.path))


def _servers(node: Node) -> Iterator[tuple[str, Section]]:
    """Yield every `name: {ros__parameters: …}`, under any namespace."""
    for key, value in node.entries:
        inner = value.get("ros__parameters")
        name = str(key.value).strip("/") or str(key.value)
        if inner is not None and inner.is_mapping:
            yield name, Section(name, inner)
        else:
            yield from _servers(value)
