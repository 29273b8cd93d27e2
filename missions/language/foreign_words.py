"""Words of other tools and of everyday language, with the word of this one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stack.parameters import suggestion

NODES = {
    "selector": "fallback",
    "reactivesequence": "reactive",
    "pipelinesequence": "reactive",
    "sequencewithmemory": "sequence",
    "reactivefallback": "reactive_fallback",
    "parallelall": "parallel",
    "roundrobin": "round_robin",
    "spawn": "parallel",
    "sleep": "wait",
    "delay": "wait",
    "pause": "wait",
    "goto": "navigate_to_pose",
    "go_to": "navigate_to_pose",
    "move_to": "navigate_to_pose",
    "drive": "navigate_to_pose",
    "drive_to": "navigate_to_pose",
    "log": "say",
    "print": "say",
    "rotate": "spin",
    "turn": "spin",
    "photo": "take_photo",
    "clearentirecostmap": "clear_costmap",
    "setblackboard": "set",
    "subtree": "use",
    "computepathtopose": "navigate_to_pose",
    "driveonheading": "drive_on_heading",
    "followwaypoints": "follow_waypoints",
    "navigatethroughposes": "navigate_through",
}
"""Words for nodes, in lower case -> the node here."""

MODIFIERS = {
    "recoverynode": "write `recover: {attempts: …, round_robin: […]}` beside the node",
    "retryuntilsuccessful": "write `retry: 3` beside the node",
    "repeat": "write `repeat: 3` or `repeat: forever` beside the node",
    "loop": "write `repeat: 3` or `repeat: forever` beside the node",
    "keeprunninguntilfailure": "write `repeat: forever` beside the node",
    "inverter": "a check can say `not`; for other nodes see the modifiers",
    "forcesuccess": "write `on_failure: continue` beside the node",
    "forcefailure": "put a `check: false` behind the node",
    "timeout": "write `timeout: 30 s` beside the node",
    "ratecontroller": "write `every: 1 s` beside the node",
    "precondition": "write `when: …` beside the node",
    "if": "write `when: …` beside the node",
    "ifthenelse": "write a fallback, with `when: …` beside its first child",
    "else": "write a fallback: its next child runs when the first one is skipped or fails",
    "retries": "write `retry: 3`",
    "succeed_on": "write `parallel: {succeed_on: one, do: […]}`: it stands below `parallel:`",
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
    "on_success": "write the nodes in order below `sequence:`",
    "limit": "write `timeout: 30 s` beside the node",
    "max_time": "write `timeout: 30 s` beside the node",
    "condition": "write `when: …` beside the node",
    "unless": "write `when: not …`, or `unless` below `recover:`",
}
"""Words for what modifiers do, in lower case -> what to write."""

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
}
"""Names of ports elsewhere -> names here."""

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


def meant_or_near(word: str, meanings: Mapping[str, str], known: Iterable[str]) -> str:
    """Return the hint for a word that may have a meaning in another tool."""
    meant = meanings.get(word)
    return f"did you mean {meant!r}?" if meant else suggestion(word, known)


def node_hint(word: str, known: Iterable[str]) -> str:
    """Return the hint for an unknown type of node."""
    plain = word.lower()
    if plain in MODIFIERS:
        return MODIFIERS[plain]
    return _named(NODES.get(plain), word, known)


def modifier_hint(word: str, known: Iterable[str]) -> str:
    """Return the hint for an unknown modifier."""
    return MODIFIERS.get(word.lower()) or suggestion(word, known)


def port_hint(word: str, known: Iterable[str]) -> str:
    """Return the hint for an unknown port."""
    return _named(PORTS.get(word.lower()), word, known)


def _named(meant: str | None, word: str, known: Iterable[str]) -> str:
    names = list(known)
    return f"did you mean {meant!r}?" if meant in names else suggestion(word, names)
