"""`treepilot check` of missions of up to the allowed 10 000 nodes, and edits in an editor."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.benchmarks.editing import edit_series
from tests.benchmarks.large_mission import large_mission
from tests.benchmarks.table import Rows

NODES, RUNS = (9, 1001, 2001, 5001, 9993), 3
"""Of the missions, which have eight nodes for each visit and one more; processes for each."""

EDITS, EDITED = 20, 1001
"""Edits in a row, and nodes of the mission that is edited."""


def run() -> Rows:
    """Processor time and peak memory of a check, the best of some processes; and of the edits."""
    rows: Rows = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "large.yaml"
        for nodes in NODES:
            file.write_text(large_mission(nodes), "utf-8")
            measured = [_check(file) for _ in range(RUNS)]
            seconds = min(seconds for seconds, _ in measured)
            first = rows[0] if rows else {"processor s": seconds, "nodes": 0}
            more = 1e3 * (seconds - first["processor s"]) / (nodes - first["nodes"])
            rows.append({
                "what": "check", "nodes": nodes, "processor s": seconds,
                "ms per node": more if len(rows) else None,
                "peak memory MB": min(memory for _, memory in measured),
            })  # fmt: skip
    edited = min(
        edit_series(large_mission(EDITED), EDITS)["processor s"] for _ in range(RUNS)
    )  # fmt: skip
    return [*rows, _edits(edited)]


def _edits(seconds: float) -> dict[str, Any]:
    return {
        "what": f"{EDITS} edits in the language server", "nodes": EDITED, "processor s": seconds,
        "ms per node": None, "peak memory MB": None,
    }  # fmt: skip


def _check(file: Path) -> tuple[float, float]:
    """Processor seconds and peak memory (MB) of a `treepilot check`."""
    command = [sys.executable, "-m", "missions.cli.app", "check", str(file)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, "the large mission is faulty"
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0
