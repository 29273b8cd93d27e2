"""A graph of routes: named places, and lanes between them with their rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf

from stack.documents import Finding
from stack.errors import ParameterError
from stack.parameters import suggestion
from stack.planning.routes.line import Line


@dataclass(frozen=True, slots=True)
class RouteEdge:
    """A lane from one node to another.

    Attributes:
        id: its name, unique among the edges.
        start: id of the node where it begins.
        end: id of the node where it ends.
        line: from the one to the other, map frame.
        speed: the most that may be driven on it, m/s.
        speed_share: the same as a share of the robot's top speed.
        weight: how many times its length or time it counts.
        one_way: it may be driven from `start` to `end` only.
        closed: nobody may drive on it.
        feature: number of the feature in its file, from 0.
    """

    id: str
    start: str
    end: str
    line: Line
    speed: float = inf
    speed_share: float = 1.0
    weight: float = 1.0
    one_way: bool = False
    closed: bool = False
    feature: int = 0

    def limit(self, top_speed: float) -> float:
        """The most that a robot of this top speed may drive on it; inf where that is its own."""
        limit = min(self.speed, self.speed_share * top_speed)
        return limit if limit < top_speed else inf


@dataclass(frozen=True)
class RouteGraph:
    """Nodes and edges, each by id.

    Attributes:
        nodes: (x, y) in metres, map frame.
        source: the file it was read from.
        warnings: what of the file is probably not meant.
    """

    nodes: Mapping[str, tuple[float, float]]
    edges: Mapping[str, RouteEdge]
    source: str = ""
    warnings: tuple[Finding, ...] = field(default=())

    def with_edge(self, edge: str, *, closed: bool) -> RouteGraph:
        """The same graph with an edge closed or opened.

        Raises:
            ParameterError: there is no such edge; the sentence names the nearest.
        """
        if edge not in self.edges:
            raise ParameterError(
                "edge", f"the route graph has no edge {edge!r}", suggestion(edge, self.edges)
            )
        return replace(self, edges={**self.edges, edge: replace(self.edges[edge], closed=closed)})
