"""Kill runs at random moments and check what they leave.

python -m tests.missions.execution.killed_runs 50
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

from stack.telemetry.event_log import read_events

RERUN = Path(sysconfig.get_path("scripts")) / "rerun"
MISSION = "02_office_patrol"
PROGRAM = """
import sys
import missions
missions.run("02_office_patrol", out=sys.argv[1], rerun=True)
"""


def kill_one(folder: Path, after: float) -> dict[str, bool | int]:
    """Run a mission, kill it some wall seconds after its first event; check its records.

    Returns:
        Whether each record is as it must be, and the number of events and of bytes recorded.
    """
    run = subprocess.Popen([sys.executable, "-c", PROGRAM, folder], stderr=subprocess.DEVNULL)
    events, mission = folder / "events.jsonl", folder / "mission.yaml"
    while not (events.exists() and events.stat().st_size) and run.poll() is None:
        time.sleep(0.01)  # noqa: TID251 - waits for another process
    time.sleep(after)  # noqa: TID251
    over = run.poll() is not None
    run.send_signal(signal.SIGKILL)
    run.wait()
    recording = folder / "mission.rrd"
    numbers = [event.number for event in read_events(events)]
    return {
        "was running": not over,
        "events": len(numbers),
        "numbered": numbers == [*range(len(numbers))],
        "mission whole": mission.read_text("utf-8").startswith("# Patrol of an office"),
        "no report": over or not (folder / "report.json").exists(),
        "recorded": recording.stat().st_size if recording.exists() else 0,
        "readable": not recording.exists() or is_readable(recording),
    }


def is_readable(recording: Path) -> bool:
    """Whether rerun's own tools read a recording up to its last complete message."""
    if recording.stat().st_size == 0:
        return True
    command = [RERUN, "rrd", "stats", recording]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def main() -> None:
    """Kill as many runs as the command line says, at moments of the first four wall seconds."""
    kills, chance = int(sys.argv[1]), random.Random(0)
    with tempfile.TemporaryDirectory() as parent:
        found = [kill_one(Path(parent) / str(n), chance.uniform(0.0, 4.0)) for n in range(kills)]
    for name in ("was running", "numbered", "mission whole", "no report", "readable"):
        print(f"{name}: {sum(bool(item[name]) for item in found)}/{kills}")
    for name in ("events", "recorded"):
        values = sorted(int(item[name]) for item in found)
        print(f"{name}: {values[0]} to {values[-1]}, median {values[len(values) // 2]}")


if __name__ == "__main__":
    main()
