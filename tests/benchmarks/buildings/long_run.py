"""A day of mapping in one building, and a map that is resumed after weeks: cupboards are moved.

A patrol drives through the corridors without an end. What it costs must not grow with the time:
keyframes, memory, processor time of a scan. What stood somewhere and stands there no more must not
stay in the map.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice, pairwise
from math import hypot
from os import sysconf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time
from typing import Any

import numpy as np

from stack.frames.buffer import TransformBuffer
from stack.mapping.graph_files import read_graph, saved_files
from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import SlamParameters
from stack.mapping.whole_files import replace_folder
from stack.streams import stream
from stack.types import STANDSTILL, Observation, OccupancyGrid, Odometry, Pose2D
from tests.benchmarks.buildings.drives import NOISE, PERIOD, Wheels, poses_along, scan_at
from tests.benchmarks.buildings.plans import Building, Rectangle, building
from tests.benchmarks.table import Rows
from tests.stack.mapping.slam.drives import ROBOT

CUPBOARDS, MOVED_AN_HOUR, MOVED_A_SESSION = 20, 2, 6
"""Cupboards in the corridors; how many are moved each hour of a day, and between two sessions."""

LENGTH, NEAR, FAR = 0.8, 0.5, 0.75
"""Metres: of a cupboard along the corridor, and from its axis to the front and the back."""

FROM_CORNERS = 1.6
"""Metres from a cupboard's middle to the next corner of the route."""

LAPS = 2
"""Laps of a session."""

PATROL_PERIOD, HOUR = 1.0, 3600.0
"""Seconds between two scans of the day, at 0.3 m/s, and from row to row."""


@dataclass
class Corridors:
    """A building whose cupboards are moved.

    Attributes:
        bare: the building without cupboards.
        cupboards: where these stand.
    """

    bare: Building
    cupboards: list[Rectangle]

    @property
    def plan(self) -> Building:
        """The building as it is now."""
        corners = [
            side
            for x, y, to_x, to_y in self.cupboards
            for side in ((x, y, to_x, y), (to_x, y, to_x, to_y), (to_x, to_y, x, to_y),
                         (x, to_y, x, y))
        ]  # fmt: skip
        walls = np.concatenate([self.bare.walls, np.array(corners)])
        glass = np.concatenate([self.bare.glass, np.zeros(len(corners), np.bool_)])
        return replace(self.bare, walls=walls, glass=glass)

    def move(self, count: int, rng: np.random.Generator) -> list[Rectangle]:
        """Move some cupboards elsewhere; return where they stood."""
        gone, self.cupboards = self.cupboards[:count], self.cupboards[count:]
        while len(self.cupboards) < CUPBOARDS:
            new = self._place(rng)
            if all(_is_apart(new, other) for other in [*self.cupboards, *gone]):
                self.cupboards.append(new)
        return gone

    def _place(self, rng: np.random.Generator) -> Rectangle:
        """Return a place beside the way, far enough from all corners of the route."""
        legs = list(pairwise(self.bare.route))
        while True:
            (x, y), (to_x, to_y) = legs[int(rng.integers(len(legs)))]
            share, side = float(rng.uniform()), float(rng.choice([-1.0, 1.0]))
            at = (x + share * (to_x - x), y + share * (to_y - y))
            if min(hypot(at[0] - a, at[1] - b) for a, b in self.bare.route) < FROM_CORNERS:
                continue
            low, high = sorted((side * NEAR, side * FAR))
            half = 0.5 * LENGTH
            if abs(to_x - x) > abs(to_y - y):
                return at[0] - half, at[1] + low, at[0] + half, at[1] + high
            return at[0] + low, at[1] - half, at[0] + high, at[1] + half


def _is_apart(one: Rectangle, other: Rectangle) -> bool:
    gap = 0.3
    return (
        one[0] > other[2] + gap or one[2] < other[0] - gap
        or one[1] > other[3] + gap or one[3] < other[1] - gap
    )  # fmt: skip


def corridors(seed: int, rng: np.random.Generator) -> Corridors:
    """Return the building of a seed with cupboards."""
    found = Corridors(building(seed), [])
    found.move(0, rng)
    return found


def day_table(hours: int, seed: int = 1) -> Rows:
    """Return a row for each hour of a patrol, by the estimator of a mission."""
    rng, rows, count = stream(seed, "day"), [], round(HOUR / PATROL_PERIOD)
    house = corridors(seed, rng)
    way = _endless(house.bare, rng)
    first = next(way)
    way = chain([first], way)
    wheels, frames = Wheels(first, rng), TransformBuffer()
    estimator = SlamEstimator(SlamParameters(), ROBOT, None, 1)
    estimator.start(first)
    try:
        for hour in range(hours):
            gone = house.move(MOVED_AN_HOUR, rng) if hour else []
            plan, steps, errors = house.plan, [], []
            for k, pose in enumerate(islice(way, count), hour * count):
                time = PATROL_PERIOD * k
                frames.add(Odometry(time, wheels.at(pose), STANDSTILL))
                seen = Observation(time, {"lidar": scan_at(plan, pose, time, rng)})
                began = thread_time()
                estimate = estimator.update(seen, frames)
                estimator.take_map()
                steps.append(1e3 * (thread_time() - began))
                errors.append(estimate.pose.distance_to(pose))
            graph = estimator.mapper.graph
            rows.append({
                "hour": hour + 1, "keyframes": len(graph.keyframes), "edges": len(graph.edges),
                "memory MB": round(_resident()), "step mean ms": round(float(np.mean(steps)), 2),
                "step p99 ms": round(float(np.percentile(steps, 99)), 1), **_errors(errors),
                **_furniture(estimator.mapper.grid(), house, gone),
            })  # fmt: skip
    finally:
        estimator.close()
    return rows


def sessions_table(sessions: int = 5, seed: int = 1, laps: int = LAPS) -> Rows:
    """Return a row for each session in one map, which is saved and read again between them."""
    rng = stream(seed, "sessions")
    house, rows = corridors(seed, rng), []
    with TemporaryDirectory() as folder:
        for session in range(sessions):
            mapper = Mapper(graph=read_graph(Path(folder)) if session else None, noise=NOISE)
            gone = house.move(MOVED_A_SESSION, rng) if session else []
            plan, poses, errors = house.plan, poses_along(house.bare.route * laps, rng), []
            wheels = Wheels(poses[0], rng)
            if session:
                mapper.set_pose(poses[0], poses[0])
            else:
                mapper.start(poses[0])
            for k, pose in enumerate(poses):
                scan = scan_at(plan, pose, PERIOD * k, rng)
                errors.append(mapper.add(PERIOD * k, wheels.at(pose), scan).distance_to(pose))
            mapper.optimise()
            replace_folder(Path(folder), saved_files(mapper.graph))
            rows.append({
                "session": session + 1, "keyframes": len(mapper.graph.keyframes),
                "edges": len(mapper.graph.edges),
                **_errors(errors), **_furniture(mapper.grid(), house, gone),
            })  # fmt: skip
    return rows


def _endless(plan: Building, rng: np.random.Generator) -> Iterator[Pose2D]:
    """Yield poses along the route, there and back, again and again."""
    there_and_back = (*plan.route, *plan.route[-2::-1])
    while True:
        yield from poses_along(there_and_back, rng)


def _furniture(grid: OccupancyGrid, house: Corridors, gone: list[Rectangle]) -> dict[str, Any]:
    """Return how many cupboards are in the map, and how many of those that were moved still are."""
    shown = [_cells(grid, one) for one in house.cupboards]
    left = [_cells(grid, one) for one in gone]
    return {
        "shown": f"{sum(count > 0 for count in shown)}/{len(shown)}",
        "left": f"{sum(count > LEFT_CELLS for count in left)}/{len(left)}",
    }


LEFT_CELLS = 3
"""Occupied cells up to which a cupboard that was moved counts as forgotten."""


def _cells(grid: OccupancyGrid, at: Rectangle) -> int:
    """Return the occupied cells of the front and the sides of a cupboard, not of its back."""
    low, high = grid.cell_at(at[0], at[1]), grid.cell_at(at[2], at[3])
    return int(grid.occupied[low[0] : high[0] + 1, low[1] : high[1] + 1].sum())


def _errors(errors: list[float]) -> dict[str, float]:
    return {"error m": round(float(np.median(errors)), 3), "worst m": round(max(errors), 3)}


def _resident() -> float:
    """Return the resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text("utf-8").split()[1])
    return pages * sysconf("SC_PAGE_SIZE") / 1e6
