"""Lazy shortest-path search over lanes and connections through free space.

The cost of a lane is known. The cost of a connection (from the start to the graph, from the graph
to the goal, or around an obstacle on a lane) is known only after a planner has evaluated it. Until
then its straight-line cost is a lower bound. Connections on the best path are evaluated one by one,
and the search is repeated (LazySP: Dellin and Srinivasa, ICAPS 2016, with forward evaluation). A
best path with all connections evaluated is optimal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf

from stack.planning.routes.graph import RouteEdge
from stack.types import FloatArray, Path


@dataclass(eq=False, slots=True)
class RouteArc:
    """Directed arc between two vertices: part of a lane, or a connection through free space.

    Attributes:
        start: vertex.
        end: vertex.
        cost: metres or seconds, weighted; a lower bound until `evaluated`; inf if impassable.
        points: (n, 2) of a part of a lane, metres, map frame; None for a connection.
        edge: the lane; None for a connection.
        evaluated: whether the cost is final.
        path: of an evaluated connection.
        longest: metres; a longer connection is discarded.
    """

    start: int
    end: int
    cost: float
    points: FloatArray | None = None
    edge: RouteEdge | None = None
    evaluated: bool = True
    path: Path | None = None
    longest: float = inf


def cheapest(arcs: Iterable[RouteArc], start: int, end: int) -> list[RouteArc] | None:
    """Return the cheapest arcs from vertex to vertex (Dijkstra 1959), or None if unreachable.

    Among paths of equal cost, arcs that come first in `arcs` are preferred.
    """
    leaving: dict[int, list[RouteArc]] = {}
    for arc in arcs:
        if arc.cost < inf:
            leaving.setdefault(arc.start, []).append(arc)
    best: dict[int, tuple[float, RouteArc | None]] = {start: (0.0, None)}
    queue, done, count = [(0.0, 0, start)], set[int](), 0
    while queue:
        cost, _, vertex = heappop(queue)
        if vertex == end:
            return _back(best, end)
        if vertex in done:
            continue
        done.add(vertex)
        for arc in leaving.get(vertex, ()):
            reached = cost + arc.cost
            if arc.end not in best or reached < best[arc.end][0]:
                best[arc.end] = (reached, arc)
                count += 1
                heappush(queue, (reached, count, arc.end))
    return None


def cheapest_evaluated(
    arcs: Callable[[], Sequence[RouteArc]], start: int, end: int,
    evaluate: Callable[[RouteArc], None],
) -> list[RouteArc] | None:  # fmt: skip
    """Return the cheapest arcs, all of them evaluated, or None if the end is unreachable.

    Args:
        arcs: returns the current arcs; `evaluate` may add some.
        start: vertex.
        end: vertex.
        evaluate: computes the cost of an arc and marks it as evaluated.
    """
    while True:
        found = cheapest(arcs(), start, end)
        unsure = None if found is None else next((a for a in found if not a.evaluated), None)
        if unsure is None:
            return found
        evaluate(unsure)


def _back(best: dict[int, tuple[float, RouteArc | None]], end: int) -> list[RouteArc]:
    arcs: list[RouteArc] = []
    arc = best[end][1]
    while arc is not None:
        arcs.append(arc)
        arc = best[arc.start][1]
    return arcs[::-1]
