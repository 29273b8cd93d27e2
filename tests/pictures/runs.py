"""The runs that the pictures show, recorded once into a folder."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.origin import ROOT


@dataclass(frozen=True)
class Recorded:
    """A mission that is run for pictures.

    Attributes:
        mission: name of a shipped mission.
        seed: of the run; the same run gives the same pictures, apart from compute times and memory.
    """

    mission: str
    seed: int


RUNS = {
    "office": Recorded("02_office_patrol", 7),
    "red_box": Recorded("33_find_the_red_box", 1),
    "corridor": Recorded("03_blocked_corridor", 7),
    "kidnapped": Recorded("05_kidnapped", 7),
    "arm": Recorded("50_pick_the_red_block", 1),
}


def run_folder(name: str, folder: Path) -> Path:
    """Return the folder of a run; drive it unless it is there."""
    found, run = folder / name, RUNS[name]
    if not (found / "report.json").is_file():
        print(f"running {run.mission}", flush=True)
        subprocess.run(
            [sys.executable, "-m", "treepilot", "run", run.mission, "--seed", str(run.seed),
             "--headless", "--speed", "max", "--out", str(found)],
            cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
        )  # fmt: skip
    return found
