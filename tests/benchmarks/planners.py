"""All planners side by side on generated office maps: `run()` gives a row each."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from stack.components import Planner, choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.costmap.route_costs import route_cost
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.planning.astar import Astar, AstarParameters
from stack.streams import stream
from stack.types import INSCRIBED_COST, LETHAL_COST, CostGrid, Footprint, Path, Pose2D
from tests.benchmarks.navfn import navfn_path, path_cost
from tests.benchmarks.planning import ROBOT
from tests.stack.planning.footprint_check import footprint_cost
from tests.stack.planning.office_maps import office

BOX = Footprint(
    np.array([[0.254, -0.215], [0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215]])
)  # a Jackal's outline
ROBOTS = {"round 0.22 m": ROBOT, "box 0.51 x 0.43 m": replace(ROBOT, footprint=BOX)}
PLANNERS: dict[str, tuple[str, dict[str, Any]]] = {
    "astar": ("astar", {}),
    "theta_star": ("theta_star", {}),
    "hybrid_astar (reeds_shepp)": ("hybrid_astar", {}),
    "hybrid_astar (dubins)": ("hybrid_astar", {"motion": "dubins"}),
    "lattice": ("lattice", {}),
}
SMOOTHERS = ("none", "savitzky_golay", "constrained")
Query = tuple[CostGrid, Pose2D, Pose2D, Path, float | None]


def run(side: int = 400, queries: int = 30) -> list[dict[str, Any]]:
    """Rows with the share of plans found, times, and length and cost over those of other paths.

    Lengths and costs are medians over astar's; NavFn's costs are compared by mean and worst.

    Asked are queries that astar can plan for a point, between poses in which the robot stands
    clear; without a turning circle that is not to say that there is a way for the robot.

    Args:
        side: cells of the offices.
        queries: random queries for each robot, in three offices.
    """
    rows = []
    for name, robot in ROBOTS.items():
        asked = queries_for(robot, side, queries)
        for label, (planner, values) in PLANNERS.items():
            rows.append(
                {"planner": label, "robot": name, **measured(planner, values, robot, asked)}
            )
    asked = queries_for(ROBOT, side, queries)
    for smoother in SMOOTHERS:
        row = measured("astar", {"smoother": smoother}, ROBOT, asked)
        rows.append({"planner": f"astar, smoother {smoother}", "robot": "round 0.22 m", **row})
    return rows


def queries_for(robot: RobotDescription, side: int, count: int) -> list[Query]:
    """Costs, start, goal and astar's path between clear poses, and the cost of NavFn's path."""
    found: list[Query] = []
    for seed in range(3):
        costs = Costmap(CostmapParameters(), robot.footprint, office(side, seed)).grid
        planner, random = Astar(AstarParameters(), robot), stream(seed, "queries")
        ways = np.argwhere(costs.cells < INSCRIBED_COST)
        while len(found) < count * (seed + 1) // 3:
            start, goal = (
                Pose2D(*costs.centre_of(*ways[n]), float(random.uniform(-np.pi, np.pi)))
                for n in random.integers(0, len(ways), 2)
            )
            clear = (footprint_cost(costs, robot.footprint, pose) for pose in (start, goal))
            if max(clear) >= LETHAL_COST:
                continue
            try:
                path = planner.plan(costs, start, goal)
            except NavigationError:
                continue
            other = navfn_path(costs, start, goal)
            cost = None if other is None else path_cost(costs, other)
            found.append((costs, start, goal, path, cost))
    return found


def measured(
    name: str, values: dict[str, Any], robot: RobotDescription, asked: list[Query]
) -> dict[str, Any]:
    """One planner's figures."""
    choice = choose("planner", name, values)
    planner: Planner = choice.component(choice.parameters, robot)
    times, lengths, costs_ratio, over_navfn = [], [], [], []
    for repeat, (costs, start, goal, reference, navfn) in enumerate([asked[0], *asked]):
        began = perf_counter()
        try:
            path = planner.plan(costs, start, goal)
        except NavigationError:
            continue
        if repeat == 0:  # loads kernels
            continue
        times.append(1e3 * (perf_counter() - began))
        if reference.length > 1.0:
            lengths.append(path.length / reference.length)
            costs_ratio.append(route_cost(costs, path.points) / route_cost(costs, reference.points))
            if navfn is not None:
                over_navfn.append(path_cost(costs, path.points) / navfn)
    return {
        "found": f"{len(times)}/{len(asked)}",
        "median_ms": round(float(np.median(times)), 2), "worst_ms": round(max(times), 1),
        "length_ratio": round(float(np.median(lengths)), 3),
        "cost_ratio": round(float(np.median(costs_ratio)), 3),
        "navfn_mean": round(float(np.mean(over_navfn)), 3),
        "navfn_worst": round(max(over_navfn), 3),
    }  # fmt: skip
