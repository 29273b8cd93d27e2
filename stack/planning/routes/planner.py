"""Planning along the lanes of a route graph, as fleets and shared floors want it."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from math import hypot, inf
from pathlib import Path as FilePath
from typing import ClassVar

import numpy as np

from stack.components import (
    DEFAULT_PLAN_OPTIONS,
    CancelToken,
    Planner,
    PlanOptions,
    choose,
    plan_with_options,
)
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError, ParameterError
from stack.planning.routes.geojson import read_route_graph
from stack.planning.routes.graph import RouteGraph
from stack.planning.routes.network import LEAD, LEAD_SHARE, SLACK, Network, Rates
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.search import Arc, cheapest_looked_at
from stack.planning.routes.shaping import Shape, path_along
from stack.planning.smoothing import SPACING, resampled
from stack.types import CostGrid, FailureCode, FloatArray, Path, Pose2D

_SAME_PLACE = 0.1  # m; a way that ends farther from where it should leads elsewhere

_OF_START = (FailureCode.START_OCCUPIED, FailureCode.START_OUTSIDE_MAP)
_OF_GOAL = (FailureCode.GOAL_OCCUPIED, FailureCode.GOAL_OUTSIDE_MAP)


class Route:
    """Along the lanes of a route graph: through free space on to it, along it, and off it again.

    The cheapest way by time or distance that keeps to one-ways and closures; what stands on a lane
    is gone round near by or avoided by other lanes. The speed limits of the lanes go into the path.
    Where start and goal are so near that the lanes are no help, the way is through free space.

    Args:
        parameters: the graph's file, absolute or relative to the current folder, and weights.
        robot: its top speed, and its turning radius for the corners.

    Raises:
        InputError: the graph cannot be read.
        ParameterError: there is no graph, or a planner of routes is to plan the ways on to them.
    """

    Parameters: ClassVar[type] = RouteParameters

    def __init__(self, parameters: RouteParameters, robot: RobotDescription) -> None:
        if not parameters.graph:
            raise ParameterError(
                "graph", "route needs a graph", "write graph: routes/office.geojson"
            )
        if parameters.connect == "route":
            raise ParameterError("connect", "route cannot plan the ways on to its own lanes")
        self.graph = read_route_graph(FilePath(parameters.graph))
        name = parameters.connect or ("hybrid_astar" if robot.turning_radius > 0.0 else "astar")
        choice = choose("planner", name, {})
        self._connect: Planner = choice.component(choice.parameters, robot)
        self._is_car = robot.turning_radius > 0.0
        top = robot.limits.linear_speed
        self._rates = Rates(
            parameters.cost == "time", top, parameters.off_route, parameters.detour,
            parameters.places,
        )  # fmt: skip
        radius = max(parameters.corner_radius, 1.1 * robot.turning_radius)
        self._shape = Shape(radius, top, keeps_connections=self._is_car)

    @staticmethod
    def located(parameters: RouteParameters, folder: FilePath) -> RouteParameters:
        """The same with the graph looked for in a folder."""
        if not parameters.graph:
            return parameters
        return replace(parameters, graph=str(folder / FilePath(parameters.graph).expanduser()))

    def with_edge(self, edge: str, *, closed: bool) -> Route:
        """The same planner with an edge closed or opened; plans under way keep to the old one.

        Raises:
            ParameterError: there is no such edge.
        """
        changed = copy(self)
        changed.graph = self.graph.with_edge(edge, closed=closed)
        return changed

    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """A path of poses 5 cm apart from start to goal, with the speed limits of its lanes.

        Of the terms only `cancel` counts: half a way is none where lanes are the rule.

        Raises:
            NavigationError: NO_VALID_PATH where the lanes do not lead there; else as the planner of
                the ways on to them and off them.
        """
        network = Network(self.graph, costs, self._rates, (start, goal))
        look = partial(self._look, network, costs, (start, goal), options.cancel)
        self._limit(network, look)
        arcs = cheapest_looked_at(network.arcs, 0, 1, look)
        if arcs is None:
            raise NavigationError(FailureCode.NO_VALID_PATH, self._no_way(network, start, goal))
        if len(arcs) == 1 and arcs[0].path is not None:
            return arcs[0].path
        return path_along(arcs, costs, self._shape, goal.heading)

    def _limit(self, network: Network, look: Callable[[Arc], None]) -> None:
        """Hold the ways on to the lanes and off them against the shortest there is.

        Else a long way through free space would take the place of a lane that is closed. To the
        goal, a closed lane is a way as well: a goal on it is not left for the next open one.
        """
        shortest = []
        for ways in (network.ways_on, network.ways_off):
            closed = network.way_off_closed if ways is network.ways_off else None
            considered = [*ways, *([closed] if closed else [])]
            least = inf
            for arc in sorted(considered, key=network.straight):
                if network.straight(arc) >= least:
                    break
                look(arc)
                found = (way.path for way in (*considered, *ways) if way.path is not None)
                least = min([least, *(path.length for path in found)])
            for arc in ways:
                arc.longest = least + max(SLACK, LEAD_SHARE * least)
                arc.cost = inf if network.straight(arc) > arc.longest else arc.cost
                arc.cost = inf if arc.path and arc.path.length > arc.longest else arc.cost
            shortest.append(least)
        network.straight_on.longest = sum(shortest) + SLACK

    def _look(
        self,
        network: Network,
        costs: CostGrid,
        ends: tuple[Pose2D, Pose2D],
        cancel: CancelToken,
        arc: Arc,
    ) -> None:
        """Find out what a way through free space costs."""
        cancel.check()
        arc.looked_at, arc.cost = True, inf
        start, goal = self._poses(network, ends, arc)
        try:
            path = plan_with_options(
                self._connect, costs, (start, goal), PlanOptions(cancel=cancel)
            )
        except NavigationError as error:
            code = error.failure.code
            if code == FailureCode.CANCELLED:
                raise
            if (arc.start == 0 and code in _OF_START) or (arc.end == 1 and code in _OF_GOAL):
                raise
            return
        elsewhere = arc.end != 1 and path.goal.distance_to(goal) > _SAME_PLACE
        if elsewhere or path.length > arc.longest:
            return
        arc.path, arc.cost = path, self._rates.of_connection(path.length)
        if not self._is_car:
            self._shorten(network, arc, path)

    def _poses(
        self, network: Network, ends: tuple[Pose2D, Pose2D], arc: Arc
    ) -> tuple[Pose2D, Pose2D]:
        """Where a way through free space begins and ends: on lanes in their direction."""
        (x, y), (u, v) = network.places[arc.start], network.places[arc.end]
        bearing = float(np.arctan2(v - y, u - x))
        start = ends[0] if arc.start == 0 else Pose2D(x, y, network.heading(arc.start, bearing))
        goal = ends[1] if arc.end == 1 else Pose2D(u, v, network.heading(arc.end, bearing))
        return start, goal

    def _shorten(self, network: Network, arc: Arc, path: Path) -> None:
        """Let a way on to the lanes, or off them, also end where it first comes to one."""
        points = path.points[:, :2]
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        if arc.start == 0:
            late = int(np.searchsorted(along, LEAD))
            touched = network.touched(points[late:])
            if touched is not None:
                self._add(network, (0, touched[1]), points[: late + touched[0] + 1])
        if arc.end == 1:
            early = int(np.searchsorted(along[-1] - along[::-1], LEAD))
            touched = network.touched(points[::-1][early:])
            if touched is not None:
                first = len(points) - 1 - early - touched[0]
                self._add(network, (touched[1], 1), points[first:])

    def _add(self, network: Network, ends: tuple[int, int], points: FloatArray) -> None:
        if ends[0] == ends[1] or len(points) < 2:
            return
        if ends[0] == 0:
            gap = np.array([points[-1], network.places[ends[1]]])
            joined = np.vstack([points, resampled(gap, SPACING)[1:]])
        else:
            gap = np.array([network.places[ends[0]], points[0]])
            joined = np.vstack([resampled(gap, SPACING)[:-1], points])
        path = Path(np.column_stack([joined, np.zeros(len(joined))]))
        cost = self._rates.of_connection(path.length)
        network.connect(Arc(*ends, cost, path=path))

    def _no_way(self, network: Network, start: Pose2D, goal: Pose2D) -> str:
        """Why there is no way, with the nodes nearest to start and goal and what is in the way."""
        words = [
            f"the route graph does not lead from ({start.x:.2f}, {start.y:.2f}) to "
            f"({goal.x:.2f}, {goal.y:.2f}): {_nearest(self.graph, start)} is nearest to the start, "
            f"{_nearest(self.graph, goal)} to the goal"
        ]
        blocked = [f"{name} at ({x:.2f}, {y:.2f})" for name, (x, y) in network.blocked.items()]
        closed = [name for name, edge in self.graph.edges.items() if edge.closed]
        words += [f"blocked: {', '.join(blocked[:5])}"] if blocked else []
        words += [f"closed: {', '.join(closed[:5])}"] if closed else []
        return "; ".join(words)


def _nearest(graph: RouteGraph, pose: Pose2D) -> str:
    def distance(name: str) -> float:
        x, y = graph.nodes[name]
        return hypot(x - pose.x, y - pose.y)

    name = min(graph.nodes, key=distance)
    return f"the node {name}, {distance(name):.2f} m away,"
