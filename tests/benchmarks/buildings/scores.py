"""Scores of maps of buildings: walls against the plan, loops closed, loops that are false."""

from __future__ import annotations

from itertools import pairwise
from time import thread_time
from typing import Any

import numpy as np

from stack.mapping.slam.mapper import Mapper
from stack.types import FloatArray, Pose2D, wrap_angle
from tests.benchmarks.buildings.drives import NOISE, Step, drive
from tests.benchmarks.buildings.plans import Building, building
from tests.benchmarks.table import Rows

NEAR, APART, LEAST = 1.5, 30.0, 12.0
"""Metres: a place is visited again within NEAR of a pose that is APART along the way; a loop is
possible where that lasts for LEAST metres."""

FALSE = 0.5, 0.1
"""Metres and radians by which a loop edge is false."""


def buildings_table(seeds: range) -> Rows:
    """Return a row for each building."""
    return [scored(seed) for seed in seeds]


def scored(seed: int) -> dict[str, Any]:
    """Map a building as a mission does: the map at the end of the drive, not refined."""
    plan = building(seed)
    steps = drive(plan, seed)
    mapper, began = Mapper(noise=NOISE, keep_trajectory=True), thread_time()
    mapper.start(steps[0].truth)
    for step in steps:
        mapper.add(step.scan.stamp, step.odometry, step.scan)
    mapper.optimise()
    spent = thread_time() - began
    truth = {step.scan.stamp: step.truth for step in steps}
    true = {n: truth[k.stamp] for n, k in mapper.graph.keyframes.items()}
    possible, closed = loops_closed(mapper, steps, true)
    errors = wall_errors(mapper, plan, true)
    return {
        "seed": seed, "kind": plan.kind, "driven m": round(_ways(steps)[-1]),
        "odometry m": round(steps[-1].odometry.distance_to(steps[-1].truth), 2),
        "loops": possible, "closed": closed, "false edges": false_edges(mapper, true),
        "wall error m": round(float(np.median(errors)), 4),
        "wall p90 m": round(float(np.percentile(errors, 90)), 4),
        "pose error m": round(_pose_error(mapper, true), 3), "cpu s": round(spent, 1),
    }  # fmt: skip


def _ways(steps: list[Step]) -> FloatArray:
    """Return the metres driven up to each step."""
    moved = [other.truth.distance_to(one.truth) for one, other in pairwise(steps)]
    return np.concatenate([[0.0], np.cumsum(moved)])


def revisits(steps: list[Step]) -> list[tuple[int, int]]:
    """Return the first and last steps of the ways along which places are visited again."""
    ways = _ways(steps)
    rows = np.array([[s.truth.x, s.truth.y] for s in steps])
    again = np.zeros(len(steps), np.bool_)
    for k, row in enumerate(rows):
        before = rows[: np.searchsorted(ways, ways[k] - APART)]
        again[k] = before.size and np.hypot(*(before - row).T).min() <= NEAR
    edges = np.flatnonzero(np.diff(np.concatenate([[False], again, [False]]).astype(int)))
    found = zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True)
    return [(first, last) for first, last in found if ways[last] - ways[first] >= LEAST]


def loops_closed(mapper: Mapper, steps: list[Step], true: dict[int, Pose2D]) -> tuple[int, int]:
    """Return the number of possible loops, and of those with a true edge to the earlier visit."""
    stamps = {n: k.stamp for n, k in mapper.graph.keyframes.items()}
    ways = dict(zip((s.scan.stamp for s in steps), _ways(steps).tolist(), strict=True))
    edges = [
        (stamps[max(e.source, e.target)], stamps[min(e.source, e.target)])
        for e in mapper.graph.edges
        if e.kind == "loop" and not _is_false(e.relative, true[e.source], true[e.target])
    ]
    found = revisits(steps)
    closed = sum(
        any(
            steps[first].scan.stamp <= late <= steps[last].scan.stamp
            and ways[late] - ways[early] > APART
            for late, early in edges
        )
        for first, last in found
    )
    return len(found), closed


def false_edges(mapper: Mapper, true: dict[int, Pose2D]) -> int:
    """Return the number of loop edges that contradict the truth."""
    return sum(
        _is_false(e.relative, true[e.source], true[e.target])
        for e in mapper.graph.edges
        if e.kind == "loop"
    )


def _is_false(relative: Pose2D, source: Pose2D, target: Pose2D) -> bool:
    right = target.relative_to(source)
    turned = abs(wrap_angle(relative.heading - right.heading))
    return relative.distance_to(right) > FALSE[0] or turned > FALSE[1]


def _aligned(mapper: Mapper, true: dict[int, Pose2D]) -> Pose2D:
    """Return the motion that brings the keyframes nearest to the truth (least squares)."""
    found = np.array([[k.pose.x, k.pose.y] for k in mapper.graph.keyframes.values()])
    right = np.array([[true[n].x, true[n].y] for n in mapper.graph.keyframes])
    one, other = found - found.mean(axis=0), right - right.mean(axis=0)
    turn = float(np.arctan2(
        (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum(), (one * other).sum()
    ))  # fmt: skip
    x, y = right.mean(axis=0) - Pose2D(0.0, 0.0, turn).transform(found.mean(axis=0)[None])[0]
    return Pose2D(float(x), float(y), turn)


def _pose_error(mapper: Mapper, true: dict[int, Pose2D]) -> float:
    placed = _aligned(mapper, true)
    keyframes = mapper.graph.keyframes.items()
    return float(np.median([placed.compose(k.pose).distance_to(true[n]) for n, k in keyframes]))


def wall_errors(mapper: Mapper, plan: Building, true: dict[int, Pose2D]) -> FloatArray:
    """Return the distances (n,) of the mapped points to the walls, the map laid on the plan."""
    placed, walls, errors = _aligned(mapper, true), plan.walls, []
    for number in list(mapper.graph.keyframes)[::5]:
        pose = placed.compose(mapper.graph.keyframes[number].pose)
        points = pose.transform(mapper.prepared(number).points[::3])
        away = [
            np.maximum(np.maximum(low - points[:, i, None], points[:, i, None] - high), 0.0)
            for i in (0, 1)
            for low, high in [(
                np.minimum(walls[:, i], walls[:, i + 2]), np.maximum(walls[:, i], walls[:, i + 2])
            )]
        ]  # fmt: skip
        errors.append(np.hypot(*away).min(axis=1))
    return np.concatenate(errors)
