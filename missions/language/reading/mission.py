"""Reads a mission file into a checked model and reports all findings at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from behaviours.catalogue import Catalogue
from missions.language.analysis.data_flow import (
    check_recursion,
    steps_of,
    warn_of_other_meaning,
)
from missions.language.analysis.failures import FailureCheck
from missions.language.analysis.key_flow import KeyFlowCheck, keys_changed_by
from missions.language.analysis.order import OrderCheck
from missions.language.analysis.outcomes import OutcomeCheck
from missions.language.analysis.repetition import RepetitionCheck
from missions.language.analysis.structure import StructureCheck
from missions.language.analysis.time_limits import TimeLimitCheck
from missions.language.case_model import Case
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Role, Scope, Symbol
from missions.language.foreign_words import MISSION_WORDS
from missions.language.keys import MISSION, RESERVED
from missions.language.model import Mission, Resources
from missions.language.reading.cases import CaseReader, MissionNames
from missions.language.reading.declarations import DeclarationReader, Layer, Overrides
from missions.language.reading.events import EventReader
from missions.language.reading.header import HeaderReader
from missions.language.reading.include import IncludeReader, TreeFile, tree_entries
from missions.language.reading.nodes import NodeReader
from missions.language.reading.robot import HeaderValues
from missions.language.reading.trees import read_bodies
from missions.language.reading.values import ValueReader
from missions.language.reading.words import Draft, Words
from missions.language.step import Event, Step, Tree
from stack.documents import Finding, Findings, Node, Section, read_document
from stack.errors import InputError
from stack.types import Pose2D

CatalogueFor = Callable[[list[Node], Path, Findings], Catalogue]
"""(nodes under `plugins`, folder of the mission, findings) -> catalogue."""


class FaultyMissionError(InputError):
    """A mission has errors, but its nodes could be read.

    Attributes:
        mission: the model without what has errors, for checks that need no more.
    """

    def __init__(self, findings: Sequence[Finding], mission: Mission) -> None:
        super().__init__(findings)
        self.mission = mission


def read_mission(
    path: Path, catalogue_for: CatalogueFor, resources: Resources | None = None,
    overrides: Overrides | None = None, draft: Draft | None = None,
) -> Mission:  # fmt: skip
    """Read a mission file and check it against the installed behaviours and resources.

    Args:
        path: the mission file; paths in it are relative to its folder.
        catalogue_for: returns the catalogue, plugins included.
        resources: worlds, robots, maps and components; by default they are not checked.
        overrides: argument -> value: a text from `--set`, or a node from a test case.
        draft: text to read instead of the file's, and a recorder of its words.

    Raises:
        FaultyMissionError: with all errors found.
        InputError: likewise, if there is no `run` that could be read.
    """
    keys = {**{word: word for word in (*MISSION, *RESERVED)}, **MISSION_WORDS}
    draft = draft or Draft()
    document = read_document(path, "mission", draft.text, (*MISSION, *RESERVED))
    top = Section(document, Findings(), "the mission", "E101", keys)
    draft.words.top(document, "mission", MISSION)
    reading = _Reading(top, path, resources or Resources(), draft.words)
    return reading.mission(catalogue_for, overrides or {})


class _Reading:
    def __init__(self, top: Section, path: Path, resources: Resources, words: Words) -> None:
        self.top, self.path, self.findings, self.words = top, path, top.findings, words
        self.header = HeaderReader(top, path.parent, resources, words)
        self.values = ValueReader(self.findings, words)
        self.declarations = DeclarationReader(self.values)
        self.includes = IncludeReader(self.declarations)

    def mission(self, catalogue_for: CatalogueFor, overrides: Overrides) -> Mission:
        header, top = self.header, self.top
        name, doc = header.text("mission"), header.text("doc", "")
        world = header.text("world", "") if header.is_replayed else header.text("world")
        header.unsupported()
        included = self.includes.combined(self.top.node_of("include"), self.path)
        places, keys, arguments = self._names(world, included.places, overrides)
        given = frozenset(name for name, value in overrides.items() if isinstance(value, str))
        header.values = HeaderValues(arguments, given, self.path.parent, self.findings, self.words)
        robot, replay = header.robot()
        start = header.pose("start", places, ())
        initial_pose = header.pose("initial_pose", places, MISSION["initial_pose"].words)
        files, plugins = header.texts("parameters"), header.texts("plugins")
        map_name, markers = header.map(), header.markers()
        faults = header.faults(places)
        components = header.components(files, mapped=map_name != "none")
        self.values.used.update(dict.fromkeys(header.values.used))
        self.words.scope = scope = Scope((places, keys, arguments), header.knows_places)
        self.words.catalogue = catalogue = self._catalogue(catalogue_for, plugins)
        trees = self._trees(catalogue, scope, included)
        nodes = NodeReader(self.values, catalogue, trees)
        run = top.node_of("run", required=True)
        root = nodes.read(run, NameContext(scope)) if run else None
        events = EventReader(nodes).events(top.node_of("events"), NameContext(scope))
        tests = top.node_of("tests")
        top.done()
        roots = (*(_starts(root, events) if root else ()), *_roots_of(trees))
        names = MissionNames(self.declarations.declared, places, keys, events, trees, roots)
        of_cases = Findings()
        cases = CaseReader(names, of_cases, self.words).cases(tests)
        key_flow = self._analyse(root, events, trees, scope, cases)
        if not self.findings.errors:  # otherwise cases are read for their words only
            self.findings.items += of_cases.items
        if key_flow is not None:
            key_flow.keys(keys, cases)
        if root is None:
            raise InputError(self.findings.errors)
        warnings = sorted(self.findings.warnings, key=lambda item: item.mark)
        mission = Mission(
            name=name, source=self.path, root=root, robot=robot, world=world, doc=doc,
            start=start if isinstance(start, Pose2D) else None, map=map_name,
            initial_pose=initial_pose or "start", components=components,
            parameter_files=tuple(item.value for item in files),
            plugins=tuple(item.value for item in plugins),
            places={key: symbol.value for key, symbol in places.items()},
            arguments={key: symbol.value for key, symbol in arguments.items()},
            blackboard=keys, trees=trees, events=events, cases=cases, warnings=tuple(warnings),
            includes=tuple(self.includes.files), replay=replay, markers=markers, faults=faults,
        )  # fmt: skip
        if self.findings.errors:
            raise FaultyMissionError(self.findings.errors, mission)
        return mission

    def _names(
        self, world: str, included: Layer, overrides: Overrides
    ) -> tuple[Layer, Layer, Layer]:
        node = self.top.node
        at = node.get("world")
        where = at.mark if at else node.mark
        places = self.declarations.places(None, self.header.world_places(world), where)
        own = self.declarations.places(self.top.node_of("places"), {}, where)
        self.includes.merge(dict(included), own, "place")
        places.update({**included, **own})
        place_scope = Scope((places,), self.header.knows_places)
        keys = self.declarations.blackboard(self.top.node_of("blackboard"), place_scope)
        arguments = self.declarations.arguments(
            self.top.node_of("arguments"), place_scope, overrides
        )
        scope = Scope((places, keys, arguments))
        for symbol in (*keys.values(), *arguments.values()):
            hiding = scope.lookup(symbol.name)
            if hiding is not None and hiding is not symbol:
                sentence = f"the {hiding.role} {symbol.name!r} hides this {symbol.role}"
                self.findings.add("W101", symbol.mark, sentence)
        return places, keys, arguments

    def _catalogue(self, catalogue_for: CatalogueFor, plugins: list[Node]) -> Catalogue:
        try:
            return catalogue_for(plugins, self.path.parent, self.findings)
        except InputError as error:
            mark = plugins[0].mark if plugins else self.top.node.mark
            if not error.findings:
                self.findings.add("E110", mark, str(error))
            self.findings.items += error.findings
            # Without its plugins the nodes of a mission cannot be checked.
            raise InputError(self.findings.errors) from error

    def _trees(self, catalogue: Catalogue, scope: Scope, included: TreeFile) -> dict[str, Tree]:
        """Return all trees with their nodes, the mission's own first."""
        section = self.top.node_of("trees")
        if section is not None and not section.is_mapping and section.value is not None:
            self.findings.add(
                "E101", section.mark, f"trees must be a mapping, got {section.words()}",
                "write `name: {do: …}` for each, without `- `",
            )  # fmt: skip
        own = tree_entries(section)
        trees = {str(key.value): self.declarations.tree(key, node, scope) for key, node in own}
        self.includes.merge_trees(dict(included.trees), trees)
        trees = {**trees, **included.trees, **trees}
        self.words.trees = trees
        read_bodies(own, NodeReader(self.values, catalogue, trees), scope, trees)
        for file in self.includes.files.values():
            reader = NodeReader(self.values, catalogue, file.trees)
            read_bodies(file.bodies, reader, Scope((file.places,)), trees)
        return trees

    def _analyse(
        self,
        root: Step | None,
        events: tuple[Event, ...],
        trees: dict[str, Tree],
        scope: Scope,
        cases: Sequence[Case],
    ) -> KeyFlowCheck | None:
        """Run the analyses that need a mission without errors; return who reads which key."""
        if root is None or self.findings.errors:
            return None
        starts = _starts(root, events)
        reached = set(check_recursion(trees, starts, self.findings))
        file = self.top.node.mark.file
        own = {name: tree for name, tree in trees.items() if tree.mark.file == file}
        for tree in own.values():
            if tree.name not in reached:
                self.findings.add("W103", tree.mark, f"the tree {tree.name!r} is never used")
        if self.findings.errors:
            return None
        changed = keys_changed_by(cases)
        order = OrderCheck(
            trees, self.findings, [key for key in scope.symbols() if key.name in changed]
        )
        order.mission(root, events)
        roots = [*starts, *_roots_of(trees)]
        for use in (step for root in roots for step in steps_of(root)):
            if use.uses in own:
                warn_of_other_meaning(use, own[use.uses], scope, self.findings)
        outcomes = OutcomeCheck(trees, self.findings, order.verdicts.dead_waits())
        for step in roots:
            outcomes.step(step)
        TimeLimitCheck(trees, self.findings).mission(root, events)
        RepetitionCheck(trees, self.findings, outcomes).mission(root, events, roots)
        StructureCheck(trees, self.findings).mission(root, events, roots)
        FailureCheck(trees, self.findings).mission(root, events)
        key_flow = KeyFlowCheck(self.findings, order)
        nested = [event for tree in trees.values() for event in tree.events]
        key_flow.mission(roots, (*events, *nested))
        self._unused(trees, scope)
        return key_flow

    def _unused(self, trees: dict[str, Tree], scope: Scope) -> None:
        declared: list[Symbol] = [
            symbol for symbol in scope.symbols() if symbol.role is not Role.PLACE
        ]
        for tree in trees.values():
            declared += [*tree.inputs.values(), *tree.outputs.values()]
        for symbol in declared:
            touched = self.values.used
            if symbol.role is Role.OUTPUT:
                touched = self.values.written
            if symbol not in touched:
                verb = "never written" if symbol.role is Role.OUTPUT else "never used"
                sentence = f"the {symbol.role} {symbol.name!r} is {verb}"
                self.findings.add("W102", symbol.mark, sentence)


def _starts(root: Step, events: tuple[Event, ...]) -> list[Step]:
    """Return the roots that run without a `use`: the mission and its events."""
    return [root, *(event.step for event in events)]


def _roots_of(trees: dict[str, Tree]) -> list[Step]:
    return [step for tree in trees.values() for step in tree.roots]
