"""The lanes as they can be driven now, cut where one gets on, off, and round what stands there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot, inf, pi

import numpy as np
from numpy.typing import NDArray

from stack.planning.routes.graph import RouteEdge, RouteGraph
from stack.planning.routes.search import Arc
from stack.types import INSCRIBED_COST, LETHAL_COST, CostGrid, FloatArray, Pose2D, wrap_angle

LEAD, LEAD_SHARE = 0.3, 0.5
"""Metres, and share of the distance from the lane, by which one gets on ahead of the nearest place:
a robot that is on the lane already drives on along it."""

SLACK = 1.0
"""Metres by which a way on to the lanes or off them may be longer than the shortest."""

TOUCH = 0.2
"""Metres from a lane within which a way through free space has come to it."""

MARGIN = 0.5
"""Metres before and after what stands on a lane at which one leaves it and comes back."""


@dataclass(frozen=True, slots=True)
class Rates:
    """What driving costs.

    Attributes:
        by_time: in seconds instead of metres.
        top_speed: of the robot, m/s.
        off_route: how many times a metre (or second) off the lanes counts.
        detour: metres by which a way round what stands on a lane may be longer than the lane.
        places: how many edges and nodes are tried as the place to get on or off.
    """

    by_time: bool
    top_speed: float
    off_route: float
    detour: float
    places: int

    def of_lane(self, edge: RouteEdge, length: float) -> float:
        """What a stretch of a lane costs."""
        speed = min(self.top_speed, edge.limit(self.top_speed))
        return edge.weight * (length / speed if self.by_time else length)

    def of_connection(self, length: float) -> float:
        """What a way through free space costs."""
        return self.off_route * (length / self.top_speed if self.by_time else length)


@dataclass(slots=True)
class _Lane:
    """An open edge with the vertices on it, by metres from its beginning."""

    edge: RouteEdge
    cuts: dict[float, int]
    stops: list[tuple[float, float]]  # stretches that cannot be driven


class Network:
    """Vertices and arcs of one query.

    Vertex 0 is where the plan begins and vertex 1 where it ends.

    Attributes:
        places: (x, y) of each vertex, map frame, metres.
        blocked: ids of the edges on which something stands, and where it begins.
        straight_on: the way from start to goal without any lane.
        ways_on: through free space from the start to lanes.
        ways_off: through free space from lanes to the goal.
        way_off_closed: the shortest of those from lanes that are closed; for comparison only.
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
        self.way_off_closed = self._way_off_closed(
            [lane for lane in lanes.values() if lane.edge.closed]
        )
        self.straight_on = self._connection(0, 1)
        self.ways_on: list[Arc] = []
        self.ways_off: list[Arc] = []
        self._detours: list[Arc] = []
        self._samples = self._free_samples()
        self._get_round()
        self._get_on_and_off()

    def arcs(self) -> list[Arc]:
        """Every lane's stretches that can be driven, and every way through free space."""
        found = [arc for lane in self._lanes.values() for arc in self._stretches(lane)]
        return [self.straight_on, *self.ways_on, *self.ways_off, *self._detours, *found]

    def straight(self, arc: Arc) -> float:
        """Metres between the ends of an arc as the crow flies."""
        (x, y), (u, v) = self.places[arc.start], self.places[arc.end]
        return hypot(u - x, v - y)

    def touched(self, points: FloatArray) -> tuple[int, int] | None:
        """The first of some points (n, 2) that lies on a lane, and the vertex there; None if none.

        What stands on lanes is not touched.
        """
        if not len(self._samples[0]):
            return None
        near = np.linalg.norm(points[:, None] - self._samples[0][None], axis=2)
        hits = np.flatnonzero(near.min(axis=1) <= TOUCH)
        if not hits.size:
            return None
        lane, _ = self._samples[1][int(near[hits[0]].argmin())]
        x, y = points[hits[0]]
        along, _ = lane.edge.line.nearest(float(x), float(y))
        return (int(hits[0]), self._cut(lane, along)) if self._can_stand(lane, along) else None

    def heading(self, vertex: int, bearing: float) -> float:
        """The direction of the lane at a vertex, of its two the one nearer to a bearing."""
        if vertex not in self._on_lane:
            return bearing
        lane, along = self._on_lane[vertex]
        ends = np.array([along - 0.05, along + 0.05])
        (x, y), (u, v) = lane.edge.line.at(ends)
        direction = atan2(v - y, u - x)
        turned = abs(wrap_angle(direction - bearing)) > 0.5 * pi
        return wrap_angle(direction + pi) if turned else direction

    def connect(self, arc: Arc) -> None:
        """Add a way on to the lanes, or off them."""
        (self.ways_on if arc.start == 0 else self.ways_off).append(arc)

    # Building

    def _vertex(self, x: float, y: float) -> int:
        self.places.append((x, y))
        return len(self.places) - 1

    def _lane(self, edge: RouteEdge) -> _Lane:
        ends = {0.0: self._nodes[edge.start], edge.line.length: self._nodes[edge.end]}
        lane = _Lane(edge, ends, [])
        at = edge.line.samples(self._costs.resolution)
        for begin, end in _runs(blocked(self._costs, edge.line.at(at))):
            lane.stops.append((float(at[begin]), float(at[end])))
        if lane.stops and not edge.closed:
            x, y = edge.line.at(np.array(lane.stops[0][:1]))[0]
            self.blocked[edge.id] = (round(float(x), 2), round(float(y), 2))
        return lane

    def _cut(self, lane: _Lane, along: float) -> int:
        """The vertex at a place of a lane, a new one where there is none near."""
        for known, vertex in lane.cuts.items():
            if abs(known - along) < 0.5 * self._costs.resolution:
                return vertex
        x, y = lane.edge.line.at(np.array([along]))[0]
        lane.cuts[along] = vertex = self._vertex(float(x), float(y))
        self._on_lane[vertex] = (lane, along)
        return vertex

    def _can_stand(self, lane: _Lane, along: float) -> bool:
        return not any(begin <= along <= end for begin, end in lane.stops)

    def _free_samples(self) -> tuple[FloatArray, list[tuple[_Lane, float]]]:
        """(k, 2) places on lanes where nothing stands, close together, and whose they are."""
        owners = [
            (lane, float(along))
            for lane in self._lanes.values()
            for along in lane.edge.line.samples(TOUCH)
            if self._can_stand(lane, float(along))
        ]
        points = [lane.edge.line.at(np.array([along])) for lane, along in owners]
        return (np.vstack(points) if points else np.empty((0, 2))), owners

    def _stretches(self, lane: _Lane) -> Iterator[Arc]:
        for (begin, start), (end, last) in pairwise(sorted(lane.cuts.items())):
            if any(low <= end and high >= begin for low, high in lane.stops):
                continue
            cost = self._rates.of_lane(lane.edge, end - begin)
            line = lane.edge.line
            yield Arc(start, last, cost, line.between(begin, end), lane.edge)
            if not lane.edge.one_way:
                yield Arc(last, start, cost, line.between(end, begin), lane.edge)

    def _connection(self, start: int, end: int, longest: float = inf) -> Arc:
        (x, y), (u, v) = self.places[start], self.places[end]
        straight = hypot(u - x, v - y)
        cost = self._rates.of_connection(straight) if straight <= longest else inf
        return Arc(start, end, cost, looked_at=False, longest=longest)

    def _get_on_and_off(self) -> None:
        on = {self._cut(*place): None for place in self._near(self.places[0])}
        off = {self._cut(*place): None for place in self._near(self.places[1])}
        self.ways_on = [self._connection(0, vertex) for vertex in on]
        self.ways_off = [self._connection(vertex, 1) for vertex in off]

    def _way_off_closed(self, lanes: list[_Lane]) -> Arc | None:
        nearest = [(*lane.edge.line.nearest(*self.places[1]), lane) for lane in lanes]
        able = [item for item in nearest if self._can_stand(item[2], item[0])]
        if not able:
            return None
        along, _, lane = min(able, key=lambda item: item[1])
        return self._connection(self._cut(lane, along), 1)

    def _near(self, place: tuple[float, float]) -> list[tuple[_Lane, float]]:
        """Places of lanes near one: ahead and behind the nearest, and the nearest nodes."""
        found = []
        for lane in self._lanes.values():
            along, distance = lane.edge.line.nearest(*place)
            lead, length = max(LEAD, LEAD_SHARE * distance), lane.edge.line.length
            for at in (max(0.0, along - lead), min(length, along + lead)):
                found.append((distance, lane, at))
        found.sort(key=lambda item: item[0])
        near = found[: 2 * self._rates.places]
        ends = [
            (hypot(x - place[0], y - place[1]), lane, at)
            for lane in self._lanes.values()
            for at in (0.0, lane.edge.line.length)
            for x, y in lane.edge.line.at(np.array([at]))
        ]
        ends.sort(key=lambda item: item[0])
        near += ends[: 2 * self._rates.places]
        return [(lane, at) for _, lane, at in near if self._can_stand(lane, at)]

    def _get_round(self) -> None:
        """Ways off the lane and back on to it, or on to the next one, round what stands there."""
        if self._rates.detour <= 0.0:
            return
        for lane in self._lanes.values():
            for begin, end in _widened(lane.stops, lane.edge.line.length):
                before = self._side(lane, begin, toward_end=True)
                after = self._side(lane, end, toward_end=False)
                if before is not None and after is not None:
                    self._add_detours(lane, before, after, end - begin)
                elif before is not None or after is not None:
                    self._gate(lane, end - begin, before, after)
        for node, ways in self._arrivals.items():
            for start, there in ways:
                for end, on in self._departures.get(node, ()):
                    if start != end:
                        longest = there + on + self._rates.detour
                        self._detours.append(self._connection(start, end, longest))

    def _side(self, lane: _Lane, along: float, *, toward_end: bool) -> int | None:
        """The vertex beside an obstacle; None where the lane's end lies in it."""
        at_end = along <= 0.0 if toward_end else along >= lane.edge.line.length
        if at_end and not self._can_stand(lane, along):
            return None
        return self._cut(lane, along)

    def _add_detours(self, lane: _Lane, before: int, after: int, length: float) -> None:
        longest = length + self._rates.detour
        self._detours.append(self._connection(before, after, longest))
        if not lane.edge.one_way:
            self._detours.append(self._connection(after, before, longest))

    def _gate(self, lane: _Lane, length: float, before: int | None, after: int | None) -> None:
        """Something stands on a node: one may get from the lanes that lead there to those on."""
        vertex = before if before is not None else after
        node = self._nodes[lane.edge.end if before is not None else lane.edge.start]
        assert vertex is not None
        if before is not None or not lane.edge.one_way:
            self._arrivals.setdefault(node, []).append((vertex, length))
        if before is None or not lane.edge.one_way:
            self._departures.setdefault(node, []).append((vertex, length))


def blocked(costs: CostGrid, points: FloatArray) -> NDArray[np.bool_]:
    """(n,) bool: whether the robot would collide with its middle at points (n, 2), map frame."""
    rows, columns = costs.cells.shape
    column, row = np.floor((points - costs.origin) / costs.resolution).astype(int).T
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = np.zeros(len(points), dtype=np.bool_)
    under = costs.cells[row[inside], column[inside]]
    found[inside] = (under >= INSCRIBED_COST) & (under <= LETHAL_COST)
    return found


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of true values."""
    steps = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def _widened(stops: list[tuple[float, float]], length: float) -> list[tuple[float, float]]:
    """The stretches with room before and after, joined where they then overlap."""
    wide: list[tuple[float, float]] = []
    for begin, end in stops:
        low, high = max(0.0, begin - MARGIN), min(length, end + MARGIN)
        if wide and low <= wide[-1][1]:
            low = wide.pop()[0]
        wide.append((low, high))
    return wide
