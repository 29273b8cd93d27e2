"""`python -m tests.benchmarks.pictures FOLDER`: the README's pictures, from a real run.

The dashboard is drawn as SVG by Textual; with Chromium on the machine it becomes a PNG as well.
The rerun picture needs a Vulkan driver (see tests/pictures/rerun_picture.py).
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from missions.execution.supervision.launch import LaunchOptions
from missions.execution.supervision.supervisor import Supervisor
from stack.telemetry.client import TelemetryClient
from stack.telemetry.rendezvous import RunHandle
from tui.app import Dashboard

SIZE = (150, 44)


async def dashboard(run: RunHandle, moment: float, target: Path) -> None:
    """Watch a run until a moment of robot time, then save what the screen shows."""
    app = Dashboard(TelemetryClient(run))
    async with app.run_test(size=SIZE) as pilot:
        while app.snapshot is None or app.snapshot.time < moment:
            await pilot.pause(0.05)
        app.save_screenshot(str(target))


def to_png(svg: Path, png: Path) -> bool:
    """Render an SVG with headless Chromium; False when there is none."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        return False
    size = f"--window-size={SIZE[0] * 12 + 60},{SIZE[1] * 25 + 60}"
    command = [
        chromium, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", size,
        f"--screenshot={png}", svg.resolve().as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def main() -> None:
    """Draw both pictures."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--mission", default="02_office_patrol", help="for the dashboard")
    arguments.add_argument("--at", type=float, default=24.0, help="its robot time, s")
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        svg = Path(scratch) / "dashboard.svg"
        watch(given.mission, given.at, Path(scratch) / f"watched-{os.getpid()}", svg)
        if not to_png(svg, given.folder / "dashboard.png"):
            shutil.copy(svg, given.folder / "dashboard.svg")
        recorded = Path(scratch) / "recorded"  # a mission that uses its camera
        run_mission("05_kidnapped", RunOptions(out=recorded, serve=False))
        subprocess.run(
            [sys.executable, "-m", "tests.pictures.rerun_picture", recorded,
             given.folder / "rerun.png", "--at", "5.2"],
            check=False,
        )  # fmt: skip


def watch(mission: str, moment: float, folder: Path, svg: Path) -> None:
    """Run a mission in an engine and draw the dashboard at a moment of robot time."""
    options = LaunchOptions((mission,), RunOptions(out=folder), speed="4")
    supervisor = Supervisor(options.request(), 0.0, show=True)
    supervisor.wait(lambda: bool(supervisor.started))
    asyncio.run(dashboard(RunHandle(**supervisor.started[0]["handle"]), moment, svg))
    supervisor.interrupt()
    supervisor.wait()
    supervisor.close()


if __name__ == "__main__":
    main()
