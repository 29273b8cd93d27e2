"""Length of the shortest path through the true world, the reference for the driven distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Pose2D

MARGIN = 1.0
"""Metres of free space around start and goal."""

RESOLUTION = 0.025
"""Metres; fine enough that rasterising closes no gap through which the robot fits."""


def shortest_path_lengths(
    world: World, robot: RobotDescription, stops: Sequence[Pose2D]
) -> Callable[[Pose2D, Pose2D], float]:
    """Return the function that gives the length of the shortest path between two stops, metres.

    The path is that of a disc of the robot's inscribed radius. It avoids all static obstacles, on
    the map or not; doors count as open. The function raises NavigationError if there is no path.

    Args:
        world: the world.
        robot: the robot whose radius counts.
        stops: starts and goals, world frame.
    """
    from stack.costmap.costmap import Costmap
    from stack.costmap.parameters import CostmapParameters
    from stack.planning.astar import Astar, AstarParameters
    from stack.sim.worlds.rasterise import rasterise

    x_min, y_min, x_max, y_max = world.bounds
    bounds = (
        min(x_min, *(stop.x - MARGIN for stop in stops)),
        min(y_min, *(stop.y - MARGIN for stop in stops)),
        max(x_max, *(stop.x + MARGIN for stop in stops)),
        max(y_max, *(stop.y + MARGIN for stop in stops)),
    )
    with_all_obstacles = replace(
        world,
        bounds=bounds,
        start=stops[0],
        walls=tuple(replace(item, on_map=True) for item in world.walls),
        boxes=tuple(replace(item, on_map=True) for item in world.boxes),
        cylinders=tuple(replace(item, on_map=True) for item in world.cylinders),
    )
    radius = robot.footprint.inscribed_radius
    costs = Costmap(
        CostmapParameters(inflation_radius=radius),
        robot.footprint,
        rasterise(with_all_obstacles, RESOLUTION),
    )
    planner = Astar(AstarParameters(cost_weight=0.0), robot)
    return lambda start, goal: planner.plan(costs.grid, start, goal).length
