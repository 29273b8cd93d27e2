"""How fast and how good global plans are: `run()` gives one row per size of map."""

from __future__ import annotations

from pathlib import Path as FilePath
from time import perf_counter
from typing import Any

import numpy as np

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.description import RobotDescription, Wheels
from stack.errors import NavigationError
from stack.planning import kernels
from stack.planning.astar import Astar, AstarParameters
from stack.planning.search import StepCosts, Workspace
from stack.streams import stream
from stack.types import INSCRIBED_COST, CostGrid, Footprint, Pose2D, Scan
from tests.stack.planning.office_maps import office, office_costs

ROBOT = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3)
)


def run(large: bool = False, queries: int = 40) -> list[dict[str, Any]]:
    """Rows with the median and the worst time in milliseconds, and the cost ratio of plans.

    Args:
        large: also 4000 × 4000 cells (200 m × 200 m), half a gigabyte of memory.
        queries: random queries per size, in three offices.
    """
    sides = (400, 2000, 4000) if large else (400, 2000)
    rows = [plan_row(side, queries) for side in sides]
    return [*rows, *(costmap_row(window) for window in (5.0, None))]


def plan_row(side: int, queries: int) -> dict[str, Any]:
    """Plans from anywhere to anywhere in offices of side × side cells."""
    times, ratios, failed = [], [], 0
    parameters = AstarParameters()
    for seed in range(3):
        grid = office_costs(side, seed)
        planner = Astar(parameters, ROBOT)
        random = stream(seed, "queries")
        ways = np.argwhere(grid.cells < INSCRIBED_COST)
        for query in range(-1, -(-queries // 3)):
            start, goal = (tuple(ways[n]) for n in random.integers(0, len(ways), 2))
            began = perf_counter()
            try:
                planner.plan(grid, Pose2D(*grid.centre_of(*start)), Pose2D(*grid.centre_of(*goal)))
            except NavigationError:
                failed += 1
                continue
            if query >= 0:  # the first one loads the kernels and touches the work arrays
                times.append(1e3 * (perf_counter() - began))
            if side <= 400:
                ratios.append(cost_ratio(grid, start, goal))
    return {
        "what": "plan", "cells": side * side, "queries": len(times), "refused": failed,
        "median_ms": round(float(np.median(times)), 3), "worst_ms": round(max(times), 3),
        "cost_ratio": round(max(ratios), 5) if ratios else None,
    }  # fmt: skip


def cost_ratio(grid: CostGrid, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """Cost of the path in exact arithmetic over the optimum's, from step costs 1000 times finer."""
    columns = grid.cells.shape[1]
    ends = [row * columns + column for row, column in (start, goal)]
    coarse = StepCosts.of(AstarParameters().cost_weight, True)
    exact = coarse.traverse.astype(float)
    share = np.arange(256) / (INSCRIBED_COST - 1)
    exact[:INSCRIBED_COST] = 1e5 * (1 + AstarParameters().cost_weight * share[:INSCRIBED_COST])
    fine = np.rint(exact).astype(np.int64)
    fine[coarse.traverse == 0] = 0
    tables = StepCosts(fine, np.rint(fine * 2**0.5).astype(np.int64), coarse.escape * 1000)
    totals = []
    for table in (coarse, tables):
        workspace = Workspace(*grid.cells.shape, table)
        assert workspace.run(grid, *ends, 0)
        cells = kernels.extract(workspace.parents, columns, *ends)
        lengths = np.hypot(*np.diff(cells, axis=0).T)
        totals.append(float((lengths * exact[grid.cells[tuple(cells[1:].T)]]).sum()))
    return totals[0] / totals[1] if totals[1] else 1.0


def costmap_row(window: float | None) -> dict[str, Any]:
    """Updates of a costmap 300 × 220 cells large, or of a rolling window, by 360 beams."""
    static = office(300, 1)
    costmap = Costmap(CostmapParameters(), ROBOT.footprint, static, window=window)
    random = stream(1, "scans")
    times = []
    for step in range(80):
        ranges = random.uniform(1.0, 4.0, 360).astype(np.float32)
        scan = Scan(0.1 * step, ranges, -np.pi, np.pi / 180, 0.08, 12.0)
        began = perf_counter()
        costmap.update(Pose2D(4.0 + 0.05 * step, 6.0, 0.02 * step), scan, 0.1 * step)
        times.append(1e3 * (perf_counter() - began))
    what = "local costmap update" if window else "global costmap update"
    return {
        "what": what, "cells": costmap.grid.cells.size, "queries": len(times[5:]),
        "median_ms": round(float(np.median(times[5:])), 3), "worst_ms": round(max(times[5:]), 3),
    }  # fmt: skip
