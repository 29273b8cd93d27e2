"""Search graph of a query: parts of lanes, entries, exits, and detours around obstacles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot, inf, pi

import numpy as np
from numpy.typing import NDArray

from stack.geometry.costs_under import costs_under
from stack.planning.routes.graph import RouteEdge, RouteGraph
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.search import RouteArc
from stack.types import INSCRIBED_COST, LETHAL_COST, CostGrid, FloatArray, Pose2D, wrap_angle

LEAD, LEAD_SHARE = 0.3, 0.5
"""Metres, and share of the distance to the lane: entries and exits are this far ahead of the
nearest point and behind it, so that a robot on the lane drives on along it."""

CONNECTION_SLACK = 1.0
"""Metres by which an entry or exit may be longer than the shortest one."""

TOUCHING = 0.2
"""Metres; a connection within this distance of a lane touches it."""

DETOUR_MARGIN = 0.5
"""Metres before and after an obstacle on a lane where a detour leaves and rejoins the lane."""


@dataclass(frozen=True, slots=True)
class Rates:
    """Cost rates of driving: seconds or metres, at a top speed of the robot in m/s."""

    parameters: RouteParameters
    top_speed: float

    def of_lane(self, edge: RouteEdge, length: float) -> float:
        """Return the cost of `length` metres of a lane."""
        speed = min(self.top_speed, edge.limit(self.top_speed))
        return edge.weight * (length / speed if self._by_time else length)

    def of_connection(self, length: float) -> float:
        """Return the cost of a connection of `length` metres."""
        return self.parameters.off_route * (length / self.top_speed if self._by_time else length)

    @property
    def _by_time(self) -> bool:
        return self.parameters.cost == "time"


@dataclass(slots=True)
class _Lane:
    """Edge with its vertices and obstacles, by arc length in metres."""

    edge: RouteEdge
    cuts: dict[float, int]
    obstacles: list[tuple[float, float]]  # (begin, end) of the blocked parts


class Network:
    """Vertices and arcs of one query.

    Vertex 0 is the start of the plan and vertex 1 its goal.

    Attributes:
        places: (x, y) of each vertex, map frame, metres.
        blocked: position of the first obstacle by id of a blocked edge, map frame, metres.
        direct: connection from start to goal without lanes.
        entries: connections from the start to lanes.
        exits: connections from lanes to the goal.
        exit_from_closed: shortest connection from a closed lane to the goal, for comparison only;
            None if there is none.
    """

    def __init__(
        self, graph: RouteGraph, costs: CostGrid, rates: Rates, ends: tuple[Pose2D, Pose2D]
    ) -> None:
        self._costs, self._rates = costs, rates
        self.places = [(pose.x, pose.y) for pose in ends]
        self.blocked: dict[str, tuple[float, float]] = {}
        self._on_lane: dict[int, tuple[_Lane, float]] = {}
        self._arrivals: dict[int, list[tuple[int, float]]] = {}
        self._departures: dict[int, list[tuple[int, float]]] = {}
        self._nodes = {name: self._vertex(*place) for name, place in graph.nodes.items()}
        lanes = {edge.id: self._lane(edge) for edge in graph.edges.values()}
        self._lanes = {name: lane for name, lane in lanes.items() if not lane.edge.closed}
        self.exit_from_closed = self._exit_from_closed(
            [lane for lane in lanes.values() if lane.edge.closed]
        )
        self.direct = self._connection(0, 1)
        self.entries: list[RouteArc] = []
        self.exits: list[RouteArc] = []
        self._detours: list[RouteArc] = []
        self._samples = self._free_samples()
        self._find_detours()
        self._find_entries_and_exits()

    def arcs(self) -> list[RouteArc]:
        """Return the parts of lanes that can be driven, and all connections."""
        found = [arc for lane in self._lanes.values() for arc in self._drivable_parts(lane)]
        return [self.direct, *self.entries, *self.exits, *self._detours, *found]

    def straight_length(self, arc: RouteArc) -> float:
        """Return the straight-line distance between the ends of an arc, metres."""
        (x, y), (u, v) = self.places[arc.start], self.places[arc.end]
        return hypot(u - x, v - y)

    def touched(self, points: FloatArray) -> tuple[int, int] | None:
        """Return the index of the first of points (n, 2) on a lane, and the vertex there, or None.

        Blocked parts of lanes are ignored.
        """
        if not len(self._samples[0]):
            return None
        near = np.linalg.norm(points[:, None] - self._samples[0][None], axis=2)
        hits = np.flatnonzero(near.min(axis=1) <= TOUCHING)
        if not hits.size:
            return None
        lane, _ = self._samples[1][int(near[hits[0]].argmin())]
        x, y = points[hits[0]]
        along, _ = lane.edge.line.nearest(float(x), float(y))
        return (int(hits[0]), self._cut(lane, along)) if self._is_free(lane, along) else None

    def heading(self, vertex: int, bearing: float) -> float:
        """Return the heading along the lane at a vertex, in the direction closer to a bearing."""
        if vertex not in self._on_lane:
            return bearing
        lane, along = self._on_lane[vertex]
        ends = np.array([along - 0.05, along + 0.05])
        (x, y), (u, v) = lane.edge.line.at(ends)
        direction = atan2(v - y, u - x)
        turned = abs(wrap_angle(direction - bearing)) > 0.5 * pi
        return wrap_angle(direction + pi) if turned else direction

    def connect(self, arc: RouteArc) -> None:
        """Add an entry or an exit."""
        (self.entries if arc.start == 0 else self.exits).append(arc)

    # Building

    def _vertex(self, x: float, y: float) -> int:
        self.places.append((x, y))
        return len(self.places) - 1

    def _lane(self, edge: RouteEdge) -> _Lane:
        ends = {0.0: self._nodes[edge.start], edge.line.length: self._nodes[edge.end]}
        lane = _Lane(edge, ends, [])
        at = edge.line.samples(self._costs.resolution)
        for begin, end in _runs(blocked(self._costs, edge.line.at(at))):
            lane.obstacles.append((float(at[begin]), float(at[end])))
        if lane.obstacles and not edge.closed:
            x, y = edge.line.at(np.array(lane.obstacles[0][:1]))[0]
            self.blocked[edge.id] = (round(float(x), 2), round(float(y), 2))
        return lane

    def _cut(self, lane: _Lane, along: float) -> int:
        """Return the vertex at an arc length of a lane; add one if there is none close by."""
        for known, vertex in lane.cuts.items():
            if abs(known - along) < 0.5 * self._costs.resolution:
                return vertex
        x, y = lane.edge.line.at(np.array([along]))[0]
        lane.cuts[along] = vertex = self._vertex(float(x), float(y))
        self._on_lane[vertex] = (lane, along)
        return vertex

    def _is_free(self, lane: _Lane, along: float) -> bool:
        return not any(begin <= along <= end for begin, end in lane.obstacles)

    def _free_samples(self) -> tuple[FloatArray, list[tuple[_Lane, float]]]:
        """Return (k, 2) free points on lanes, TOUCHING apart, with their lanes and arc lengths."""
        owners = [
            (lane, float(along))
            for lane in self._lanes.values()
            for along in lane.edge.line.samples(TOUCHING)
            if self._is_free(lane, float(along))
        ]
        points = [lane.edge.line.at(np.array([along])) for lane, along in owners]
        return (np.vstack(points) if points else np.empty((0, 2))), owners

    def _drivable_parts(self, lane: _Lane) -> Iterator[RouteArc]:
        for (begin, start), (end, last) in pairwise(sorted(lane.cuts.items())):
            if any(low <= end and high >= begin for low, high in lane.obstacles):
                continue
            cost = self._rates.of_lane(lane.edge, end - begin)
            line = lane.edge.line
            yield RouteArc(start, last, cost, line.between(begin, end), lane.edge)
            if not lane.edge.one_way:
                yield RouteArc(last, start, cost, line.between(end, begin), lane.edge)

    def _connection(self, start: int, end: int, longest: float = inf) -> RouteArc:
        (x, y), (u, v) = self.places[start], self.places[end]
        straight = hypot(u - x, v - y)
        cost = self._rates.of_connection(straight) if straight <= longest else inf
        return RouteArc(start, end, cost, evaluated=False, longest=longest)

    def _find_entries_and_exits(self) -> None:
        on = {self._cut(*place): None for place in self._near(self.places[0])}
        off = {self._cut(*place): None for place in self._near(self.places[1])}
        self.entries = [self._connection(0, vertex) for vertex in on]
        self.exits = [self._connection(vertex, 1) for vertex in off]

    def _exit_from_closed(self, lanes: list[_Lane]) -> RouteArc | None:
        nearest = [(*lane.edge.line.nearest(*self.places[1]), lane) for lane in lanes]
        able = [item for item in nearest if self._is_free(item[2], item[0])]
        if not able:
            return None
        along, _, lane = min(able, key=lambda item: item[1])
        return self._connection(self._cut(lane, along), 1)

    def _near(self, place: tuple[float, float]) -> list[tuple[_Lane, float]]:
        """Return lanes and arc lengths near a place: ahead of and behind it, and nearest nodes."""
        found = []
        for lane in self._lanes.values():
            along, distance = lane.edge.line.nearest(*place)
            lead, length = max(LEAD, LEAD_SHARE * distance), lane.edge.line.length
            for at in (max(0.0, along - lead), min(length, along + lead)):
                found.append((distance, lane, at))
        found.sort(key=lambda item: item[0])
        near = found[: 2 * self._rates.parameters.places]
        ends = [
            (hypot(x - place[0], y - place[1]), lane, at)
            for lane in self._lanes.values()
            for at in (0.0, lane.edge.line.length)
            for x, y in lane.edge.line.at(np.array([at]))
        ]
        ends.sort(key=lambda item: item[0])
        near += ends[: 2 * self._rates.parameters.places]
        return [(lane, at) for _, lane, at in near if self._is_free(lane, at)]

    def _find_detours(self) -> None:
        """Add detours around obstacles: back to the same lane, or to the next one past a node."""
        if self._rates.parameters.detour <= 0.0:
            return
        for lane in self._lanes.values():
            for begin, end in _widened(lane.obstacles, lane.edge.line.length):
                before = self._vertex_beside(lane, begin, toward_end=True)
                after = self._vertex_beside(lane, end, toward_end=False)
                if before is not None and after is not None:
                    self._add_detours(lane, before, after, end - begin)
                elif before is not None or after is not None:
                    self._record_blocked_node(lane, end - begin, before, after)
        for node, arrivals in self._arrivals.items():
            for start, there in arrivals:
                for end, on in self._departures.get(node, ()):
                    if start != end:
                        longest = there + on + self._rates.parameters.detour
                        self._detours.append(self._connection(start, end, longest))

    def _vertex_beside(self, lane: _Lane, along: float, *, toward_end: bool) -> int | None:
        """Return the vertex next to an obstacle; None if the obstacle covers the lane's end."""
        at_end = along <= 0.0 if toward_end else along >= lane.edge.line.length
        if at_end and not self._is_free(lane, along):
            return None
        return self._cut(lane, along)

    def _add_detours(self, lane: _Lane, before: int, after: int, length: float) -> None:
        longest = length + self._rates.parameters.detour
        self._detours.append(self._connection(before, after, longest))
        if not lane.edge.one_way:
            self._detours.append(self._connection(after, before, longest))

    def _record_blocked_node(
        self, lane: _Lane, length: float, before: int | None, after: int | None
    ) -> None:
        """Record a lane with an obstacle on its node, to be left before and rejoined after it."""
        vertex = before if before is not None else after
        node = self._nodes[lane.edge.end if before is not None else lane.edge.start]
        assert vertex is not None
        if before is not None or not lane.edge.one_way:
            self._arrivals.setdefault(node, []).append((vertex, length))
        if before is None or not lane.edge.one_way:
            self._departures.setdefault(node, []).append((vertex, length))


def blocked(costs: CostGrid, points: FloatArray) -> NDArray[np.bool_]:
    """Return (n,) bool: whether the cells at points (n, 2), map frame, are inscribed or lethal."""
    under = costs_under(costs, points)
    return (under >= INSCRIBED_COST) & (under <= LETHAL_COST)


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last index of each run of true values."""
    steps = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def _widened(obstacles: list[tuple[float, float]], length: float) -> list[tuple[float, float]]:
    """Return the intervals extended by DETOUR_MARGIN at both ends, joined where they overlap."""
    wide: list[tuple[float, float]] = []
    for begin, end in obstacles:
        low, high = max(0.0, begin - DETOUR_MARGIN), min(length, end + DETOUR_MARGIN)
        if wide and low <= wide[-1][1]:
            low = wide.pop()[0]
        wide.append((low, high))
    return wide
