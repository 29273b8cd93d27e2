"""Sections of mission files by name, those of node kinds included."""

from __future__ import annotations

from collections.abc import Mapping

from missions.language import keys
from missions.language.keys import Keys
from missions.language.kinds import NODES

ONLY_FOR: Mapping[str, tuple[str, ...]] = {
    "with": tuple(word for word, kind in NODES.items() if kind.takes_inputs),
    "do": tuple(word for word, kind in NODES.items() if kind.is_loop),
}
"""Modifiers of some kinds only; `out` is for all that have outputs."""

SECTIONS: Mapping[str, Keys] = {
    "mission": keys.MISSION, "tree file": keys.TREE_FILE, "replayed robot": keys.REPLAYED_ROBOT,
    "argument": keys.ARGUMENT,
    "blackboard key": keys.BLACKBOARD_KEY, "input": keys.INPUT,
    "tree": keys.TREE, "event": keys.EVENT, "fault": keys.FAULT,
    "node": keys.MODIFIERS, "retry": keys.RETRY, "recover": keys.RECOVER, "repeat": keys.REPEAT,
    **{word: kind.keys for word, kind in NODES.items() if kind.keys},
    "case": keys.CASE,
    "mock": keys.MOCK, "expectation": keys.EXPECTATION,
}  # fmt: skip


PLACES: Mapping[str, str] = {
    "mission": "top of a mission", "tree file": "top of an included file",
    "replayed robot": "`robot`, for a log",
    "argument": "entry of `arguments`", "blackboard key": "entry of `blackboard`",
    "tree": "entry of `trees`", "input": "entry of `in`", "event": "entry of `events`",
    "fault": "entry of `faults`",
    "node": "node", "retry": "`retry`", "recover": "`recover`",
    "repeat": "`repeat`", **{word: f"`{word}`" for word, kind in NODES.items() if kind.keys},
    "case": "entry of `tests`", "mock": "entry of `mock`", "expectation": "`expect`",
}  # fmt: skip
"""Where each section stands."""


def mission_words() -> frozenset[str]:
    """Return the words that no behaviour can have as its name."""
    return frozenset([*NODES, *keys.MODIFIERS, *keys.RECOVER, *keys.EVENT, *keys.TREE])
