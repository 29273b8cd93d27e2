"""Mission 02 in process, over MAVLink and over CAN: what the wire costs.

    python -m tests.benchmarks.over_the_wire [RUN ...]      # in_process mavlink can

In process the simulation is the robot. Over MAVLink another treepilot simulates it, and the body
`mavlink` drives it over UDP on this machine. Over CAN emulated ODrive axes move it, on python-can's
`udp_multicast`, and the body `wheels` drives them. Success, time and rates are those of the mission
that drives; contacts and clearance those of the world that has the truth, from the start of that
mission to its end. The runs over a wire are in real time, some 100 s each.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time  # two programs in real time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.missions.execution.lossy_relay import free_port
from tests.robots.motors.emulated_robot import robot_process

ROOT = Path(__file__).parents[2]
ROBOTS = ROOT / "robots"
PATROL = "02_office_patrol"
VEHICLE = """
mission: rover
format: 1
robot: scout_rover
world: office
start: dock
run: {wait: {time: 10 min}}
"""
WAITS = 120.0
"""Wall seconds that the vehicle gets to begin."""


def in_process(folder: Path) -> dict[str, Any]:
    """Drive in the simulation."""
    report = _patrol(folder, ROBOTS / "scout_rover" / "robot.yaml")
    return {**_driven(report), **_truth(report)}


def over_mavlink(folder: Path) -> dict[str, Any]:
    """Drive the rover that another run simulates."""
    port, vehicle = free_port(), folder / "vehicle.yaml"
    vehicle.write_text(VEHICLE)
    file = _robot_file(
        folder, "scout_rover", f"body: {{use: mavlink, connect: 'udpin:127.0.0.1:{port}'}}\n"
    )
    out, log = folder / "vehicle", folder / "vehicle.log"
    words = [vehicle, "--speed", "1", "--mavlink", f"udpout:127.0.0.1:{port}", "--out", out]
    with log.open("w") as written:
        process = subprocess.Popen(_run(*words), cwd=ROOT, stdout=written, stderr=written)
    try:
        limit = time.monotonic() + WAITS  # noqa: TID251
        while "wait 600.0 s left" not in log.read_text():
            assert time.monotonic() < limit and process.poll() is None, log.read_text()  # noqa: TID251
            time.sleep(0.1)  # noqa: TID251
        report = _patrol(folder, file)
    finally:
        process.terminate()
        process.wait(30.0)
    link = report["body_link"]
    latency = (
        f"{_ms(link['round_trip_median'])} / {_ms(link['round_trip_99'])} (round trip p50, p99)"
    )
    rates = {name: link["rates"].get(name) for name in ("ATTITUDE", "OBSTACLE_DISTANCE")}
    there = json.loads((out / "report.json").read_text())
    return {
        **_driven(report), **_truth(there), "latency": latency,
        "rates": f"setpoints {link['setpoints']:.1f}, "
        + ", ".join(f"{name} {rate:.1f}" for name, rate in rates.items()),
    }  # fmt: skip


def over_can(folder: Path) -> dict[str, Any]:
    """Drive emulated axes."""
    with robot_process("46_own_wheels") as robot:
        more = f"body: {robot.body}\n"
        report = _patrol(folder, _robot_file(folder, "scout_wheels", more, robot.port))
        there = robot.end()
    loop = report["fast_loop"]
    seconds = loop["cycles"] / loop["rate"]
    return {
        **_driven(report), "contacts": there["collisions"],
        "clearance": there["min_clearance_m"],
        "latency": f"{_ms(loop['late_median'])} / {_ms(loop['late_999'])} (p50, p99.9 of a cycle)",
        "rates": f"loop {loop['rate']:.0f}, overruns {loop['overruns']} in {seconds:.0f} s",
    }  # fmt: skip


RUNS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "in_process": in_process, "mavlink": over_mavlink, "can": over_can,
}  # fmt: skip


def _patrol(folder: Path, robot: Path) -> dict[str, Any]:
    """The report of the patrol, with this robot file."""
    out = folder / "brain"
    done = subprocess.run(
        _run(PATROL, "--robot", robot, "--out", out), cwd=ROOT, capture_output=True, text=True
    )
    if not (out / "report.json").exists():
        raise SystemExit(done.stdout + done.stderr)
    report: dict[str, Any] = json.loads((out / "report.json").read_text())
    return report


def _run(*words: object) -> list[str]:
    return [sys.executable, "-m", "treepilot", "run", *map(str, words), "--headless"]


def _robot_file(folder: Path, name: str, more: str, port: int = 0) -> Path:
    """A shipped robot file with another body."""
    text = (ROBOTS / name / "robot.yaml").read_text().replace("../scout", str(ROBOTS / "scout"))
    file = folder / "robot.yaml"
    file.write_text(text.replace("port: 5610", f"port: {port}") + more)
    return file


def _driven(report: dict[str, Any]) -> dict[str, Any]:
    step = report["stages"]["step"]
    return {
        "status": report["status"], "seconds": round(report["simulated_seconds"], 1),
        "metres": round(report["distance_m"], 1), "recoveries": report["recoveries"],
        "step mean / worst": f"{step['mean_ms']:.1f} / {step['worst_ms']:.1f} ms",
        "late steps": f"{step['overruns']} of {step['count']}",
    }  # fmt: skip


def _truth(report: dict[str, Any]) -> dict[str, Any]:
    return {"contacts": report["collisions"], "clearance": report["min_clearance_m"]}


def _ms(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1000 * seconds:.1f} ms"


def main() -> None:
    """Print a block for each run."""
    os.environ.setdefault("PYTHONPATH", str(ROOT))
    for name in sys.argv[1:] or RUNS:
        with tempfile.TemporaryDirectory() as folder:
            found = RUNS[name](Path(folder))
        print(name, *(f"  {key}: {value}" for key, value in found.items()), sep="\n", flush=True)


if __name__ == "__main__":
    main()
