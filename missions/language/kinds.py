"""Registry of node kinds: the words that can stand as the type of a node, besides behaviours.

The reader, the checks, the compiler, schemas, the language server, the tables of docs/language.md,
`treepilot describe` and the drawings of trees take their facts about a kind from here. A behaviour
is described by its class (behaviours.catalogue). tests/missions/language/test_registry.py fails if
a kind is missing in one of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum, auto

from missions.language.expressions.value_types import INT, POSE, ValueType
from stack.parameters import Declaration
from stack.types import Pose2D


class Shape(StrEnum):
    """What a node has below it."""

    CHILDREN = auto()
    """A list of nodes."""
    LOOP = auto()
    """One node under `do`, run for each item."""
    TREE = auto()
    """The root of the tree that it names."""
    CASES = auto()
    """One node for each case."""
    NOTHING = auto()
    CHILD = auto()
    """One node that it controls; made by a modifier or an event."""


class Outline(StrEnum):
    """Outline of a node in drawings by Graphviz."""

    BOX = auto()
    OCTAGON = auto()
    PARALLELOGRAM = auto()
    HEXAGON = auto()
    FOLDER = auto()
    HOUSE = auto()
    ELLIPSE = auto()


@dataclass(frozen=True, slots=True)
class NodeKind:
    """One kind of node.

    Attributes:
        word: as written in a mission, and as the kind of a row of the tree.
        glyph: one character in the dashboard.
        factory: name of its class in missions.trees.
        keeps: what it remembers from one tick to the next.
        ports, outputs: declarations of its ports and outputs.
        variables: types of the variables that its child sees.
        goes_on_after: the outcome of a child after which the next child runs: "success", "failure",
            or "" if the children have no order.
        handles_failure: whether a child may run after the failure of another: it sees `error`, and
            a skipped child counts as failed.
        empty: why its children never started although it was reached; "" if that depends on them.
        takes_outputs: whether `out` can stand beside it.
        takes_inputs: whether `with` can stand beside it.
    """

    word: str
    doc: str
    shape: Shape
    glyph: str
    outline: Outline
    factory: str
    keeps: str = ""
    ports: Mapping[str, Declaration] = field(default_factory=dict)
    outputs: Mapping[str, Declaration] = field(default_factory=dict)
    variables: Mapping[str, ValueType] = field(default_factory=dict)
    goes_on_after: str = ""
    handles_failure: bool = False
    empty: str = ""
    takes_outputs: bool = False
    takes_inputs: bool = False

    @property
    def is_loop(self) -> bool:
        """Whether it runs `do` for each item; its `on_failure` applies to each item."""
        return self.shape is Shape.LOOP


FOLLOW_WAYPOINTS = "follow_waypoints"

_WAYPOINT_PORTS = (
    Declaration("waypoints", list[Pose2D], "poses to drive to in order, map frame"),
    Declaration(
        "tolerance", float | None, "goal tolerance; default: the robot's",
        unit="m", default=None, above=0.0,
    ),
    Declaration(
        "time_limit", float | None, "time limit of the drive to each waypoint; default: none",
        unit="s", default=None, above=0.0,
    ),
)  # fmt: skip
_WAYPOINT_OUTPUTS = (
    Declaration("missed", list[int], "numbers of the missed waypoints, from 1"),
    Declaration("reached", int, "number of waypoints where drive and `do` succeeded"),
    Declaration("distance", float, "distance driven to the waypoints", "m"),
)

_WORDS = (
    NodeKind(
        "sequence",
        "children in order until one fails; the next tick resumes at the running child",
        Shape.CHILDREN, "→", Outline.BOX, "Sequence",
        keeps="the running child", goes_on_after="success",
    ),
    NodeKind(
        "reactive", "as `sequence`, but every tick starts at the first child",
        Shape.CHILDREN, "⇉", Outline.BOX, "ReactiveSequence", goes_on_after="success",
    ),
    NodeKind(
        "fallback",
        "children in order until one succeeds; the next tick resumes at the running child",
        Shape.CHILDREN, "?", Outline.OCTAGON, "Fallback",
        keeps="the running child", goes_on_after="failure", handles_failure=True,
    ),
    NodeKind(
        "reactive_fallback", "as `fallback`, but every tick starts at the first child",
        Shape.CHILDREN, "⁇", Outline.OCTAGON, "ReactiveFallback",
        goes_on_after="failure", handles_failure=True,
    ),
    NodeKind(
        "parallel",
        "all children at once; `{succeed_on: all | one | N, do: […]}` or a list",
        Shape.CHILDREN, "∥", Outline.PARALLELOGRAM, "Parallel",
        keeps="the results of the children that have ended",
    ),
    NodeKind(
        "round_robin", "one child per run, in rotation; tries the others after a failure",
        Shape.CHILDREN, "↻", Outline.OCTAGON, "RoundRobin",
        keeps="the child whose turn is next", handles_failure=True,
    ),
    NodeKind(
        "for_each",
        "`do` once per item: `{for_each: {shelf: $shelves}, do: …}`; with "
        "`on_failure: continue` it continues after an item that fails",
        Shape.LOOP, "∀", Outline.HEXAGON, "ForEach", keeps="the list and the current item",
        empty="the list was empty",
    ),
    NodeKind(
        FOLLOW_WAYPOINTS,
        "drives to poses in order and runs `do` (optional) at each; with "
        "`on_failure: continue` a failed waypoint counts as missed and the next one follows",
        Shape.LOOP, "⚑", Outline.HEXAGON, "FollowWaypoints",
        keeps="the list, the current waypoint and the missed ones", empty="the list was empty",
        ports={item.name: item for item in _WAYPOINT_PORTS},
        outputs={item.name: item for item in _WAYPOINT_OUTPUTS},
        variables={"waypoint": POSE, "waypoint_number": INT}, takes_outputs=True,
    ),
    NodeKind(
        "use", "a tree of this file: `{use: inspect, with: {…}, out: {…}}`",
        Shape.TREE, "▣", Outline.FOLDER, "Subtree", takes_outputs=True, takes_inputs=True,
    ),
    NodeKind(
        "switch",
        "the node of one case, chosen at the start: `{switch: {value: $mode, cases: {fast: …, "
        "slow: …}, default: …}}`; without a case and a `default` it fails (CHECK_FAILED)",
        Shape.CASES, "⑂", Outline.OCTAGON, "Switch", keeps="the chosen case",
        empty="another case was chosen",
    ),
    NodeKind(
        "unset", "removes the values of keys without `initial`: `unset: $photo` or a list",
        Shape.NOTHING, "∅", Outline.ELLIPSE, "LeafNode",
    ),
)  # fmt: skip

NODES: Mapping[str, NodeKind] = {kind.word: kind for kind in _WORDS}
"""Kinds of nodes that a mission can name, besides behaviours."""

_CONTROLS = (
    NodeKind("when", "skips its node if its condition is false at the start",
             Shape.CHILD, "⊳", Outline.HEXAGON, "When", empty="its `when` was not true"),
    NodeKind("finally", "runs another node however its node ends, also when it is halted",
             Shape.CHILDREN, "⊣", Outline.HEXAGON, "Finally", keeps="the outcome of its node",
             empty="its node has not ended"),
    NodeKind("on_failure", "turns a failure of its node into a success",
             Shape.CHILD, "⊘", Outline.HEXAGON, "OnFailure"),
    NodeKind("while", "halts its node and fails if its condition is false",
             Shape.CHILD, "⊚", Outline.HEXAGON, "While", empty="its `while` was not true"),
    NodeKind("invert", "turns the success of its node into a failure and the reverse",
             Shape.CHILD, "¬", Outline.HEXAGON, "Invert"),
    NodeKind("repeat", "runs its node again after a success",
             Shape.CHILD, "⟳", Outline.HEXAGON, "Repeat", keeps="the number of runs"),
    NodeKind("recover", "after a failure of its node runs the next recovery, then tries again",
             Shape.CHILDREN, "✚", Outline.OCTAGON, "Recover",
             keeps="the attempt and the recovery whose turn is next", handles_failure=True,
             empty="this recovery was not triggered"),
    NodeKind("retry", "tries its node again after a failure",
             Shape.CHILD, "↺", Outline.HEXAGON, "Retry", keeps="the attempt"),
    NodeKind("timeout", "halts its node and fails after a time limit",
             Shape.CHILD, "◷", Outline.HEXAGON, "Timeout", keeps="the time left"),
    NodeKind("every", "runs its node at most once in a period",
             Shape.CHILD, "◔", Outline.HEXAGON, "Every", keeps="the last result"),
    NodeKind("events", "runs the first event that has fired, else the mission",
             Shape.CHILDREN, "↯", Outline.OCTAGON, "Events", keeps="the event that runs"),
    NodeKind("case", "one case of a `switch`", Shape.CHILD, "⊢", Outline.HEXAGON, "Case",
             empty="another case was chosen"),
    NodeKind("event", "runs its node when its condition becomes true",
             Shape.CHILD, "↯", Outline.HOUSE, "Event", keeps="since when its condition is true"),
)  # fmt: skip

CONTROLS: Mapping[str, NodeKind] = {kind.word: kind for kind in _CONTROLS}
"""Kinds of nodes that modifiers and `events` add to the tree, by modifier."""

CONDITION_GLYPH, LEAF_GLYPH = "◇", "⚙"
CONDITIONS = ("check", "wait_until")
"""Behaviours whose outcome is that of their condition."""

LOOPS = tuple(word for word, kind in NODES.items() if kind.is_loop)


def glyph_of(kind: str) -> str:
    """Return the character of a row's kind."""
    found = NODES.get(kind) or CONTROLS.get(kind)
    if found is None:
        return CONDITION_GLYPH if kind in CONDITIONS else LEAF_GLYPH
    return found.glyph


def outline_of(kind: str) -> Outline:
    """Return the outline of a row's kind in drawings."""
    found = NODES.get(kind) or CONTROLS.get(kind)
    return found.outline if found else Outline.ELLIPSE
