"""Real-time factor, start-up and memory, each measured on a fresh process."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

from tests.benchmarks.table import Rows

RUNS = 3


def run_figures(mission: str = "02_office_patrol") -> Rows:
    """Whole `treepilot run --json` processes, pinned to one core where the system allows."""
    reports = []
    for seed in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            began = perf_counter()
            done = subprocess.run(
                [*_one_core(), *_treepilot("run", mission), "--json", "--no-rerun",
                 "--seed", str(seed), "--out", str(Path(folder) / "run")],
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            report = json.loads(done.stdout)
            whole = perf_counter() - began
            reports.append({**report, "whole": whole})
    return [
        {
            "mission": mission,
            "x real time": median(report["real_time_factor"] for report in reports),
            "start to first tick s": median(
                report["whole"] - report["wall_seconds"] for report in reports
            ),
            "simulated s": median(report["simulated_seconds"] for report in reports),
            "peak memory MB": max(report["peak_memory_mb"] for report in reports),
        }
    ]


def command_times() -> Rows:
    """Wall time of commands that should answer at once."""
    commands = {
        "--help": ["--help"],
        "check 02_office_patrol": ["check", "02_office_patrol"],
        "show 02_office_patrol": ["show", "02_office_patrol"],
        "list behaviours": ["list", "behaviours"],
    }
    return [
        {"command": name, "median s": median(_timed(_treepilot(*words)) for _ in range(5))}
        for name, words in commands.items()
    ]


def _timed(command: list[str]) -> float:
    began = perf_counter()
    subprocess.run(command, capture_output=True, check=False)
    return perf_counter() - began


def _treepilot(*words: str) -> list[str]:
    return [sys.executable, "-m", "missions.cli", *words]


def _one_core() -> list[str]:
    from shutil import which

    return ["taskset", "-c", "0"] if which("taskset") else []
