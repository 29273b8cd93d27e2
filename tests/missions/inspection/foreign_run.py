"""A recorded run that somebody else sent, and the commands that explain it."""

from __future__ import annotations

import asyncio
from pathlib import Path

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from missions.execution.supervision.replaying import player_of
from tests.missions.cli.test_cli import treepilot
from tui.replay.app import ReplayDashboard

WORLD = """\
world: hall
format: 1
bounds: [-0.5, -0.5, 6.5, 4.5]
start: west
places: {west: [1.5, 2.0, 0 deg], east: [4.5, 2.0, 0 deg]}
walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4]], closed: true}]
boxes: [{name: shelf, at: [3.2, 2.0, 0 deg], size: [0.3, 3.9, 1.0], on_map: false}]
"""
MISSION = """\
mission: a closed way
format: 1
robot: scout
world: ./hall.yaml
plugins: [./own]
run:
  sequence:
    - brought: {}
    - navigate_to_pose: {goal: $east}
      timeout: 9 s
"""
PLUGIN = '''\
"""Says that it was imported."""

from pathlib import Path

from treepilot import Behaviour, Status

Path({marker!r}).touch()


class Brought(Behaviour):
    """Ends at once."""

    def update(self):
        return Status.SUCCESS
'''

COMMANDS = {
    "diagnose": ("diagnose", "RUN"),
    "diagnose --json": ("diagnose", "RUN", "--json"),
    "report": ("report", "RUN", "-o", "OUT/page.html"),
    "trace": ("trace", "RUN"),
    "trace --summary": ("trace", "RUN", "--summary"),
    "trace --at": ("trace", "RUN", "--at", "2"),
    "topic list": ("topic", "list", "RUN"),
    "topic echo": ("topic", "echo", "RUN", "pose", "-n", "3"),
    "topic echo events": ("topic", "echo", "RUN", "events", "--json"),
    "topic echo sensors": ("topic", "echo", "RUN", "sensors.lidar", "-n", "2"),
    "topic hz": ("topic", "hz", "RUN", "scan"),
    "export": ("export", "RUN", "--mcap", "-o", "OUT/run.mcap"),
    "runs": ("runs", "--folder", "PARENT"),
    "runs pack": ("runs", "--folder", "PARENT", "pack", "NAME", "-o", "OUT/run.zip"),
    "runs open": ("runs", "--folder", "PARENT", "open", "NAME", "--foxglove"),
    "runs open zip": ("runs", "--folder", "OUT/unpacked", "open", "ZIP"),
    "runs open rerun": ("runs", "--folder", "PARENT", "open", "NAME"),
}  # fmt: skip
"""Commands that explain a run or hand it on, and the words of each."""


def record(folder: Path) -> tuple[Path, Path]:
    """Run a mission that fails; return its run folder, and the file that its plugin writes."""
    marker = folder / "imported"
    (folder / "own").mkdir()
    (folder / "own" / "brought.py").write_text(PLUGIN.format(marker=str(marker)), "utf-8")
    (folder / "hall.yaml").write_text(WORLD, "utf-8")
    (folder / "m.yaml").write_text(MISSION, "utf-8")
    out = folder / "runs" / "closed"
    run_mission(folder / "m.yaml", RunOptions(seed=1, out=out, record=("sensors",), serve=False))
    assert marker.exists(), "the plugin of the mission was imported"
    marker.unlink()
    return out, marker


def explain(command: str, run: Path, out: Path, packed: Path | None = None) -> tuple[int, str, str]:
    """Carry out one of COMMANDS on a run; return the exit code, and the texts of both streams.

    Args:
        command: of COMMANDS.
        run: its folder.
        out: a folder for what is written.
        packed: the run as a zip file.
    """
    places = {"RUN": str(run), "PARENT": str(run.parent), "NAME": run.name, "ZIP": str(packed)}
    words = [places.get(word, word.replace("OUT", str(out))) for word in COMMANDS[command]]
    done = treepilot(*words)
    return done.returncode, done.stdout, done.stderr


def look_at(run: Path) -> None:
    """Open a run in the dashboard, and go to its end and back to its first failure.

    Raises:
        InputError: it cannot be shown.
    """

    async def look() -> None:
        player = player_of(run, "", 1.0)
        try:
            async with ReplayDashboard(player).run_test() as pilot:
                for key in ("space", "end", "X", "home", "n"):
                    await pilot.press(key)
        finally:
            player.close()

    asyncio.run(look())
