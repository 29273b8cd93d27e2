"""Model of `follow_waypoints`: a `for_each` with a drive, and outputs about missed waypoints.

    - follow_waypoints: {waypoints: $shelves, tolerance: 20 cm}
      on_failure: continue
      do: {wait: 2 s}
      out: {missed: $missed}

expands to `for_each: {waypoint: $shelves}` with
`sequence: [navigate_to_pose: $waypoint, wait: 2 s]`.
"""

from __future__ import annotations

from collections.abc import Mapping

from behaviours.catalogue import BehaviourKind
from missions.language.expressions.scope import Role, Symbol
from missions.language.expressions.value_types import ValueType, type_of
from missions.language.kinds import FOLLOW_WAYPOINTS, NODES
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

WAYPOINTS = NODES[FOLLOW_WAYPOINTS]
WAYPOINT_OUTPUTS: dict[str, ValueType] = {
    name: type_of(item) for name, item in WAYPOINTS.outputs.items()
}


def waypoint_symbols(mark: Mark) -> dict[str, Symbol]:
    """Return the variables of one `follow_waypoints`."""
    return {
        name: Symbol(name, Role.VARIABLE, kind, mark) for name, kind in WAYPOINTS.variables.items()
    }


def waypoint_loop(
    start: Step, drive: BehaviourKind, ports: Mapping[str, Value],
    symbols: Mapping[str, Symbol], task: Step | None,
) -> FollowWaypoints:  # fmt: skip
    """Build the loop with its drive; it stops at the first failure.

    Args:
        start: the node without its body.
        drive: the behaviour that drives to one pose.
        ports: `waypoints` and the optional ports that are set.
        symbols: from `waypoint_symbols`.
        task: node to run at each waypoint; None for none.
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
