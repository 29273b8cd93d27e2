"""The way that a run is measured against: the shortest that the true world allows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Pose2D

ROOM = 1.0
"""Metres of floor round start and goal."""

RESOLUTION = 0.025
"""Metres: fine enough that no gap which the robot fits through is drawn shut."""


def shortest_way(world: World, robot: RobotDescription, start: Pose2D, goal: Pose2D) -> float:
    """Metres of the shortest way for a disc of the robot's inscribed radius.

    Round everything that stands, whether maps show it or not; doors count as open.

    Args:
        world: the place.
        robot: who crosses it.
        start: world frame.
        goal: world frame.

    Raises:
        NavigationError: there is no way.
    """
    return shortest_ways(world, robot, (start, goal))(start, goal)


def shortest_ways(
    world: World, robot: RobotDescription, stops: Sequence[Pose2D]
) -> Callable[[Pose2D, Pose2D], float]:
    """The same from any of several places to any other.

    Args:
        world: the place.
        robot: who crosses it.
        stops: what the ways will lead between, world frame.
    """
    from stack.costmap.costmap import Costmap
    from stack.costmap.parameters import CostmapParameters
    from stack.planning.astar import Astar, AstarParameters
    from stack.sim.worlds.rasterise import rasterise

    x_min, y_min, x_max, y_max = world.bounds
    bounds = (
        min(x_min, *(stop.x - ROOM for stop in stops)),
        min(y_min, *(stop.y - ROOM for stop in stops)),
        max(x_max, *(stop.x + ROOM for stop in stops)),
        max(y_max, *(stop.y + ROOM for stop in stops)),
    )
    whole = replace(
        world,
        bounds=bounds,
        start=stops[0],
        walls=tuple(replace(item, on_map=True) for item in world.walls),
        boxes=tuple(replace(item, on_map=True) for item in world.boxes),
        cylinders=tuple(replace(item, on_map=True) for item in world.cylinders),
    )
    radius = robot.footprint.inscribed_radius
    costs = Costmap(
        CostmapParameters(inflation_radius=radius), robot.footprint, rasterise(whole, RESOLUTION)
    )
    planner = Astar(AstarParameters(cost_weight=0.0), robot)
    return lambda start, goal: planner.plan(costs.grid, start, goal).length
