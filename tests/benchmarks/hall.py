"""A drive of 100 m across a hall of 200 x 200 m: what a step costs where the map is large."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from tests.benchmarks.startup import STAGES, timed_report
from tests.benchmarks.table import Rows

SIDE, BOXES = 200.0, 20
START, END = 30.0, 102.0
"""x and y of both ends of the drive on the hall's diagonal, metres: 101.8 m apart."""

MISSION = """\
mission: across the hall
robot: scout
world: ./hall.yaml
run:
  navigate_to_pose: {goal: $far}
  timeout: 5 min
"""


def hall_world() -> str:
    """The world file: four walls, and boxes of 1 to 4 m on both sides of the diagonal.

    A box stands 2 to 4 m left or right of the way every 5 m, so that a lidar with a range of 12 m
    always sees some; in the rest of the hall it sees nothing.
    """
    step = (END - START) / BOXES
    lines = [
        "world: hall",
        "format: 1",
        f"start: [{START}, {START}, 45 deg]",
        f"places: {{far: [{END}, {END}, 45 deg]}}",
        f"walls: [{{points: [[0, 0], [{SIDE}, 0], [{SIDE}, {SIDE}], [0, {SIDE}]], closed: true}}]",
        "boxes:",
    ]
    for n in range(BOXES):
        along = START + (n + 0.5) * step
        aside = (2.2 + 0.3 * (n * 7 % 5)) * (1.0 if n % 2 else -1.0)
        pose = f"[{along - aside:.2f}, {along + aside:.2f}, {n * 37 % 180} deg]"
        lines.append(f"  - {{at: {pose}, size: [{1 + n % 4}, {1 + n % 3}, 1.0]}}")
    return "\n".join(lines) + "\n"


def hall_figures(runs: int) -> Rows:
    """One drive of each controller, each run a process of its own."""
    return [_row(controller, runs) for controller in ("pure_pursuit", "mppi", "dwb")]


def _row(controller: str, runs: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hall.yaml").write_text(hall_world(), "utf-8")
        mission = Path(folder) / "across.yaml"
        mission.write_text(MISSION, "utf-8")
        reports = [
            timed_report(str(mission), seed, "--parameter",
                         f"controller.use={controller}")
            for seed in range(runs)
        ]  # fmt: skip
    worst = max(reports, key=lambda report: report["stages"]["costmap"]["worst_ms"])
    return {
        "controller": controller,
        "success": f"{sum(report['status'] == 'success' for report in reports)}/{runs}",
        "x real time": min(report["real_time_factor"] for report in reports),
        "start to first tick s": max(report["start to first tick s"] for report in reports),
        "peak memory MB": max(report["peak_memory_mb"] for report in reports),
        "distance m": max(report["distance_m"] for report in reports),
        "replans": max(report["replans"] for report in reports),
        "error max m": max(report["localisation_error"]["max"] for report in reports),
        "costmap overruns": sum(r["stages"]["costmap"]["overruns"] for r in reports),
        "costmap worst ms": worst["stages"]["costmap"]["worst_ms"],
        **{
            f"{stage} ms": max(report["stages"][stage]["mean_ms"] for report in reports)
            for stage in STAGES
        },
    }
