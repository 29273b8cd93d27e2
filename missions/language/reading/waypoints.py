"""`follow_waypoints`: `for_each` with the drive in it, and an account of what was missed.

    - follow_waypoints: {waypoints: $shelves, tolerance: 20 cm}
      on_failure: continue
      do: {wait: 2 s}
      out: {missed: $missed}

means `for_each: {waypoint: $shelves}` with `sequence: [navigate_to_pose: $waypoint, wait: 2 s]`.
"""

from __future__ import annotations

from collections.abc import Mapping

from behaviours.catalogue import BehaviourKind
from missions.language.expressions.scope import Role, Symbol
from missions.language.expressions.value_types import INT, POSE, ValueType, type_of
from missions.language.model import (
    Composite,
    FollowWaypoints,
    Leaf,
    Modifiers,
    Reference,
    Step,
    Value,
)
from stack.documents import Mark
from stack.parameters import Declaration
from stack.types import Pose2D

FOLLOW_WAYPOINTS = "follow_waypoints"

WAYPOINT_PORTS: dict[str, Declaration] = {
    "waypoints": Declaration(
        "waypoints", list[Pose2D], "where to go, one after the other, map frame"
    ),
    "tolerance": Declaration(
        "tolerance", float | None, "how near counts as there; the robot's own when left out",
        unit="m", default=None, above=0.0,
    ),
    "time_limit": Declaration(
        "time_limit", float | None, "longest drive to one waypoint; endless when left out",
        unit="s", default=None, above=0.0,
    ),
}  # fmt: skip
OUTPUTS: dict[str, Declaration] = {
    "missed": Declaration("missed", list[int], "numbers of the waypoints missed, from 1"),
    "reached": Declaration("reached", int, "how many waypoints were reached, with their tasks"),
    "distance": Declaration("distance", float, "length of the drives to the waypoints", "m"),
}
WAYPOINT_OUTPUTS: dict[str, ValueType] = {name: type_of(item) for name, item in OUTPUTS.items()}
VARIABLES: dict[str, ValueType] = {"waypoint": POSE, "waypoint_number": INT}
"""What `do` may read: the waypoint of the moment, and which one it is, from 1."""


def waypoint_symbols(mark: Mark) -> dict[str, Symbol]:
    """The variables of one `follow_waypoints`."""
    return {name: Symbol(name, Role.VARIABLE, kind, mark) for name, kind in VARIABLES.items()}


def following(
    start: Step, drive: BehaviourKind, ports: Mapping[str, Value],
    symbols: Mapping[str, Symbol], task: Step | None,
) -> FollowWaypoints:  # fmt: skip
    """The loop, its drive put together from the ports; it stops at the first failure.

    Args:
        start: the node without its body.
        drive: the behaviour that drives to one pose.
        ports: `waypoints`, the others if they are given.
        symbols: from `waypoint_symbols`.
        task: what is done at each waypoint.
    """
    driven = Symbol("driven", Role.VARIABLE, ValueType(float, "m"), start.mark)
    given: dict[str, Value] = {"goal": Reference(symbols["waypoint"])}
    if "tolerance" in ports:
        given["tolerance"] = ports["tolerance"]
    child: Step = Leaf(
        drive.name, start.mark, "", Modifiers(timeout=ports.get("time_limit")),
        drive, given, {"path_length": driven},
    )  # fmt: skip
    if task is not None:
        child = Composite("sequence", start.mark, "", Modifiers(), (child, task))
    return FollowWaypoints(
        start.kind, start.mark, start.name, start.modifiers, symbols["waypoint"],
        ports["waypoints"], False, child, symbols["waypoint_number"], driven, {},
    )  # fmt: skip
