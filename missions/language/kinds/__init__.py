"""Kinds of nodes: the words that can stand as the type of a node, besides behaviours.

A kind is one file: its word, its doc, its keys, what it answers to the analyses (`Step`), how it is
read, its node of the tree and an example. The reader, the checks, the compiler, the
language server, the tables of docs/reference.md, `treepilot describe` and the drawings of trees
take them from here. A new kind needs its file and its line in `NODES`.
"""

from __future__ import annotations

from collections.abc import Mapping

from behaviours.catalogue import Catalogue
from missions.language.kinds import controls
from missions.language.kinds.fallback import FALLBACK, REACTIVE_FALLBACK
from missions.language.kinds.follow_waypoints import FOLLOW_WAYPOINTS
from missions.language.kinds.for_each import FOR_EACH
from missions.language.kinds.kind import NodeKind, Outline
from missions.language.kinds.leaf import LEAF_GLYPH
from missions.language.kinds.parallel import PARALLEL
from missions.language.kinds.round_robin import ROUND_ROBIN
from missions.language.kinds.sequence import REACTIVE, SEQUENCE
from missions.language.kinds.switch import CASE, SWITCH
from missions.language.kinds.unset import UNSET
from missions.language.kinds.use import USE

NODES: Mapping[str, NodeKind] = {
    kind.word: kind
    for kind in (
        SEQUENCE, REACTIVE, FALLBACK, REACTIVE_FALLBACK, PARALLEL, ROUND_ROBIN, FOR_EACH,
        FOLLOW_WAYPOINTS, USE, SWITCH, UNSET,
    )
}  # fmt: skip
"""Kinds of nodes that a mission can name, besides behaviours, in the order of the docs."""

CONTROLS: Mapping[str, NodeKind] = {kind.word: kind for kind in (*controls.CONTROLS, CASE)}
"""Kinds of nodes that are added to the tree, by modifier."""

KINDS: Mapping[str, NodeKind] = {**NODES, **CONTROLS}


def node_types(catalogue: Catalogue) -> dict[str, tuple[str, ...]]:
    """Return every word that can be the type of a node, with its names elsewhere."""
    behaviours = {name: catalogue.get(name) for name in catalogue.names()}
    others = {name: kind.also_known_as for name, kind in behaviours.items() if kind is not None}
    return {**{word: kind.also_known_as for word, kind in NODES.items()}, **others}


def glyph_of(kind: str) -> str:
    """Return the character of a row's kind; that of a behaviour may differ."""
    return KINDS[kind].glyph if kind in KINDS else LEAF_GLYPH


def outline_of(kind: str) -> Outline:
    """Return the outline of a row's kind in drawings."""
    return KINDS[kind].outline if kind in KINDS else Outline.ELLIPSE
