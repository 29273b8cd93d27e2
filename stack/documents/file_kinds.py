"""Recognises of which kind a file is by its keys: one finding for a file in the wrong place."""

from __future__ import annotations

from collections import Counter
from difflib import get_close_matches

from stack.documents.yaml_nodes import Node
from stack.errors import Finding, InputError

MISSION, WORLD, ROBOT, MAP = "mission", "world file", "robot file", "map file"
PARAMETERS, NAV2, TREES = "parameter file", "Nav2 parameter file", "file of trees"
MARKERS = "map of markers"

_NAME_KEYS = {MISSION: ("mission", "run"), WORLD: ("world",), ROBOT: ("robot",), TREES: ("trees",)}
"""A file with one of these keys is of its kind, unless it is a mission."""

_SIGNS = {
    MISSION: (
        "mission", "run", "events", "arguments", "blackboard", "plugins", "tests", "navigation",
        "localisation", "initial_pose",
    ),
    WORLD: (
        "world", "walls", "boxes", "bounds", "cylinders", "doors", "docks", "people", "markers",
    ),
    ROBOT: (
        "robot", "footprint", "wheels", "urdf", "limits", "odometry", "lidar", "lidars", "sonars",
        "imu", "battery", "height",
    ),
    MAP: ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"),
    PARAMETERS: (
        "planner", "controller", "goal_checker", "progress_checker", "costmap", "navigator",
        "safety", "failsafe", "evasion", "speed_limits", "tracker", "loop", "recording",
        "localisation",
    ),
    TREES: ("trees",),
    MARKERS: ("markers", "boards"),
}  # fmt: skip
"""Keys that only files of this kind have; `world` and `robot` also stand in missions."""

_USES = {
    MISSION: "run it with `treepilot run`",
    WORLD: "name it under `world:` of a mission",
    ROBOT: "name it under `robot:` of a mission",
    MAP: "name it under `map:` or `world:` of a mission",
    PARAMETERS: "list it under `parameters:` of a mission",
    NAV2: "name it in a mission: `navigation: {nav2_params: FILE}`",
    TREES: "list it under `include:` of a mission",
    MARKERS: "name it under `markers:` of a mission",
}


def require_kind(top: Node, expected: str) -> Node:
    """Return the document, unless its keys are those of a file of another kind.

    Raises:
        InputError: it is of another kind; the only finding says of which, and where it belongs.
    """
    found = kind_of(top, expected)
    if found == expected:
        return top
    sentence = f"this is a {found}, not a {expected}"
    raise InputError([Finding(top.mark, "E007", sentence, _USES[found])])


def kind_of(top: Node, expected: str) -> str:
    """Return the kind of file that a document's keys belong to; `expected` in cases of doubt."""
    keys = [str(key.value) for key, _ in top.entries]
    if _has_ros_parameters(top):
        return NAV2
    is_mission = any(key in keys for key in _NAME_KEYS[MISSION])
    named = expected == MISSION or not is_mission
    if named and any(key in keys for key in _NAME_KEYS.get(expected, ())):
        return expected
    score = Counter({kind: sum(key in signs for key in keys) for kind, signs in _SIGNS.items()})
    (best, most), (_, second) = score.most_common(2)
    own = _SIGNS.get(expected, ())
    near = sum(bool(get_close_matches(key[:60], own, 1, cutoff=0.75)) for key in keys)
    return best if most > max(second, near) else expected


def _has_ros_parameters(node: Node, depth: int = 3) -> bool:
    """Return whether a node of ROS has parameters in the file, under a namespace or not."""
    values = [value for _, value in node.entries]
    return any(value.get("ros__parameters") is not None for value in values) or (
        depth > 0 and any(_has_ros_parameters(value, depth - 1) for value in values)
    )
