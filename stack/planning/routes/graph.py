"""Route graph: named nodes, and lanes between them with their rules."""

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
        id: unique name.
        start: id of the node where it begins.
        end: id of the node where it ends.
        line: polyline from start to end, map frame.
        speed: speed limit, m/s.
        speed_share: speed limit as a share of the robot's top speed.
        weight: factor on its length or time.
        one_way: it may be driven from `start` to `end` only.
        closed: it may not be driven.
        feature: index of the feature in the file, from 0.
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
        """Return the limit in m/s for a robot with this top speed; inf if it has no effect."""
        limit = min(self.speed, self.speed_share * top_speed)
        return limit if limit < top_speed else inf


@dataclass(frozen=True)
class RouteGraph:
    """Nodes and edges, each by id.

    Attributes:
        nodes: (x, y) in metres, map frame.
        edges: lanes.
        source: the file it was read from.
        warnings: findings that are probably mistakes in the file.
    """

    nodes: Mapping[str, tuple[float, float]]
    edges: Mapping[str, RouteEdge]
    source: str = ""
    warnings: tuple[Finding, ...] = field(default=())

    def with_edge(self, edge: str, *, closed: bool) -> RouteGraph:
        """Return the graph with an edge closed or opened.

        Raises:
            ParameterError: there is no such edge; the hint suggests a similar name.
        """
        if edge not in self.edges:
            raise ParameterError(
                "edge", f"the route graph has no edge {edge!r}", suggestion(edge, self.edges)
            )
        return replace(self, edges={**self.edges, edge: replace(self.edges[edge], closed=closed)})
