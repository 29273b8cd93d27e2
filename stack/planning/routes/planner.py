"""Route planner: paths along the lanes of a route graph."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from math import hypot, inf
from pathlib import Path as FilePath
from typing import ClassVar

import numpy as np

from stack.compilation import KernelTypes
from stack.components import (
    DEFAULT_PLAN_OPTIONS,
    CancelToken,
    Planner,
    PlanOptions,
    choose,
)
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError, ParameterError
from stack.planning.routes.geojson import read_route_graph
from stack.planning.routes.graph import RouteGraph
from stack.planning.routes.network import CONNECTION_SLACK, LEAD, LEAD_SHARE, Network, Rates
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.search import RouteArc, cheapest_evaluated
from stack.planning.routes.shaping import RouteShape, path_along
from stack.planning.smoothing import POSE_SPACING, resampled
from stack.types import CostGrid, FailureCode, FloatArray, Path, Pose2D

_SAME_PLACE = 0.1  # m; a connection that ends farther from its target is discarded

_OF_START = (FailureCode.START_OCCUPIED, FailureCode.START_OUTSIDE_MAP)
_OF_GOAL = (FailureCode.GOAL_OCCUPIED, FailureCode.GOAL_OUTSIDE_MAP)


class Route(Planner):
    """Route planner: along the lanes of a graph, with connections to start and goal.

    The path is the cheapest by time or distance that respects one-way lanes and closures. It
    avoids an obstacle on a lane by a short detour or by other lanes, and carries the speed limits
    of the lanes. If start and goal are closer than the lanes, the path leads through free space.

    Args:
        parameters: file of the graph, absolute or relative to the current folder, and weights.
        robot: its top speed, and its turning radius for the corners.

    Raises:
        InputError: the graph cannot be read.
        ParameterError: no graph is set, or `connect` is the route planner itself.
    """

    Parameters: ClassVar[type] = RouteParameters
    has_route_graph: ClassVar[bool] = True

    def __init__(self, parameters: RouteParameters, robot: RobotDescription) -> None:
        if not parameters.graph:
            raise ParameterError(
                "graph", "route needs a route graph", "write graph: routes/office.geojson"
            )
        if parameters.connect == "route":
            raise ParameterError(
                "connect", "route cannot connect to its own lanes", "use another planner"
            )
        super().__init__(parameters, robot)
        self.graph = read_route_graph(FilePath(parameters.graph))
        choice = choose("planner", _connecting(parameters, robot), {})
        self._connect: Planner = choice.create(robot)
        self._is_car = robot.turning_radius > 0.0
        top = robot.limits.linear_speed
        self._rates = Rates(parameters, top)
        radius = max(parameters.corner_radius, 1.1 * robot.turning_radius)
        self._shape = RouteShape(radius, top, keeps_connections=self._is_car)

    @staticmethod
    def kernels(parameters: RouteParameters, robot: RobotDescription) -> KernelTypes:
        return choose("planner", _connecting(parameters, robot), {}).kernels(robot)

    @staticmethod
    def located(parameters: RouteParameters, folder: FilePath) -> RouteParameters:
        """Return the parameters with the path of the graph relative to a folder."""
        if not parameters.graph:
            return parameters
        return replace(parameters, graph=str(folder / FilePath(parameters.graph).expanduser()))

    def with_edge(self, edge: str, *, closed: bool) -> Route:
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
        """Return a path of poses 5 cm apart from start to goal, with the speed limits of its lanes.

        Of the options only `cancel` has an effect: there are no partial plans on a route graph.

        Raises:
            NavigationError: NO_VALID_PATH if no lanes lead to the goal; else as the planner of the
                connections.
        """
        network = Network(self.graph, costs, self._rates, (start, goal))
        evaluate = partial(self._evaluate, network, costs, (start, goal), options.cancel)
        self._limit(network, evaluate)
        arcs = cheapest_evaluated(network.arcs, 0, 1, evaluate)
        if arcs is None:
            raise NavigationError(
                FailureCode.NO_VALID_PATH, self._failure_text(network, start, goal)
            )
        if len(arcs) == 1 and arcs[0].path is not None:
            return arcs[0].path
        return path_along(arcs, costs, self._shape, goal.heading)

    def _limit(self, network: Network, evaluate: Callable[[RouteArc], None]) -> None:
        """Discard entries and exits that are much longer than the shortest.

        Else a long connection through free space could replace a closed lane. For exits, closed
        lanes count as well: a goal on a closed lane is not reached from a far open one.
        """
        shortest = []
        for connections in (network.entries, network.exits):
            closed = network.exit_from_closed if connections is network.exits else None
            considered = [*connections, *([closed] if closed else [])]
            least = inf
            for arc in sorted(considered, key=network.straight_length):
                if network.straight_length(arc) >= least:
                    break
                evaluate(arc)
                paths = (item.path for item in (*considered, *connections))
                least = min([least, *(path.length for path in paths if path is not None)])
            for arc in connections:
                arc.longest = least + max(CONNECTION_SLACK, LEAD_SHARE * least)
                arc.cost = inf if network.straight_length(arc) > arc.longest else arc.cost
                arc.cost = inf if arc.path and arc.path.length > arc.longest else arc.cost
            shortest.append(least)
        network.direct.longest = sum(shortest) + CONNECTION_SLACK

    def _evaluate(
        self,
        network: Network,
        costs: CostGrid,
        ends: tuple[Pose2D, Pose2D],
        cancel: CancelToken,
        arc: RouteArc,
    ) -> None:
        """Plan a connection through free space and set its path and cost."""
        cancel.check()
        arc.evaluated, arc.cost = True, inf
        start, goal = self._poses(network, ends, arc)
        try:
            options = PlanOptions(cancel=cancel)
            path = self._connect.plan(costs, start, goal, options=options)
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
        self, network: Network, ends: tuple[Pose2D, Pose2D], arc: RouteArc
    ) -> tuple[Pose2D, Pose2D]:
        """Return start and goal of a connection; on a lane they have its direction."""
        (x, y), (u, v) = network.places[arc.start], network.places[arc.end]
        bearing = float(np.arctan2(v - y, u - x))
        start = ends[0] if arc.start == 0 else Pose2D(x, y, network.heading(arc.start, bearing))
        goal = ends[1] if arc.end == 1 else Pose2D(u, v, network.heading(arc.end, bearing))
        return start, goal

    def _shorten(self, network: Network, arc: RouteArc, path: Path) -> None:
        """Add the part of an entry or exit up to the first lane that it touches."""
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
            joined = np.vstack([points, resampled(gap, POSE_SPACING)[1:]])
        else:
            gap = np.array([network.places[ends[0]], points[0]])
            joined = np.vstack([resampled(gap, POSE_SPACING)[:-1], points])
        path = Path(np.column_stack([joined, np.zeros(len(joined))]))
        cost = self._rates.of_connection(path.length)
        network.connect(RouteArc(*ends, cost, path=path))

    def _failure_text(self, network: Network, start: Pose2D, goal: Pose2D) -> str:
        """Return the error message: nearest nodes, blocked edges and closed edges."""
        words = [
            f"no path on the route graph from ({start.x:.2f}, {start.y:.2f}) to "
            f"({goal.x:.2f}, {goal.y:.2f}): nearest to the start is {_nearest(self.graph, start)}; "
            f"nearest to the goal is {_nearest(self.graph, goal)}"
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
    return f"node {name}, {distance(name):.2f} m away"


def _connecting(parameters: RouteParameters, robot: RobotDescription) -> str:
    """Return the name of the planner between the lanes and free places."""
    return parameters.connect or ("hybrid_astar" if robot.turning_radius > 0.0 else "astar")
