"""Kidnapping (mission 05) and wall following (mission 04) over seeds."""

from __future__ import annotations

from functools import cache
from math import inf, isfinite
from statistics import median
from typing import Any

import numpy as np

from missions.execution.prepare import RunOptions
from missions.execution.report import Report
from missions.execution.resources import MISSIONS, load_world
from missions.execution.running import run_mission
from stack.telemetry.records import Event, Snapshot
from stack.telemetry.sinks import Sink
from stack.types import FloatArray, Pose2D
from tests.benchmarks.benchmark import in_order
from tests.benchmarks.table import Rows

GOOD_AGAIN = 0.3
"""Metres between estimate and truth below which the pose counts as corrected."""


class Trace(Sink):
    """A telemetry sink that keeps events and the error of the estimate, ten times a second."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.errors: list[tuple[float, float, float]] = []
        self.truths: list[Pose2D] = []
        self._next = 0.0

    def event(self, event: Event) -> None:
        """Keep it."""
        self.events.append(event)

    def wants_snapshot(self, time: float) -> bool:
        """Ten a second."""
        return time >= self._next

    def snapshot(self, snapshot: Snapshot) -> None:
        """Keep the error and the health."""
        self._next = snapshot.time + 0.1
        if snapshot.truth is not None:
            error = snapshot.pose.distance_to(snapshot.truth)
            self.errors.append((snapshot.time, error, snapshot.health))
            self.truths.append(snapshot.truth)


def kidnap_table(seeds: int, jobs: int) -> Rows:
    """How soon each kidnapping of mission 05 is noticed and corrected, over many seeds."""
    rows = in_order(kidnapped_once, range(seeds), jobs)
    noticed = [row["noticed"] <= 5.0 for row in rows]
    corrected = [row["corrected"] <= 30.0 for row in rows]
    return [
        {
            "seeds": seeds,
            "noticed within 5 s": sum(noticed),
            "corrected within 30 s": sum(corrected),
            "both": sum(map(all, zip(noticed, corrected, strict=True))),
            "median notice s": _finite(median(row["noticed"] for row in rows)),
            "median correction s": _finite(median(row["corrected"] for row in rows)),
            "by marker": sum(row["by"] == "marker" for row in rows),
            "success": sum(row["status"] == "success" for row in rows),
            "failed": "; ".join(
                f"seed {row['seed']}: {row['status']}" for row in rows if row["status"] != "success"
            ),
        }
    ]


def kidnapped_once(seed: int) -> dict[str, Any]:
    """One run of mission 05: seconds from the lift to the notice and to a good pose, or inf."""
    trace = Trace()
    report = run_mission("05_kidnapped", RunOptions(seed=seed, serve=False), [trace])
    lifted = next((e.time for e in trace.events if e.kind == "lifted"), None)
    row = {"seed": seed, "status": report.status, "by": report.relocalised_by}
    if lifted is None:
        return {**row, "noticed": inf, "corrected": inf}
    noticed = next((t for t, _, health in trace.errors if t > lifted and health < 0.3), inf)
    bad = [t for t, error, _ in trace.errors if t > lifted and error > GOOD_AGAIN]
    after = max(bad, default=lifted)
    over = trace.errors[-1][0]
    return {
        **row,
        "noticed": noticed - lifted,
        "corrected": inf if after >= over - 0.2 else after - lifted,
    }


def wall_table(seeds: int, jobs: int) -> Rows:
    """Mission 04: true distance to straight walls against what was asked for."""
    tasks = [(side, seed) for side in ("right", "left") for seed in range(seeds)]
    rows = in_order(wall_error, tasks, jobs)
    return [
        {
            "side": side,
            "seeds": seeds,
            "RMS cm (worst seed)": 100 * max(row["rms"] for row in rows if row["side"] == side),
            "samples": sum(row["samples"] for row in rows if row["side"] == side),
            "success": sum(row["status"] == "success" for row in rows if row["side"] == side),
        }
        for side in ("right", "left")
    ]


def wall_error(task: tuple[str, int]) -> dict[str, Any]:
    """RMS of the true distance error of one run of mission 04, on settled straights."""
    report, trace = wall_run(task)
    wall = load_world("l_room", MISSIONS).walls[0]
    # The outline runs through the wall's middle; the distance is kept to its surface.
    errors = straight_errors(trace.truths, wall.points, wanted=0.5 + wall.thickness / 2)
    rms = float(np.sqrt(np.mean(np.square(errors))))
    return {
        "side": task[0], "rms": rms, "samples": len(errors), "status": report.status,
    }  # fmt: skip


@cache
def wall_run(task: tuple[str, int]) -> tuple[Report, Trace]:
    """The run of mission 04 along one side with one seed, and its trace."""
    side, seed = task
    trace = Trace()
    options = RunOptions(seed=seed, arguments={"side": side}, serve=False)
    return run_mission("04_wall_follow", options, [trace]), trace


def straight_errors(poses: list[Pose2D], corners: FloatArray, wanted: float) -> list[float]:
    """Distance errors where a pose runs along a wall, a metre away from the wall's ends.

    Args:
        poses: true poses.
        corners: (n, 2) corners of a closed room.
        wanted: distance asked for, metres.
    """
    starts, ends = corners, np.roll(corners, -1, axis=0)
    lengths = np.linalg.norm(ends - starts, axis=1)
    keep = lengths > 0.01
    starts, along, lengths = starts[keep], (ends - starts)[keep], lengths[keep]
    along = along / lengths[:, None]
    errors = []
    for pose in poses:
        offset = np.array([pose.x, pose.y]) - starts
        travelled = np.einsum("ij,ij->i", offset, along)
        distance = np.abs(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])
        parallel = np.abs(along @ np.array([np.cos(pose.heading), np.sin(pose.heading)]))
        beside = (travelled > 1.0) & (travelled < lengths - 1.0) & (distance < wanted + 0.3)
        for wall in np.flatnonzero(beside & (parallel > np.cos(np.radians(15.0)))):
            errors.append(float(distance[wall] - wanted))
    return errors


def _finite(seconds: float) -> float | None:
    return seconds if isfinite(seconds) else None
