"""Keyframes around a pose that the graph connects consistently."""

from __future__ import annotations

from heapq import heappop, heappush
from math import hypot

from stack.localisation.planar import are_near
from stack.mapping.slam.graph import Edge, PoseGraph
from stack.types import Pose2D, wrap_angle

REFERENCE_KEYFRAMES = 12
"""Keyframes that a scan is matched with."""
REFERENCE_DISTANCE = 4.0
"""Largest distance of these keyframes, m."""

CONSISTENT_DISTANCE, CONSISTENT_ANGLE = 0.15, 0.05
"""Error (metres, radians) up to which an edge agrees with the poses of its keyframes. After a loop
closure edges disagree until the graph is optimised; the two visits must not be mixed before."""


class Neighbourhood:
    """Search along the edges of a graph."""

    def __init__(self, graph: PoseGraph) -> None:
        self._graph = graph

    def around(self, start: int, pose: Pose2D, count: int, distance: float) -> list[int]:
        """Return the nearest keyframes within a distance of `pose`, the nearest first.

        Only keyframes that edges without contradictions connect with `start`, through keyframes
        within twice the distance.
        """
        keyframes = self._graph.keyframes
        found: list[tuple[float, int]] = []
        seen, queue = {start}, [start]
        while queue:
            number = queue.pop()
            away = keyframes[number].pose.distance_to(pose)
            turned = abs(wrap_angle(keyframes[number].pose.heading - pose.heading))
            if away <= distance:
                found.append((away + 0.5 * turned, number))
            for edge in self._graph.edges_of(number):
                other = edge.source + edge.target - number
                if other in seen or keyframes[other].pose.distance_to(pose) > 2.0 * distance:
                    continue
                if edge.is_doubtful:
                    continue
                if edge.kind == "odometry" or self._agrees(edge):
                    seen.add(other)
                    queue.append(other)
        return [number for _, number in sorted(found)[:count]]

    def within_path(self, start: int, length: float) -> set[int]:
        """Return the keyframes that a path of edges of at most `length` metres connects."""
        queue, seen = [(0.0, start)], set()
        while queue:
            gone, number = heappop(queue)
            if number in seen:
                continue
            seen.add(number)
            for edge in self._graph.edges_of(number):
                other = edge.source + edge.target - number
                if edge.is_doubtful:
                    continue
                further = gone + hypot(edge.relative.x, edge.relative.y)
                if other not in seen and further <= length:
                    heappush(queue, (further, other))
        return seen

    def _agrees(self, edge: Edge) -> bool:
        keyframes = self._graph.keyframes
        relative = keyframes[edge.target].pose.relative_to(keyframes[edge.source].pose)
        return are_near(relative, edge.relative, CONSISTENT_DISTANCE, CONSISTENT_ANGLE)
