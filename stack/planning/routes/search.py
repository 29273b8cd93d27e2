"""Shortest paths over lanes whose connections through free space are costly to look at.

A lane's cost is known; that of a way through free space (on to the graph, off it, round what stands
on a lane) only after a planner has looked for it. So such a way counts its straight line, which is
never more than the truth, until it is part of the best path; then it is looked at, and the search
runs again (LazySP: Dellin and Srinivasa, ICAPS 2016, with forward evaluation). When nothing on the
best path is left to look at, it is the cheapest there is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf

from stack.planning.routes.graph import RouteEdge
from stack.types import FloatArray, Path


@dataclass(eq=False, slots=True)
class Arc:
    """A way from one vertex to another, driven in this direction.

    Attributes:
        cost: metres or seconds, weighted; a lower bound while `looked_at` is false; inf: no way.
        points: (n, 2) of a lane's stretch, metres, map frame; None of a way through free space.
        edge: the lane; None of a way through free space.
        path: of a way through free space, once looked at.
        longest: metres; a way through free space that is longer is none.
    """

    start: int
    end: int
    cost: float
    points: FloatArray | None = None
    edge: RouteEdge | None = None
    looked_at: bool = True
    path: Path | None = None
    longest: float = inf


def cheapest(arcs: Iterable[Arc], start: int, end: int) -> list[Arc] | None:
    """The cheapest arcs from vertex to vertex (Dijkstra 1959); None where there is no way.

    Of ways that cost the same, the one whose arcs were given first is taken.
    """
    leaving: dict[int, list[Arc]] = {}
    for arc in arcs:
        if arc.cost < inf:
            leaving.setdefault(arc.start, []).append(arc)
    best: dict[int, tuple[float, Arc | None]] = {start: (0.0, None)}
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


def cheapest_looked_at(
    arcs: Callable[[], Sequence[Arc]], start: int, end: int, look: Callable[[Arc], None]
) -> list[Arc] | None:
    """The cheapest arcs of which none is left to look at; None where there is no way.

    Args:
        arcs: all of them as they are now; `look` may lead to more.
        start: vertex.
        end: vertex.
        look: finds out what an arc costs, and marks it as looked at.
    """
    while True:
        found = cheapest(arcs(), start, end)
        unsure = None if found is None else next((a for a in found if not a.looked_at), None)
        if unsure is None:
            return found
        look(unsure)


def _back(best: dict[int, tuple[float, Arc | None]], end: int) -> list[Arc]:
    arcs: list[Arc] = []
    arc = best[end][1]
    while arc is not None:
        arcs.append(arc)
        arc = best[arc.start][1]
    return arcs[::-1]
