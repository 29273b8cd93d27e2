"""What the records of a run cost: processor time, bytes and memory, with and without them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.benchmarks.hall import MISSION, hall_world
from tests.benchmarks.table import Rows

PROGRAM = """
import json, resource, sys, time
from pathlib import Path
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run

mission, out, records = sys.argv[1:]
options = RunOptions(out=Path(out) if records == "on" else None, serve=False)
run = Run(prepare(mission, options), options)
for _ in range(20):
    run.step()
before, began = run.engine.body.time, time.process_time()
while not run.is_over:
    run.step()
report = run.finish()
run.close()
files = Path(out).rglob("*")
print(json.dumps({
    "status": report.status,
    "simulated s": run.engine.body.time - before,
    "processor s": time.process_time() - began,
    "memory MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    "MB": sum(file.stat().st_size for file in files) / 1e6,
}))
"""
"""Runs a mission and prints its figures; the processor time is that of all threads."""


def recording_figures(runs: int) -> Rows:
    """The office patrol, and a drive of 102 m across a hall of 200 x 200 m.

    Runs with and without recording alternate, each in a process of its own; of each the least
    processor time counts, so that other work on the machine disturbs little.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hall.yaml").write_text(hall_world(), "utf-8")
        across = Path(folder) / "across.yaml"
        across.write_text(MISSION, "utf-8")
        return [
            _row("office patrol", "02_office_patrol", runs),
            _row("across the hall", str(across), runs),
        ]


def _row(name: str, mission: str, runs: int) -> dict[str, Any]:
    found: dict[str, list[dict[str, Any]]] = {"off": [], "on": []}
    for _ in range(runs):
        for recording, figures in found.items():
            figures.append(_figures(mission, recording))
    off, on = (min(figures, key=lambda run: run["processor s"]) for figures in found.values())
    return {
        "mission": name,
        "success": f"{sum(run['status'] == 'success' for run in found['on'])}/{runs}",
        "x real time off": off["simulated s"] / off["processor s"],
        "x real time on": on["simulated s"] / on["processor s"],
        "cost %": 100.0 * (on["processor s"] / off["processor s"] - 1.0),
        "MB a minute": 60.0 * on["MB"] / on["simulated s"],
        "memory MB off": max(run["memory MB"] for run in found["off"]),
        "memory MB on": max(run["memory MB"] for run in found["on"]),
    }


def _figures(mission: str, recording: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", PROGRAM, mission, str(Path(folder) / "run"), recording]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures
