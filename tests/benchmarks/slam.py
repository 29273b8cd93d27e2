"""SLAM on recorded logs of the Kümmerle benchmark: error of the relations, time, maps.

A folder holds NAME.clf.gz (CARMEN, lines FLASER), NAME.relations.gz and the evaluator
eval_relations.py. All logs use the default parameters; the geometry of the lidar follows from the
number of its beams: 180 beams 1° apart or 361 beams 0.5° apart, from -90° on. Scans keep the order
of the file, in which the odometry is continuous, even where stamps run backwards.

Where many scans share a stamp, relations may belong to other scans than their stamps say. One over
less than CLOSE seconds that differs from the log's own odometry by more than CONTRADICTION is
*contradicted*; the error of the others is a column of its own. The goal counts all.
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

CLOSE, CONTRADICTION = 5.0, 0.15
"""Seconds, metres: odometry of both logs errs by centimetres in this time."""


@dataclass(frozen=True)
class Result:
    """Of a log: the table's row, and what goes to files."""

    row: dict[str, Any]
    trajectory: list[tuple[float, Pose2D]]
    odometry: list[tuple[float, Pose2D]]
    grid: OccupancyGrid


def slam_table(logs: Path, out: Path) -> Rows:
    """Map every log of a folder; write trajectories and pictures of the maps to `out`."""
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for log in sorted(logs.glob("*.clf.gz")):
        name = log.name.removesuffix(".clf.gz")
        result = mapped(log)
        trajectory = _written(result.trajectory, out / f"{name}.txt")
        odometry = _written(result.odometry, out / f"{name}_odometry.txt")
        write_picture(result.grid, out / f"{name}.png")
        errors = evaluated(logs, name, trajectory, odometry)
        rows.append({"log": name, **errors, **result.row})
    return rows


def _written(poses: list[tuple[float, Pose2D]], path: Path) -> Path:
    """Write lines `t x y theta`."""
    lines = (f"{t:.6f} {p.x:.6f} {p.y:.6f} {p.heading:.6f}\n" for t, p in poses)
    path.write_text("".join(lines))
    return path


def mapped(log: Path) -> Result:
    """Map a log as fast as possible."""
    mapper, steps = Mapper(MapperParameters(), keep_trajectory=True), []
    driven: list[tuple[float, Pose2D]] = []
    began = perf_counter()
    for odometry, scan in read_carmen(log):
        start = thread_time()
        mapper.add(scan.stamp, odometry, scan)
        steps.append(thread_time() - start)
        driven.append((scan.stamp, odometry))
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
    return Result(row, mapper.trajectory(), driven, mapper.grid())


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


def evaluated(logs: Path, name: str, trajectory: Path, odometry: Path) -> dict[str, float]:
    """The mean and deviation of the errors of the relations, by the evaluator of the folder."""
    spec = importlib.util.spec_from_file_location("eval_relations", logs / "eval_relations.py")
    assert spec is not None and spec.loader is not None
    evaluator = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(evaluator)
    with gzip.open(logs / f"{name}.relations.gz", "rt") as lines:
        relations = np.array([[float(word) for word in line.split()] for line in lines])
    poses, driven = evaluator.load_traj(trajectory), evaluator.load_traj(odometry)
    found = evaluator.evaluate(poses, relations)
    close = np.abs(relations[:, 1] - relations[:, 0]) < CLOSE
    contradicted = close & (_differences(evaluator, driven, relations) > CONTRADICTION)
    others = evaluator.evaluate(poses, relations[~contradicted])
    return {
        "relations": len(relations),
        "contradicted": int(np.count_nonzero(contradicted)),
        "error of the others m": round(others["abs_trans"][0], 4),
        "error m": round(found["abs_trans"][0], 4),
        "± m": round(found["abs_trans"][1], 4),
        "error °": round(found["abs_rot"][0], 3),
        "± °": round(found["abs_rot"][1], 3),
    }


def _differences(evaluator: Any, poses: np.ndarray, relations: np.ndarray) -> np.ndarray:
    """The distances (n,) between the relations and the motions of a trajectory, metres."""
    ends = [poses[evaluator.nearest(poses[:, 0], relations[:, k])[0], 1:] for k in (0, 1)]
    return np.hypot(*(evaluator.between(*ends)[:, :2] - relations[:, 2:4]).T)


def write_picture(grid: OccupancyGrid, path: Path) -> None:
    """Write a map in grey values, north at the top."""
    pixels = np.full(grid.cells.shape, 205, np.uint8)
    pixels[grid.cells == FREE], pixels[grid.cells == OCCUPIED] = 254, 0
    cv2.imwrite(str(path), pixels[::-1])
