"""Maps of mission 25 against the world's true walls."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS
from missions.execution.run import Run
from stack.localisation import kernels
from stack.localisation.distance_field import surface_field
from stack.sim.worlds.rasterise import rasterise
from stack.types import UNKNOWN, OccupancyGrid
from tests.benchmarks.table import Rows


def explored_table(seeds: int) -> Rows:
    """A row for each seed of mission 25: what is known, and how exact the walls are."""
    return [explored(MISSIONS / "25_explore_and_map.yaml", seed) for seed in range(seeds)]


def explored(mission: Path, seed: int) -> dict[str, Any]:
    """Run a mission that explores; compare its map with its world."""
    plan = prepare(mission, RunOptions())
    run = Run(plan, RunOptions(seed=seed))
    try:
        while not run.is_over:
            run.step()
        report = run.finish()
        drawn = run.engine.runtime.parts.perceiver.estimator.grid
    finally:
        run.close()
    assert drawn is not None
    truth = rasterise(plan.world, drawn.resolution)
    radius = plan.robot.footprint.inscribed_radius
    known, overlap = compared(drawn, truth, (plan.start.x, plan.start.y), radius)
    return {
        "seed": seed, "status": report.status, "known %": round(100.0 * known, 2),
        "IoU": round(overlap, 3), "time s": round(report.simulated_seconds, 1),
        "distance m": round(report.distance_m or 0.0, 1),
    }  # fmt: skip


def compared(
    drawn: OccupancyGrid, truth: OccupancyGrid, start: tuple[float, float], radius: float
) -> tuple[float, float]:
    """Return how much of the reachable area is known, and the intersection over union of the walls.

    Walls are the occupied cells of the truth that a lidar sees from some place which the robot's
    centre can reach: nothing can be known of the back of a cupboard at a wall. A cell within one
    cell (8 neighbours) of a cell of the other map belongs to both.

    Args:
        drawn: the map.
        truth: the world; its free cells are those that are connected with the start.
        start: of the robot, metres.
        radius: of the robot, metres.
    """
    cells = _sampled(drawn, truth)
    free = truth.free.astype(np.uint8)
    size = 2 * ceil(radius / truth.resolution) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    centres = cv2.erode(free, disc, borderValue=0)
    _, labels = cv2.connectedComponents(centres, connectivity=4)
    inside = (labels == labels[truth.cell_at(*start)]).astype(np.uint8)
    reachable = cv2.dilate(inside, disc) > 0
    known = float(np.mean(cells[reachable] != UNKNOWN))
    ring = np.ones((3, 3), np.uint8)
    walls = _visible(truth, inside)
    marks = drawn.are_occupied(cells)
    near_mark = cv2.dilate(marks.astype(np.uint8), ring) > 0
    near_wall = cv2.dilate(truth.occupied.astype(np.uint8), ring) > 0
    found, wrong = np.count_nonzero(walls & near_mark), np.count_nonzero(marks & ~near_wall)
    return known, float(found / (np.count_nonzero(walls) + wrong))


def _visible(truth: OccupancyGrid, places: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return the occupied cells that are seen from every fourth of the places."""
    field, seen = surface_field(truth), np.zeros(truth.cells.shape, np.bool_)
    angles = np.arange(720) * (2.0 * np.pi / 720)
    for row, column in np.argwhere(places)[::4].tolist():
        x, y = truth.centre_of(row, column)
        ranges = kernels.cast_rays(
            field.occupancy, field.placement, np.array([x, y, 0.0]), angles, 30.0
        )
        beyond = ranges + 0.5 * truth.resolution
        rows = ((y + beyond * np.sin(angles) - truth.origin[1]) / truth.resolution).astype(int)
        columns = ((x + beyond * np.cos(angles) - truth.origin[0]) / truth.resolution).astype(int)
        hit = np.isfinite(ranges)
        seen[rows[hit], columns[hit]] = True
    seen_walls: NDArray[np.bool_] = seen & truth.occupied
    return seen_walls


def _sampled(drawn: OccupancyGrid, like: OccupancyGrid) -> NDArray[np.int8]:
    """Return the values of a map at the cell centres of another one; unknown outside it."""
    rows, columns = like.cells.shape
    x, y = (
        like.origin[k] + (np.arange(n) + 0.5) * like.resolution
        for k, n in ((0, columns), (1, rows))
    )
    at_x = np.floor((x - drawn.origin[0]) / drawn.resolution).astype(int)
    at_y = np.floor((y - drawn.origin[1]) / drawn.resolution).astype(int)
    cells = np.full(like.cells.shape, UNKNOWN, np.int8)
    in_x = (at_x >= 0) & (at_x < drawn.cells.shape[1])
    in_y = (at_y >= 0) & (at_y < drawn.cells.shape[0])
    cells[np.ix_(in_y, in_x)] = drawn.cells[np.ix_(at_y[in_y], at_x[in_x])]
    return cells
