"""A checked mission: what the reader makes of a file and the compiler makes a tree of."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from behaviours.catalogue import BehaviourKind
from missions.language.case_model import Case
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import Symbol
from stack.documents import Finding, Mark
from stack.types import Pose2D


class Catalogue(Protocol):
    """The behaviours that are installed, as behaviours.catalogue.Catalogue has them."""

    def names(self) -> Iterable[str]:
        """Every word that may stand for a behaviour, dotted names left out."""
        ...

    def get(self, name: str) -> BehaviourKind | None:
        """The behaviour of a word, or of a dotted name of a py_trees class."""
        ...

    def why_not(self, name: str) -> str:
        """Why `get` has none, in a sentence."""
        ...


def _anything_goes(*_: Any) -> None:
    """Stands for a check that the caller does not want."""


@dataclass(frozen=True, slots=True)
class Resources:
    """What a mission refers to outside its file. Each callable raises InputError or ParameterError.

    Attributes:
        world_places: (world as written, mission's folder) -> the world's named poses.
        check_robot: (robot as written, mission's folder).
        check_map: (map as written, mission's folder); not asked for `from_world` and `none`.
        check_component: (kind, name or None for the default, raw parameters).
        plugged_components: (plugins as written, mission's folder) -> the components in them: kind
            -> name -> where it is, as the other callables take it instead of a name.
        nav2_components: (a parameter file of Nav2 as written, mission's folder) -> the components
            that it chooses, by kind, and warnings of what it says in vain.
    """

    world_places: Callable[[str, Path], Mapping[str, Pose2D]] = lambda name, beside: {}
    check_robot: Callable[[str, Path], None] = _anything_goes
    check_map: Callable[[str, Path], None] = _anything_goes
    check_component: Callable[[str, str | None, Mapping[str, Any]], None] = _anything_goes
    plugged_components: Callable[[Sequence[str], Path], Mapping[str, Mapping[str, str]]] = (
        lambda plugins, beside: {}
    )
    nav2_components: Callable[[str, Path], tuple[Mapping[str, Component], Sequence[Finding]]] = (
        lambda file, beside: ({}, ())
    )


@dataclass(frozen=True, slots=True)
class Component:
    """A choice under `navigation`, raw: `{use: astar, allow_unknown: true}`.

    Attributes:
        use: the component's name; None leaves it to the robot or the default.
        values: parameters as they stand in the file.
        marks: where each parameter stands.
    """

    kind: str
    use: str | None
    mark: Mark
    values: Mapping[str, Any] = field(default_factory=dict)
    marks: Mapping[str, Mark] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Constant:
    """A value known before the mission runs; `text` is what stands in the file."""

    value: Any
    text: str = ""


@dataclass(frozen=True, slots=True)
class Reference:
    """The value that a symbol has at the moment."""

    symbol: Symbol


@dataclass(frozen=True, slots=True)
class ListValue:
    """A list with references in it, put together when it is read."""

    items: tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class Template:
    """A text with values in it, put together when it is read; `text` is what stands in the file."""

    parts: tuple[str | CheckedExpression, ...]
    text: str

    @property
    def expressions(self) -> tuple[CheckedExpression, ...]:
        """What is filled in, in order."""
        return tuple(part for part in self.parts if isinstance(part, CheckedExpression))


@dataclass(frozen=True, slots=True)
class ExpressionValue:
    """An expression handed to a behaviour."""

    expression: CheckedExpression


@dataclass(frozen=True, slots=True)
class AssignmentList:
    """What `set` writes."""

    assignments: tuple[tuple[Symbol, CheckedExpression], ...]


Value = Constant | Reference | ListValue | Template | ExpressionValue | AssignmentList


@dataclass(frozen=True, slots=True)
class Retry:
    """`retry: {attempts: 3, delay: 500 ms}`."""

    attempts: Value
    delay: Value


@dataclass(frozen=True, slots=True)
class Recover:
    """`recover: {attempts: 4, unless: …, round_robin: […]}`."""

    attempts: Value
    unless: CheckedExpression | None
    recoveries: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Modifiers:
    """What stands beside a node's type; None where nothing does.

    Attributes:
        keep_going: `on_failure: continue`.
        repeat: how often; Constant(None) is for ever.
        every: least time between two starts.
    """

    when: CheckedExpression | None = None
    while_: CheckedExpression | None = None
    keep_going: bool = False
    repeat: Value | None = None
    recover: Recover | None = None
    retry: Retry | None = None
    timeout: Value | None = None
    every: Value | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """One node of a mission file.

    Attributes:
        kind: the word that names its type.
        mark: where that word stands.
        name: its label, "" when it has none.
    """

    kind: str
    mark: Mark
    name: str
    modifiers: Modifiers


@dataclass(frozen=True, slots=True)
class Leaf(Step):
    """A behaviour with its ports and where its outputs go."""

    behaviour: BehaviourKind
    ports: Mapping[str, Value]
    outputs: Mapping[str, Symbol]


@dataclass(frozen=True, slots=True)
class Composite(Step):
    """sequence, reactive, fallback, reactive_fallback, round_robin or parallel.

    Attributes:
        needed: of a parallel, how many children must succeed.
    """

    children: tuple[Step, ...]
    needed: int = 0


@dataclass(frozen=True, slots=True)
class ForEach(Step):
    """`for_each: {variable: items}` with `do`; `skip_failures` is `on_failure: continue`."""

    variable: Symbol
    items: Value
    skip_failures: bool
    child: Step


@dataclass(frozen=True, slots=True)
class FollowWaypoints(ForEach):
    """`follow_waypoints: $waypoints`: for each a drive and then what stands under `do`.

    Attributes:
        number: the variable that counts the waypoints, from 1.
        driven: where the drive's length goes, metres; nothing that a mission can name.
        outputs: where missed, reached and distance go.
    """

    number: Symbol
    driven: Symbol
    outputs: Mapping[str, Symbol]


@dataclass(frozen=True, slots=True)
class Use(Step):
    """A tree of this file, with what goes in and where its results go."""

    tree: str
    inputs: Mapping[str, Value]
    outputs: Mapping[str, Symbol]


@dataclass(frozen=True, slots=True)
class Event:
    """One entry of `events`: what pre-empts `run` when.

    Attributes:
        hold: seconds for which `when` must have been true.
        step: what is done.
        then: resume | restart | abort.
    """

    name: str
    mark: Mark
    when: CheckedExpression
    hold: Value
    step: Step
    then: str


@dataclass(frozen=True, slots=True)
class Tree:
    """One entry of `trees`, of the mission's file or of an included one."""

    name: str
    mark: Mark
    inputs: Mapping[str, Symbol]
    outputs: Mapping[str, Symbol]
    root: Step | None = None


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission that has been read and checked.

    Attributes:
        robot, world, map: as written; paths are relative to `source`'s folder.
        start: the simulated truth; None is the world's own start.
        initial_pose: the robot's belief: `start`, `unknown` or a pose.
        places: the world's and the mission's own, map frame.
        arguments: name -> value in force.
        blackboard: the declared keys with type and initial value.
        cases: what `treepilot test` runs.
        events: what pre-empts `run`, the most important first.
        trees: by name, included ones too.
        includes: the files that it includes, and those that they include.
        parameter_files: as written, already merged into `navigation`.
        warnings: what is probably not meant.
    """

    name: str
    source: Path
    root: Step
    robot: str
    world: str
    doc: str = ""
    start: Pose2D | None = None
    map: str = "from_world"
    initial_pose: Pose2D | str = "start"
    navigation: Mapping[str, Component] = field(default_factory=dict)
    parameter_files: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    places: Mapping[str, Pose2D] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    blackboard: Mapping[str, Symbol] = field(default_factory=dict)
    trees: Mapping[str, Tree] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    cases: tuple[Case, ...] = ()
    includes: tuple[Path, ...] = ()
    warnings: tuple[Finding, ...] = ()
