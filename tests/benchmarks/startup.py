"""Real-time factor, start-up and memory, each measured on a fresh process."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from missions.inspection.check import check_files
from tests.benchmarks.editing import edit_series
from tests.benchmarks.large_mission import large_mission
from tests.benchmarks.table import Rows

STAGES = ("body", "estimate", "costmap", "navigate", "safety", "publish")
"""Of the step loop, whose mean times are shown; the report has all of them."""


def run_figures(runs: int, mission: str = "02_office_patrol") -> Rows:
    """Whole `treepilot run --json` processes, pinned to one core where the system allows."""
    return [
        _run_figures(mission, controller, runs) for controller in ("pure_pursuit", "mppi", "dwb")
    ]


def _run_figures(mission: str, controller: str, runs: int) -> dict[str, Any]:
    chosen = ("--parameter", f"controller.use={controller}")
    reports = [timed_report(mission, seed, *chosen) for seed in range(runs)]
    return {
        "controller": controller,
        "recording": "on",
        "success": f"{sum(report['status'] == 'success' for report in reports)}/{len(reports)}",
        "x real time": median(report["real_time_factor"] for report in reports),
        "start to first tick s": median(report["start to first tick s"] for report in reports),
        "simulated s": median(report["simulated_seconds"] for report in reports),
        "peak memory MB": max(report["peak_memory_mb"] for report in reports),
        **{
            f"{stage} ms": median(report["stages"][stage]["mean_ms"] for report in reports)
            for stage in STAGES
        },
    }


def timed_report(mission: str, seed: int, *options: str) -> dict[str, Any]:
    """Report of a `treepilot run` on one core, with the seconds from its start to the first tick.

    Args:
        mission: name or path.
        seed: of the run.
        options: of the command.
    """
    with tempfile.TemporaryDirectory() as folder:
        began = perf_counter()
        done = subprocess.run(
            [*_one_core(), *_treepilot("run", mission), "--json", *options,
             "--seed", str(seed), "--out", str(Path(folder) / "run")],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        report = json.loads(done.stdout)
        whole = perf_counter() - began
    return {**report, "start to first tick s": whole - report["wall_seconds"]}


def command_times() -> Rows:
    """Wall and processor time of commands that should answer at once.

    The last rows are the check alone, of a mission of 1001 nodes in a process that has checked one
    before, and all work of the language server after 20 edits of it.
    """
    with tempfile.TemporaryDirectory() as folder:
        large = Path(folder) / "large.yaml"
        large.write_text(large_mission(1001), "utf-8")
        commands = {
            "--help": ["--help"],
            "check 02_office_patrol": ["check", "02_office_patrol"],
            "check, 1001 nodes": ["check", str(large)],
            "show 02_office_patrol": ["show", "02_office_patrol"],
            "list behaviours": ["list", "behaviours"],
        }
        rows = [_command_row(name, _treepilot(*words)) for name, words in commands.items()]
        return [*rows, *_first_tick_rows(Path(folder)), {
            "command": "check, 1001 nodes, warm", "median s": _warm_check(large),
            "best s": None, "processor s": None,
        }, {
            "command": "lsp, 20 edits in a row, 1001 nodes", "median s": None, "best s": None,
            "processor s": edit_series(large_mission(1001), 20)["processor s"],
        }]  # fmt: skip


def _first_tick_rows(folder: Path) -> Rows:
    """Seconds until a mission's first tick, in a process that compiles the kernels and the next."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels")}
    command = _treepilot("run", "01_drive_to_a_point", "--json")
    rows = []
    for kernels in ("compiled", "cached"):
        began = perf_counter()
        done = subprocess.run(
            [*command, "--out", str(folder / kernels)],
            env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        whole = perf_counter() - began
        rows.append({
            "command": f"run 01_drive_to_a_point, to the first tick, kernels {kernels}",
            "median s": whole - json.loads(done.stdout)["wall_seconds"],
            "best s": None, "processor s": None,
        })  # fmt: skip
    return rows


def _command_row(name: str, command: list[str]) -> dict[str, Any]:
    timed = [_timed(command) for _ in range(7)]
    return {
        "command": name, "median s": median(wall for wall, _ in timed),
        "best s": min(wall for wall, _ in timed), "processor s": min(cpu for _, cpu in timed),
    }  # fmt: skip


def _warm_check(file: Path) -> float:
    check_files([str(file)])
    times = []
    for _ in range(7):
        began = perf_counter()
        assert not check_files([str(file)]), "the large mission is faulty"
        times.append(perf_counter() - began)
    return median(times)


def _timed(command: list[str]) -> tuple[float, float]:
    """Seconds on the wall, and of the processor, as long as nobody else starts processes here."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = perf_counter()
    subprocess.run(command, capture_output=True, check=False)
    wall = perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)


def _treepilot(*words: str) -> list[str]:
    return [sys.executable, "-m", "missions.cli.app", *words]


def _one_core() -> list[str]:
    from shutil import which

    return ["taskset", "-c", "0"] if which("taskset") else []
