"""Words of other tools and of everyday language, with the word of this one."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from stack.errors import Hint
from stack.parameters import did_you_mean, likely, nearest, suggestion, superfluous

_BY_ITSELF = "leave it out: navigate_to_pose plans, smooths and replans by itself"
_COMPONENTS = "write `navigation: {planner: …, controller: …}` at the top of the mission"
_ERRORS = "write `unless: error == …` below `recover:`"
_ONCE = "write `when: $key is not set` beside the node, and set the key behind it"
_NEWS = "write `wait_until: …`, or `when: …` beside the node"

MODIFIERS = {
    "recoverynode": "write `recover: {attempts: …, round_robin: […]}` beside the node",
    "retryuntilsuccessful": "write `retry: 3` beside the node",
    "repeat": "write `repeat: 3` or `repeat: forever` beside the node",
    "loop": "write `repeat: 3` or `repeat: forever` beside the node",
    "keeprunninguntilfailure": "write `repeat: forever` beside the node",
    "failureissuccess": "write `on_failure: continue` beside the node",
    "successisfailure": "write `invert: true` beside the node, or `fail` behind it",
    "eternalguard": "write `while: …` beside the node",
    "passthrough": "leave it out, or write `name: …` beside the node",
    "oneshot": _ONCE,
    "retry": "write `retry: 3` beside the node",
    "inverter": "write `invert: true` beside the node",
    "not": "write `invert: true` beside the node",
    "forcesuccess": "write `on_failure: continue` beside the node",
    "alwayssuccess": "leave it out; `on_failure: continue` beside a node hides its failure",
    "succeed": "leave it out; `on_failure: continue` beside a node hides its failure",
    "forcefailure": "write `on_failure: continue` beside the node, and `fail` behind it",
    "timeout": "write `timeout: 30 s` beside the node",
    "ratecontroller": "write `every: 1 s` beside the node",
    "timeexpired": "write `every: 5 s` beside the node",
    "precondition": "write `when: …` beside the node",
    "runonce": _ONCE,
    "singletrigger": _ONCE,
    "skipunlessupdated": _NEWS,
    "waitvalueupdate": _NEWS,
    "entryupdated": _NEWS,
    "if": "write `when: …` beside the node",
    "ifthenelse": "write a `fallback` with `when: …` beside its first child, or a `switch`",
    "whiledoelse": "write a `reactive_fallback` with `when: …` beside its first child",
    "else": "write a fallback: its next child runs when the first one is skipped or fails",
    "elif": "write a fallback: its next child runs when the first one is skipped or fails",
    "catch": "write a fallback: its next child runs when the first one fails",
    "retries": "write `retry: 3`",
    "succeedon": "write `parallel: {succeed_on: one, do: […]}`: it stands below `parallel:`",
    "attempts": "write `retry: 3`, or `recover: {attempts: 3, round_robin: […]}`",
    "delay": "write `retry: {attempts: 3, delay: 1 s}`",
    "until": "write `repeat: {until: …}`",
    "forever": "write `repeat: forever`",
    "cases": "write `switch: {value: …, cases: {…}}`: it stands below `switch:`",
    "default": "write `switch: {value: …, cases: {…}, default: …}`: it stands below `switch:`",
    "recovery": "write `recover: {attempts: 3, round_robin: […]}`",
    "recoveries": "write `recover: {attempts: 3, round_robin: […]}`",
    "then": "write the nodes in order below `sequence:`",
    "next": "write the nodes in order below `sequence:`",
    "onsuccess": "write the nodes in order below `sequence:`",
    "limit": "write `timeout: 30 s` beside the node",
    "maxtime": "write `timeout: 30 s` beside the node",
    "condition": "write `when: …` beside the node",
    "unless": "write `when: not …`, or `unless` below `recover:`",
    "stop": "leave it out: the robot stands when no node moves it; to end the mission write `fail`",
    "end": "a `sequence` ends with its last node; to end the mission earlier write `fail`",
    "exit": "a `sequence` ends with its last node; to end the mission earlier write `fail`",
    "return": "a `sequence` ends with its last node; to end the mission earlier write `fail`",
    "isbatterylow": "write `check: battery.charge < 20 %`, or an event",
    "isbatterycharging": "write `check: battery.charging`",
    "goalreached": "write `check: pose.distance_to($place) < 30 cm`",
    "isstuck": "write `when: error == NO_PROGRESS` beside a recovery",
    "areerrorcodespresent": _ERRORS,
    "wouldaplannerrecoveryhelp": _ERRORS,
    "wouldacontrollerrecoveryhelp": _ERRORS,
    "plannerselector": _COMPONENTS,
    "controllerselector": _COMPONENTS,
    "smootherselector": _COMPONENTS,
    "goalcheckerselector": _COMPONENTS,
    "progresscheckerselector": _COMPONENTS,
    "goalupdated": _BY_ITSELF,
    "goalupdater": _BY_ITSELF,
    "goalupdatedcontroller": _BY_ITSELF,
    "distancecontroller": _BY_ITSELF,
    "distancetraveled": _BY_ITSELF,
    "speedcontroller": _BY_ITSELF,
    "pathexpiringtimer": _BY_ITSELF,
    "pathlongeronapproach": _BY_ITSELF,
    "ispathvalid": _BY_ITSELF,
    "smoothpath": _BY_ITSELF,
    "truncatepath": _BY_ITSELF,
    "truncatepathlocal": _BY_ITSELF,
    "removepassedgoals": _BY_ITSELF,
    "initialposereceived": "leave it out, or write `check: localisation.health > 50 %`",
    "transformavailable": "leave it out, or write `check: localisation.health > 50 %`",
}
"""Words for what modifiers do, or for what needs no node, as `plain` writes them -> what to write.
"""

TYPE_WORDS = ("type", "behaviour", "behavior", "action", "node", "task", "kind")
CHILDREN_WORDS = ("children", "nodes", "steps", "tasks", "actions", "do", "list", "body")
"""Keys that hold the type of a node, and its children, elsewhere."""

MISSION_WORDS = {
    "name": "mission", "title": "mission", "description": "doc", "comment": "doc",
    "version": "format", "environment": "world", "scene": "world", "locations": "places",
    "poses": "places", "waypoints": "places", "goals": "places", "variables": "blackboard",
    "inputs": "arguments", "tree": "run", "behavior_tree": "run", "behaviour_tree": "run",
    "root": "run", "steps": "run", "tasks": "run", "actions": "run", "subtrees": "trees",
    "localization": "localisation",
}  # fmt: skip
"""Keys at the top of a file elsewhere -> keys here."""

PORTS = {
    "backup_dist": "distance",
    "backup_speed": "speed",
    "spin_dist": "angle",
    "wait_duration": "time",
    "duration": "time",
    "seconds": "time",
    "pose": "goal",
    "target": "goal",
    "poses": "goals",
    "msg": "text",
    "message": "text",
    "velocity": "speed",
    "degrees": "angle",
    "deg": "angle",
    "radians": "angle",
    "meters": "distance",
    "metres": "distance",
}
"""Names of ports elsewhere -> names here."""

POSE_PARTS = {"x", "y", "z", "yaw", "theta", "th", "heading", "angle", "position", "orientation"}
"""Names of the parts of a pose, which is a list here."""

TYPES = {"string": "text", "str": "text", "integer": "int", "double": "float", "boolean": "bool",
         "number": "float", "time": "duration", "position": "Pose", "pose2d": "Pose"}  # fmt: skip
"""Types elsewhere, in lower case -> types here."""

KEY_WORDS = {"value": "initial", "default": "initial", "init": "initial", "start": "initial",
             "description": "doc", "help": "doc", "comment": "doc"}  # fmt: skip
ARGUMENT_WORDS = {"value": "default", "initial": "default", "options": "one_of", "enum": "one_of",
                  "choices": "one_of", "values": "one_of", "limits": "range", "bounds": "range",
                  "description": "doc", "help": "doc", "comment": "doc"}  # fmt: skip
EVENT_WORDS = {"if": "when", "condition": "when", "on": "when", "trigger": "when", "run": "do",
               "action": "do", "after": "then", "for": "hold", "every": "again"}  # fmt: skip
THEN_MEANINGS = {"continue": "resume", "return": "resume", "repeat": "restart", "stop": "abort",
                 "fail": "abort", "end": "abort", "exit": "abort"}  # fmt: skip
MOCK_WORDS = {"result": "returns", "status": "returns", "return": "returns", "outcome": "returns",
              "duration": "takes", "time": "takes", "delay": "takes", "outputs": "sets",
              "out": "sets", "set": "sets"}  # fmt: skip
"""Words for the keys of declarations, events and mocks -> the keys here."""


_RENAMED = re.compile(r"write `(\w+): (?:…|[\w ]+)`(?: beside the node)?")
"""A hint that gives a modifier another name, and no other value."""


def meant_or_near(word: str, meanings: Mapping[str, str], known: Iterable[str]) -> str:
    """Return the hint for a word that may have a meaning in another tool."""
    meant = meanings.get(word)
    return did_you_mean(meant) if meant else suggestion(word, known)


def plain(word: str) -> str:
    """Return the lower-case letters and digits of a word: GoTo and go_to are the same one."""
    return word.lower().replace("_", "").replace("-", "")


def snake_case(word: str) -> str:
    """Return a word as nodes are written here: `NavigateToPose` is `navigate_to_pose`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", word).lower()


def node_meaning(word: str, known: Mapping[str, Sequence[str]]) -> str:
    """Return the hint for an unknown type of node with a meaning; "" for any other word.

    It resembles a known one, or is a word of another tool or of everyday language.

    Args:
        word: as written.
        known: type of a node -> its names elsewhere.
    """
    key = plain(word)
    elsewhere = {plain(other): name for name, others in known.items() for other in others}
    meant = {**elsewhere, **{plain(name): name for name in known}}.get(key)
    if meant is not None:
        return did_you_mean(meant)
    return MODIFIERS.get(key) or likely(snake_case(word), known)


def modifier_hint(word: str, known: Collection[str]) -> str:
    """Return the hint for an unknown modifier, with its name here as the fix."""
    meant = MODIFIERS.get(plain(word))
    if meant is None:
        return superfluous(word, known)
    renamed = _RENAMED.fullmatch(meant)
    return Hint(meant, renamed[1] if renamed and renamed[1] in known else "")


def meant_port(word: str, known: Iterable[str]) -> str:
    """Return the port that an unknown name means; "" if none does."""
    names, meant = list(known), PORTS.get(word.lower(), "")
    return meant if meant in names else nearest(word, names) or ""
