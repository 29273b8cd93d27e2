"""Reader of the top-level keys of a mission: robot, world, map, components and others."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from missions.language.component_layers import layered
from missions.language.expressions.scope import Symbol
from missions.language.keys import FAULT, MISSION, RESERVED
from missions.language.model import Component, Replay, Resources
from missions.language.reading.include import BESIDE
from missions.language.reading.port_expressions import reference_name
from missions.language.reading.robot import HeaderValues, RobotReader
from missions.language.reading.words import WordRole, Words
from stack.documents import Findings, Mark, Node, Section, read_file, require_kind
from stack.documents.file_kinds import PARAMETERS
from stack.errors import InputError, ParameterError
from stack.parameters import Declaration, suggestion
from stack.sim.faults.planned import PlannedFault
from stack.types import Pose2D

FORMAT = 1
NAV2 = "nav2_params"
LOCALISATION, ODOMETRY = "localisation", "odometry"
TOP_COMPONENTS = (LOCALISATION, ODOMETRY)
"""Components that stand at the top of a mission, beside `navigation`."""

T = TypeVar("T")


class HeaderReader:
    """Reads single top-level keys of a mission.

    Attributes:
        knows_places: False if the world could not be read.
    """

    def __init__(self, top: Section, folder: Path, resources: Resources, words: Words) -> None:
        self.top, self.folder, self.resources, self.words = top, folder, resources, words
        self.findings: Findings = top.findings
        self.values = HeaderValues({}, frozenset(), folder, top.findings, words)
        self.knows_places = True

    def text(self, key: str, default: str | None = None) -> str:
        """Return a key that holds a text; without a default it is required and a name."""
        if default is None:
            return self.top.name(Declaration(key, str))
        return self.top.value(Declaration(key, str, default=default)) or ""

    def unsupported(self) -> None:
        """Report reserved keys, keys that belong under `navigation`, and an unsupported format."""
        for key, _ in self.top.node.entries:
            word = str(key.value)
            if word in {*self.resources.navigation_kinds, NAV2} - set(MISSION):
                self.top.node_of(word)
                sentence = f"`{word}` does not belong to the top of a mission"
                self.findings.add("E101", key.mark, sentence, "write it under `navigation`")
        for word in RESERVED:
            if self.top.node_of(word) is not None:
                key = next(key for key, _ in self.top.node.entries if key.value == word)
                sentence = f"`{word}` is not supported yet; it is reserved for a later version"
                self.findings.add("E104", key.mark, sentence)
        node = self.top.node_of("format")
        if node is not None and (node.value != FORMAT or isinstance(node.value, bool)):
            sentence = f"this version reads format {FORMAT}, got {node.words()}"
            self.findings.add("E105", node.mark, sentence, f"write format: {FORMAT}")

    def world_places(self, world: str) -> Mapping[str, Pose2D]:
        """Return the named poses of the world."""
        if not world:
            return {}
        places = self._ask("world", lambda: self.resources.world_places(world, self.folder), None)
        self.knows_places = places is not None
        return places or {}

    @property
    def is_replayed(self) -> bool:
        """Whether `robot` has settings: a log is played."""
        node = self.top.node.get("robot")
        return node is not None and node.is_mapping

    def robot(self) -> tuple[str, Replay | None]:
        """Return the robot, checked, and the log that is replayed; `values` must be set."""
        node = self.top.node_of("robot")
        replay = None
        if self.is_replayed and node is not None:
            name, replay = RobotReader(self.values).replay(node)
        else:
            name = self.text("robot")
        self.check_robot(name)
        return name, replay

    def check_robot(self, robot: str) -> None:
        """Report a robot that does not exist or is invalid."""
        if robot:
            self._ask("robot", lambda: self.resources.check_robot(robot, self.folder), None)

    def map(self) -> str:
        """Return `from_world`, `none` or a file; without a world `none` is the default."""
        has_world = self.top.node.get("world") is not None
        named = self.top.node_of("map")
        if named is not None and reference_name(named) is not None:
            path = self.values.path(named)
            if path is None:
                return "none"
            # Like a name in the file, it is relative to the mission's folder.
            place = str(path if path.is_absolute() else path.relative_to(self.folder))
            self._ask("map", lambda: self.resources.check_map(place, self.folder), None)
            return place
        name = self.text("map", "from_world" if has_world else "none")
        if name == "from_world" and not has_world:
            node = self.top.node.get("map") or self.top.node
            hint = "write `map: none` or the path of a map.yaml"
            self.findings.add("E101", node.mark, "map: from_world needs a `world`", hint)
        if name not in MISSION["map"].words:
            self._ask("map", lambda: self.resources.check_map(name, self.folder), None)
        return name

    def markers(self) -> str:
        """Return `from_world`, `none` or a map of markers; empty if the mission does not say."""
        name = self.text("markers", "")
        if name and name not in MISSION["markers"].words:
            self._ask("markers", lambda: self.resources.check_markers(name, self.folder), None)
        return name

    def pose(
        self, key: str, places: Mapping[str, Symbol], words: tuple[str, ...]
    ) -> Pose2D | str | None:
        """Return a place's pose, a pose or one of `words`; None if absent or invalid."""
        node = self.top.node_of(key)
        if node is None or node.value in words:
            return node.value if node else None
        if isinstance(node.value, str):
            name = reference_name(node) or node.value
            if name not in places:
                if self.knows_places:
                    sentence = f"{key}: there is no place {name!r}"
                    hint: str = suggestion(name, [*places, *words])
                    if re.fullmatch(r"[-\d.]+\s*,[-\d\s.,]+", name):
                        hint = f"write [{name}]"
                    self.findings.add("E106", node.mark, sentence, hint)
                return None
            pose: Pose2D = places[name].value
            return pose
        try:
            read: Pose2D = Declaration(key, Pose2D).read(node.plain())
        except ParameterError as error:
            self.findings.add("E106", node.mark, str(error), error.hint)
            return None
        return read

    def faults(self, places: Mapping[str, Symbol]) -> tuple[PlannedFault, ...]:
        """Return the faults that the mission declares."""
        nodes = self.top.sequence("faults")
        for node in nodes:
            if not node.is_mapping:
                self.words.add(node, WordRole.FAULT)
            for key, value in node.entries:
                is_kind = key.value not in FAULT
                self.words.add(
                    key, WordRole.FAULT if is_kind else WordRole.SECTION_KEY, owner="fault"
                )
                for name, _ in value.entries if is_kind else ():
                    self.words.add(name, WordRole.PARAMETER, owner=str(key.value))
        poses = {name: symbol.value for name, symbol in places.items()}
        return self.resources.faults(nodes, self.findings, poses) if nodes else ()

    def texts(self, key: str) -> list[Node]:
        """Return the items of a list of texts."""
        good = []
        for item in self.top.sequence(key):
            if isinstance(item.value, str) and item.value:
                good.append(item)
            else:
                sentence = f"{key} must be a list of texts, got {item.words()}"
                self.findings.add("E101", item.mark, sentence)
        return good

    def components(self, files: list[Node], *, mapped: bool) -> dict[str, Component]:
        """Return checked components by kind: parameter files in order, then the mission's own.

        Args:
            files: the names of the parameter files.
            mapped: whether the mission has a map.
        """
        accepted = self.resources.accepted_parameters
        located: dict[str, Component] = {}
        plugged: Mapping[str, Mapping[str, str]] | None = None
        nodes = [self._parameter_file(item) for item in files]
        sources = [found for node in nodes for found in (self._from_nav2(node), self._all(node))]
        own = self.top.node_of("navigation")
        sources += [self._from_nav2(own), self._navigation(own), self._top_components()]
        for found in sources:
            for kind, component in found.items():
                if plugged is None:
                    plugged = self._plugged_components()
                before = located.get(kind)
                located[kind], dropped = layered(before, _located(component, plugged), accepted)
                if dropped is not None:
                    self.findings.items.append(dropped)
                # Each file separately: a later one may hide its errors.
                self._check(located[kind], mapped=mapped)
        return located

    def _plugged_components(self) -> Mapping[str, Mapping[str, str]]:
        """Return the components defined in the mission's plugins."""
        plugins = [item.value for item in self.texts("plugins")]
        ask = self.resources.plugged_components
        return self._ask("plugins", lambda: ask(plugins, self.folder), {}) if plugins else {}

    def _parameter_file(self, item: Node) -> Node | None:
        try:
            return require_kind(read_file(self.folder / item.value, PARAMETERS), PARAMETERS)
        except InputError as error:
            self._add(error, item.mark, "E110")
            return None

    def _top_components(self) -> dict[str, Component]:
        """Return the estimator and the odometry that the mission itself chooses, if it does."""
        found: dict[str, Component] = {}
        for kind in TOP_COMPONENTS:
            node = self.top.node_of(kind)
            if node is None:
                continue
            self._component_words(kind, node)
            component = self._component(kind, node)
            if component is not None:
                found[kind] = component
        return found

    def _navigation(self, node: Node | None) -> dict[str, Component]:
        """Return the components under `navigation`; those of the top are refused there."""
        if node is not None and not node.is_mapping:
            self.words.add(node, WordRole.COMPONENT_KIND)
        for key, value in node.entries if node is not None else []:
            self.words.add(key, WordRole.COMPONENT_KIND)
            self._component_words(str(key.value), value)
        found = self._all(node)
        for kind in TOP_COMPONENTS:
            misplaced = found.pop(kind, None)
            if misplaced is not None:
                sentence = f"`{kind}` does not belong to `navigation`"
                hint = "write it beside `navigation`, at the top of the mission"
                self.findings.add("E111", misplaced.mark, sentence, hint)
        return found

    def _component_words(self, kind: str, node: Node) -> None:
        if not node.is_mapping:
            self.words.add(node, WordRole.COMPONENT, owner=kind)
        use = node.get("use")
        chosen = f"{kind} {use.value if use else ''}".strip()
        for name, given in node.entries:
            self.words.add(name, WordRole.PARAMETER, owner=chosen)
            if name.value == "use":
                self.words.add(given, WordRole.COMPONENT, owner=kind)

    def _all(self, node: Node | None) -> dict[str, Component]:
        """Return the components of a section or of a parameter file."""
        if node is None or node.value is None:
            return {}
        if not node.is_mapping:
            sentence = f"components must be a mapping {{kind: name}}, got {node.words()}"
            self.findings.add("E101", node.mark, sentence)
        found: dict[str, Component] = {}
        for key, value in node.entries:
            if key.value == NAV2:
                continue
            component = self._component(str(key.value), value)
            if component is not None:
                found[component.kind] = component
        return found

    def _from_nav2(self, node: Node | None) -> Mapping[str, Component]:
        """Return the components of the Nav2 parameter file that a section refers to."""
        file = node.get(NAV2) if node is not None else None
        if file is None:
            return {}
        namespace: str | None = None
        if file.is_mapping:
            section = Section(file, self.findings, NAV2, "E101", ("file", "namespace"))
            namespace = section.value(Declaration("namespace", str | None, default=None))
            file = section.node_of("file", required=True)
            section.done()
        if file is None:
            return {}
        if not isinstance(file.value, str) or not file.value:
            sentence = f"{NAV2} must be the name of a file, got {file.words()}"
            hint = "write FILE, or {file: FILE, namespace: /robot}"
            self.findings.add("E101", file.mark, sentence, hint)
            return {}
        try:
            ask = self.resources.nav2_components
            components, warnings = ask(file.value, namespace, self.folder)
        except InputError as error:
            self._add(error, file.mark, "E110")
            return {}
        self.findings.items.extend(warnings)
        return components

    def _component(self, kind: str, node: Node) -> Component | None:
        if isinstance(node.value, str):
            return Component(kind, node.value, node.mark)
        use = node.get("use")
        if not node.is_mapping or (use is not None and not isinstance(use.value, str)):
            where = use or node
            sentence = (
                f"{kind} must be a name or {{use: name, parameter: value}}, got {where.words()}"
            )
            self.findings.add("E101", where.mark, sentence)
            return None
        rest = [(key, value) for key, value in node.entries if key.value != "use"]
        return Component(
            kind, use.value if use else None, use.mark if use else node.mark,
            {str(key.value): self.values.plain(value) for key, value in rest},
            {str(key.value): value.mark for key, value in rest},
        )  # fmt: skip

    def _check(self, component: Component, *, mapped: bool) -> None:
        try:
            self.resources.check_component(component.kind, component.use, component.values, mapped)
        except ParameterError as error:
            mark = component.marks.get(error.name, component.mark)
            self.findings.add("E111", mark, str(error), error.hint)
        except InputError as error:
            self._add(error, component.mark, "E111")

    def _ask(self, key: str, ask: Callable[[], T], otherwise: T) -> T:
        node = self.top.node.get(key)
        mark = node.mark if node else self.top.node.mark
        try:
            return ask()
        except InputError as error:
            self._add(error, mark, "E110")
        except ParameterError as error:
            self.findings.add("E110", mark, str(error), error.hint)
        except OSError as error:  # such as a name longer than the file system allows
            self.findings.add("E110", mark, f"{key}: {error.strerror}")
        return otherwise

    def _add(self, error: InputError, mark: Mark, code: str) -> None:
        """Add the findings of another reader; report a missing file where it is named."""
        if not error.findings:
            self.findings.add(code, mark, error.sentence, error.hint)
        for item in error.findings:
            if item.code == "E001":
                sentence = f"{item.mark.file}: {item.sentence}"
                self.findings.add(code, mark, sentence, item.hint or BESIDE)
            else:
                self.findings.items.append(item)


def _located(component: Component, plugged: Mapping[str, Mapping[str, str]]) -> Component:
    """Replace the name of a component from a plugin by its location."""
    known = plugged.get(component.kind, {})
    layers = plugged.get("costmap_layer", {})
    values = dict(component.values)
    if layers and isinstance(values.get("layers"), list):
        values["layers"] = [_located_layer(item, layers) for item in values["layers"]]
    return replace(component, use=known.get(component.use or "", component.use), values=values)


def _located_layer(item: Any, layers: Mapping[str, str]) -> Any:
    if isinstance(item, dict):
        name = str(item.get("use"))
        return {"name": name, **item, "use": layers[name]} if name in layers else item
    return {"name": item, "use": layers[item]} if item in layers else item
