"""How fast and how good global plans are, on generated offices: `run()` gives the table.

Starts and goals are drawn from all free cells of a map, and asked is every pair between which the
optimum, Dijkstra's algorithm in floating point (optimum.py), says that there is a way.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from stack.costmap.route_costs import route_cost
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.errors import NavigationError
from stack.planning import kernels
from stack.planning.astar import Astar, AstarParameters
from stack.planning.search import StepCosts, Workspace
from stack.streams import stream
from stack.types import INSCRIBED_COST, CostGrid, FloatArray, Footprint, Path, Pose2D
from tests.benchmarks.optimum import cheapest
from tests.benchmarks.table import Rows
from tests.stack.planning.office_maps import office_costs

ROBOT = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3)
)
SIDES = (400, 2000, 4000)
REST = ("p95_ms", "worst_ms", "path_m", "expanded", "cells_over_optimum_%", "path_over_optimum_%")
"""Columns that a first plan leaves empty."""
OFFICES, STARTS, GOALS = 3, 2, 10
"""60 queries: ten goals from each of two starts in each of three offices.

The optimum from one start takes longer than all plans: more starts would take minutes.
"""

_FIRST_PLAN = """
from time import perf_counter
begun = perf_counter()
import numpy as np
from stack.planning.astar import Astar, AstarParameters
from stack.types import CostGrid, Pose2D
from tests.benchmarks.planning import ROBOT
loaded = perf_counter()
Astar(AstarParameters(), ROBOT).plan(
    CostGrid(np.zeros((400, 400), np.uint8), 0.05), Pose2D(1, 1), Pose2D(15, 12))
print(perf_counter() - loaded)
"""


def run(sides: tuple[int, ...] = SIDES) -> Rows:
    """A row for each size of map, and two for the first plan of a process."""
    return [*(plan_row(side) for side in sides), *first_plan_rows()]


def run_up_to(largest: int) -> Rows:
    """The same without the maps that have more cells on a side."""
    return run(tuple(side for side in SIDES if side <= largest))


@dataclass
class Figures:
    """What was measured, query by query.

    Attributes:
        times: milliseconds of a whole plan, smoothing included.
        cells: cost of the cells found over the optimum.
        paths: cost of the smoothed path over the optimum: below 1 where it cuts corners of the
            grid.
        expanded: cells.
        metres: of the paths.
        refused: queries with a way that were not planned.
    """

    times: list[float] = field(default_factory=list)
    cells: list[float] = field(default_factory=list)
    paths: list[float] = field(default_factory=list)
    expanded: list[int] = field(default_factory=list)
    metres: list[float] = field(default_factory=list)
    refused: int = 0


def plan_row(side: int) -> dict[str, Any]:
    """Plans from anywhere to anywhere in offices of side × side cells."""
    figures = Figures()
    for seed in range(OFFICES):
        _measure(office_costs(side, seed), seed, figures)
    times = np.array(figures.times)
    return {
        "what": f"astar, {side} x {side}", "queries": times.size, "refused": figures.refused,
        "median_ms": round(float(np.median(times)), 2),
        "p95_ms": round(float(np.percentile(times, 95)), 2),
        "worst_ms": round(float(times.max()), 2),
        "path_m": round(float(np.median(figures.metres)), 1),
        "expanded": int(np.median(figures.expanded)),
        "cells_over_optimum_%": round(100 * (max(figures.cells) - 1), 3),
        "path_over_optimum_%": round(100 * (float(np.median(figures.paths)) - 1), 2),
    }  # fmt: skip


def _measure(grid: CostGrid, seed: int, figures: Figures) -> None:
    weights = _weights(grid)
    planner, random = Astar(AstarParameters(), ROBOT), stream(seed, "queries")
    ways = np.argwhere(np.isfinite(weights))
    planner.plan(grid, *[Pose2D(*grid.centre_of(*ways[0]))] * 2)  # loads the kernels
    for _ in range(STARTS):
        start = tuple(int(number) for number in ways[random.integers(len(ways))])
        optimum = cheapest(weights, *start)
        reachable = np.argwhere(np.isfinite(optimum) & (optimum > 0.0))
        for _ in range(GOALS):
            goal = tuple(int(number) for number in reachable[random.integers(len(reachable))])
            _ask(planner, grid, (start, goal), float(optimum[goal]), figures)


def _ask(
    planner: Astar, grid: CostGrid, ends: tuple[Any, Any], optimum: float, figures: Figures
) -> None:
    poses = [Pose2D(*grid.centre_of(*cell)) for cell in ends]
    began = perf_counter()
    try:
        path: Path = planner.plan(grid, poses[0], poses[1])
    except NavigationError:
        figures.refused += 1
        return
    figures.times.append(1e3 * (perf_counter() - began))
    figures.metres.append(path.length)
    figures.paths.append(route_cost(grid, path.points) / grid.resolution / optimum)
    cells, expanded = _cells(grid, ends)
    steps = np.hypot(*np.diff(cells, axis=0).T)
    cost = float(steps @ _weights(grid)[tuple(cells[1:].T)])
    figures.cells.append(cost / optimum)
    figures.expanded.append(expanded)


def _cells(grid: CostGrid, ends: tuple[Any, Any]) -> tuple[np.ndarray[Any, Any], int]:
    """The cells that the search finds, before anything is smoothed."""
    columns = grid.cells.shape[1]
    parameters = AstarParameters()
    tables = StepCosts.of(parameters.cost_weight, True, parameters.unknown_as)
    workspace = Workspace(*grid.cells.shape, tables)
    numbers = [row * columns + column for row, column in ends]
    assert workspace.run(grid, *numbers, 0)
    return kernels.extract(workspace.parents, columns, *numbers), workspace.expanded


def _weights(grid: CostGrid) -> FloatArray:
    """(rows, columns) what a cell of a step into it counts, by the documented formula."""
    weight = AstarParameters().cost_weight
    weights = 1.0 + weight * grid.cells.astype(np.float32) / (INSCRIBED_COST - 1)
    weights[grid.cells >= INSCRIBED_COST] = np.inf
    return weights


def first_plan_rows() -> Rows:
    """The first plan of a process whose kernels are to be compiled, and of the next one."""
    with TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        milliseconds = [
            1e3 * float(subprocess.check_output(
                [sys.executable, "-c", _FIRST_PLAN], env=environment, text=True
            )) for _ in range(2)
        ]  # fmt: skip
    names = ("first plan, kernels compiled", "first plan, kernels cached")
    return [
        {"what": name, "queries": 1, "refused": 0, "median_ms": round(time, 0)}
        | dict.fromkeys(REST)
        for name, time in zip(names, milliseconds, strict=True)
    ]
