"""Import of a Nav2 parameter file: its servers and sections, and which values were imported."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from missions.nav2.equivalents import Equivalent, Table
from missions.nav2.fitting import declared_for, fitted, lowered
from missions.nav2.reasons import STRUCTURE, reason
from missions.nav2.ros_nodes import CODE, RosNode, parameters_of
from stack.documents import Findings, Mark, Node
from stack.errors import ParameterError
from stack.parameters import Declaration

FITTED, REPLACED = "W112", "W113"
_SUBSTITUTION = "$("
"""What launch files replace begins with this."""


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
        """Return the value of a key; a key with dots names a nested one."""
        head, dot, rest = key.partition(".")
        found = self.node.get(head)
        section = None if found is None else Section(f"{self.path}.{head}", found)
        return section.get(rest) if section is not None and dot else section

    def texts(self, key: str) -> list[str]:
        """Return a list of names; a text is a list with blanks between its names."""
        part = self.get(key)
        if part is None:
            return []
        items = part.node.items if part.node.is_sequence else [part.node]
        return [word for item in items if isinstance(item.value, str)
                for word in item.value.split()]  # fmt: skip

    @property
    def plugin(self) -> str:
        """Class of the section's plugin, without its package."""
        part = self.get("plugin")
        return "" if part is None else class_name(part.node.value)

    @property
    def is_enabled(self) -> bool:
        """Whether `enabled` does not turn the section off."""
        switch = self.get("enabled")
        return switch is None or switch.node.value is not False


@dataclass
class ComponentValues:
    """Imported component and parameters of one kind, with their positions in the file."""

    use: str | None = None
    use_mark: Mark | None = None
    values: dict[str, Any] = field(default_factory=dict)
    marks: dict[str, Mark] = field(default_factory=dict)


class Importer:
    """Imports values of a Nav2 parameter file and keeps track of the values it ignored."""

    def __init__(self, nodes: Sequence[RosNode], findings: Findings) -> None:
        self.nodes, self.findings = nodes, findings
        self.kinds: dict[str, ComponentValues] = {}
        self.imported: list[Imported] = []
        self._seen: list[Node] = []

    def server(self, name: str) -> Section | None:
        """Return the parameters of a server."""
        found = parameters_of(name, self.nodes)
        return None if found is None else Section(*found)

    def use(self, kind: str, part: Section, name: str) -> None:
        """Choose the component for the plugin of a section."""
        chosen = self.kinds.setdefault(kind, ComponentValues())
        plugin = part if part.node.kind == "scalar" else part.get("plugin")
        chosen.use, chosen.use_mark = name, (plugin or part).node.mark
        if plugin is not None:
            self.record(plugin, kind, "use", name)

    def replace(self, kind: str, part: Section, sentence: str, hint: str = "") -> None:
        """Warn that a plugin has no equivalent; the sentence says what takes its place."""
        plugin = part if part.node.kind == "scalar" else part.get("plugin") or part
        self.kinds.setdefault(kind, ComponentValues()).use_mark = plugin.node.mark
        self.mark_seen(plugin)
        self.warn(REPLACED, plugin, sentence, hint)

    def copy(self, part: Section | None, kind: str, table: Table) -> None:
        """Import the parameters of a section that a table contains."""
        if part is None:
            return
        for key, equivalent in table.items():
            found = part.get(key)
            if found is not None:
                self.set(kind, found, equivalent)

    def set(self, kind: str, part: Section, equivalent: Equivalent) -> None:
        """Import one value; in another range the nearest one, or none."""
        target = self.kinds.setdefault(kind, ComponentValues())
        declared = declared_for(kind, target.use).get(equivalent.name)
        value = None if declared is None else self.value(part, equivalent.convert, declared)
        if value is None:
            return
        target.values[equivalent.name] = value
        target.marks[equivalent.name] = part.node.mark
        self.record(part, kind, equivalent.name, value)

    def copied(
        self, part: Section, what: str, table: Table, declared: Mapping[str, Declaration]
    ) -> dict[str, Any]:
        """Return the parameters of a section that belong to an item of a list.

        Args:
            part: the section.
            what: the list, for the listing: `costmap.layers`.
            table: the equivalents.
            declared: the parameters of the item.
        """
        found: dict[str, Any] = {}
        sources: dict[str, Section] = {}
        for key, equivalent in table.items():
            given = part.get(key)
            value = given and self.value(given, equivalent.convert, declared[equivalent.name])
            if given is not None and value is not None:
                found[equivalent.name], sources[equivalent.name] = value, given
                kind, _, name = what.partition(".")
                self.record(given, kind, f"{name}.{equivalent.name}", value)
        for name, (value, sentence) in lowered(found, declared).items():
            found[name] = value
            self.warn(FITTED, sources.get(name, part), sentence)
        return found

    def value(
        self, part: Section, convert: Callable[[Any], Any], declared: Declaration
    ) -> Any:  # fmt: skip
        """Return a converted value in the range of a parameter; None if there is none to import.

        A changed value adds a warning; one of the wrong type an error, as Nav2 refuses it too.
        """
        value = self.converted(part, convert)
        if value is None:
            return None
        try:
            nearest, sentence = fitted(declared, value)
        except ParameterError:
            self._refuse(part)
            return None
        if sentence:
            self.mark_seen(part)
            self.warn(FITTED, part, sentence)
        return nearest

    def converted(self, part: Section, convert: Callable[[Any], Any]) -> Any:
        """Return a converted value; None and a finding if it has none or its type is wrong."""
        raw = part.node.plain()
        if isinstance(raw, str) and _SUBSTITUTION in raw:
            self.mark_seen(part)
            sentence = f"{part.node.words()} is set by a launch file; the default is used"
            self.warn(FITTED, part, sentence, "write the value")
            return None
        try:
            return convert(raw)
        except (TypeError, ValueError, IndexError, KeyError):
            self._refuse(part)
            return None

    def warn(self, code: str, part: Section, sentence: str, hint: str = "") -> None:
        """Add a warning about a part of the file, with Nav2's name of it."""
        self.findings.add(code, part.node.mark, f"{part.path}: {sentence}", hint)

    def settle(self) -> None:
        """Lower the values that are above another one that they must not exceed."""
        for kind, chosen in self.kinds.items():
            changes = lowered(chosen.values, declared_for(kind, chosen.use))
            for name, (value, sentence) in changes.items():
                chosen.values[name] = value
                mark = chosen.marks.get(name) or next(iter(chosen.marks.values()))
                chosen.marks[name] = mark
                self.findings.add(FITTED, mark, f"{kind}.{name}: {sentence}")

    def mark_seen(self, part: Section) -> None:
        """Record that a value needs no entry in the list of ignored ones."""
        self._seen.append(part.node)

    def record(self, part: Section, kind: str, name: str, value: Any) -> None:
        """Record that a value was imported."""
        self._seen.append(part.node)
        self.imported.append(Imported(part.path, part.node.mark, kind, name, value))

    def ignored(self) -> Iterator[Ignored]:
        """Yield the parameters that were not imported, in the order of the file."""
        for node in self.nodes:
            found = self._ignored(Section(node.path, node.parameters))
            yield from (item for item in found if item.reason != STRUCTURE)

    def _refuse(self, part: Section) -> None:
        sentence = f"{part.path}: {part.node.words()} is not a value that Nav2 accepts"
        self.findings.add(CODE, part.node.mark, sentence)

    def _ignored(self, part: Section) -> Iterator[Ignored]:
        if any(part.node is node for node in self._seen):
            return
        if part.node.is_mapping:
            for key, value in part.node.entries:
                yield from self._ignored(Section(f"{part.path}.{key.value}", value))
        else:
            yield Ignored(part.path, part.node.mark, reason(part.path))
