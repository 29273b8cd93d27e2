"""Refinement of a finished graph: all neighbouring scans are matched again, then optimised."""

from __future__ import annotations

import numpy as np

from stack.mapping.slam.graph import Edge
from stack.mapping.slam.mapper import Mapper

REACH = 3.0
"""Metres: keyframes nearer than this are matched with each other."""


ROUNDS = 3
"""After a loop of 100 m the first round moves keyframes by decimetres, the third by millimetres."""

NEIGHBOURS = 10
"""Keyframes that each one is matched with, at most."""


def refine(mapper: Mapper, rounds: int = ROUNDS) -> None:
    """Match each keyframe with its nearest neighbours at the current poses, and optimise; repeat.

    Odometry and loop edges stay; the matches are measured again (the loop of F. Lu and E. Milios,
    "Globally Consistent Range Scan Alignment", Autonomous Robots 4, 1997).
    """
    mapper.optimise()
    for _ in range(rounds):
        _match_again(mapper)


def _match_again(mapper: Mapper) -> None:
    graph = mapper.graph
    numbers = list(graph.keyframes)
    rows = np.array([[k.pose.x, k.pose.y] for k in graph.keyframes.values()])
    pairs: set[tuple[int, int]] = set()
    for i, number in enumerate(numbers):
        away = np.hypot(*(rows - rows[i]).T)
        order = np.argsort(away, kind="stable")[1 : 1 + NEIGHBOURS]
        for j in order:
            if away[j] <= REACH:
                pairs.add((min(number, numbers[j]), max(number, numbers[j])))
    kept = [edge for edge in graph.edges if edge.kind != "match"]
    found: list[Edge] = []
    for source, target in sorted(pairs):
        edge = mapper.matched_edge(source, target, "match")
        if edge is not None:
            found.append(edge)
    graph.replace_edges([*kept, *found])
    mapper.optimise()
