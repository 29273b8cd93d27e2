"""SLAM on recorded logs of the Kümmerle benchmark: error of the relations, time, maps.

A folder holds NAME.clf.gz (CARMEN, lines FLASER), NAME.relations.gz and the evaluator
eval_relations.py. All logs use the default parameters; the geometry of the lidar follows from the
number of its beams: 180 beams 1° apart or 361 beams 0.5° apart, from -90° on. Scans keep the order
of the file, in which the odometry is continuous, even where stamps run backwards.
"""

from __future__ import annotations

import gzip
import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import cv2
import numpy as np

from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.refinement import refine
from stack.types import FREE, OCCUPIED, OccupancyGrid, Pose2D, Scan
from tests.benchmarks.table import Rows

NO_RETURN = 80.0
"""Metres: CARMEN logs 81.91 for a beam without return."""


@dataclass(frozen=True)
class Result:
    """Of a log: the table's row, and what goes to files."""

    row: dict[str, Any]
    trajectory: list[tuple[float, Pose2D]]
    grid: OccupancyGrid


def slam_table(logs: Path, out: Path) -> Rows:
    """Map every log of a folder; write trajectories and pictures of the maps to `out`."""
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for log in sorted(logs.glob("*.clf.gz")):
        name = log.name.removesuffix(".clf.gz")
        result = mapped(log)
        trajectory = out / f"{name}.txt"
        trajectory.write_text(
            "".join(f"{t:.6f} {p.x:.6f} {p.y:.6f} {p.heading:.6f}\n" for t, p in result.trajectory)
        )
        write_picture(result.grid, out / f"{name}.png")
        errors = evaluated(logs, name, trajectory)
        rows.append({"log": name, **errors, **result.row})
    return rows


def mapped(log: Path) -> Result:
    """Map a log as fast as possible."""
    mapper, steps = Mapper(MapperParameters(), keep_trajectory=True), []
    began = perf_counter()
    for odometry, scan in read_carmen(log):
        start = thread_time()
        mapper.add(scan.stamp, odometry, scan)
        steps.append(thread_time() - start)
    refine(mapper)
    wall = perf_counter() - began
    milliseconds = 1e3 * np.array(steps)
    row = {
        "scans": len(steps),
        "keyframes": len(mapper.graph.keyframes),
        "wall s": round(wall, 1),
        "step median ms": round(float(np.median(milliseconds)), 2),
        "step p99 ms": round(float(np.percentile(milliseconds, 99)), 2),
    }
    return Result(row, mapper.trajectory(), mapper.grid())


def read_carmen(log: Path) -> Iterator[tuple[Pose2D, Scan]]:
    """The odometry and the scan of each FLASER line, in the order of the file."""
    with gzip.open(log, "rt") as lines:
        for line in lines:
            words = line.split()
            if not words or words[0] != "FLASER":
                continue
            count = int(words[1])
            ranges = np.array(words[2 : 2 + count], dtype=np.float32)
            ranges[ranges >= NO_RETURN] = np.inf
            _, _, _, x, y, heading, stamp = (float(word) for word in words[2 + count : 9 + count])
            increment = pi / 360 if count > 181 else pi / 180
            yield Pose2D(x, y, heading), Scan(stamp, ranges, -pi / 2, increment, 0.05, NO_RETURN)


def evaluated(logs: Path, name: str, trajectory: Path) -> dict[str, float]:
    """The mean and deviation of the errors of the relations, by the evaluator of the folder."""
    spec = importlib.util.spec_from_file_location("eval_relations", logs / "eval_relations.py")
    assert spec is not None and spec.loader is not None
    evaluator = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(evaluator)
    with gzip.open(logs / f"{name}.relations.gz", "rt") as lines:
        relations = np.array([[float(word) for word in line.split()] for line in lines])
    found = evaluator.evaluate(evaluator.load_traj(trajectory), relations)
    return {
        "error m": round(found["abs_trans"][0], 4),
        "± m": round(found["abs_trans"][1], 4),
        "error °": round(found["abs_rot"][0], 3),
        "± °": round(found["abs_rot"][1], 3),
    }


def write_picture(grid: OccupancyGrid, path: Path) -> None:
    """Write a map in grey values, north at the top."""
    pixels = np.full(grid.cells.shape, 205, np.uint8)
    pixels[grid.cells == FREE], pixels[grid.cells == OCCUPIED] = 254, 0
    cv2.imwrite(str(path), pixels[::-1])
