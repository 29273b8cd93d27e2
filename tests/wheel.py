"""Builds the wheel, installs it into an empty environment and drives every shipped mission with it.

Run by `make wheel-test`. The environment holds what a user installs: no test tools, and no extras
until the missions that need one have been refused with the command that installs it. Nothing of the
checkout is in reach of the installed command: it runs in another folder and without PYTHONPATH.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from zipfile import ZipFile

from tests.missions.shipped import ARGUMENTS, check_success

ROOT = Path(__file__).parents[1]
PACKAGES = ("treepilot", "missions", "behaviours", "stack", "tui", "robots")
WORDS = "run --headless --speed max --seed 1 --out".split()
EXTRAS = {
    "50_pick_the_red_block": "arm", "51_sort_by_colour": "arm", "52_stack_three": "arm",
    "53_fetch": "arm", "54_hand_eye": "arm",
}  # fmt: skip
"""Missions that need an extra, and which."""

OWN = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def main() -> None:
    """Print one line a stage; a stage that fails ends the process with its message."""
    with tempfile.TemporaryDirectory(prefix="wheel test ") as name:
        folder = Path(name)
        wheel = built(folder / "wheel")
        print(f"built {wheel.name}: {compared(wheel)} files, as in the checkout")
        commands = installed(wheel, folder / "environment")
        treepilot, elsewhere = commands / "treepilot", folder / "elsewhere"
        elsewhere.mkdir()
        missions = sorted(file.stem for file in (ROOT / "missions").glob("*.yaml"))
        called(treepilot, ["check", *(one for one in missions if one not in EXTRAS)], elsewhere)
        for name, extra in EXTRAS.items():
            refused(treepilot, name, f"treepilot[{extra}]", elsewhere)
        for extra in sorted(set(EXTRAS.values())):
            pip(commands / "python", "install", f"treepilot[{extra}] @ {wheel.as_uri()}")
        called(treepilot, ["check", *missions], elsewhere)
        driven(treepilot, missions, elsewhere)
        print(f"installed; drove {len(missions)} missions to success")


def built(folder: Path) -> Path:
    """The wheel of the checkout."""
    pip(sys.executable, "wheel", "--no-deps", "--wheel-dir", folder, ROOT)
    (wheel,) = folder.glob("*.whl")
    return wheel


def compared(wheel: Path) -> int:
    """How many files it holds: those of the packages and nothing else (no tests, no pages)."""
    git = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *PACKAGES],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    expected = {name for name in git.stdout.split("\0") if name and (ROOT / name).exists()}
    with ZipFile(wheel) as archive:
        found = {name for name in archive.namelist() if ".dist-info/" not in name}
    if missing := sorted(expected - found):
        sys.exit(f"missing from the wheel: {', '.join(missing)}")
    if surplus := sorted(found - expected):
        sys.exit(f"in the wheel, but not in the packages: {', '.join(surplus)}")
    return len(found)


def installed(wheel: Path, folder: Path) -> Path:
    """The folder of commands of a fresh environment with the wheel and what it depends on."""
    venv.create(folder, with_pip=True)
    commands = folder / "bin"
    pip(commands / "python", "install", wheel)
    return commands


def driven(treepilot: Path, missions: list[str], folder: Path) -> None:
    """Drive missions to success without a collision, two at a time."""
    called(treepilot, [*WORDS, "runs/first", missions[0]], folder)  # compiles the kernels once
    with ThreadPoolExecutor(max_workers=2) as pool:
        runs = [
            pool.submit(called, treepilot, [*WORDS, f"runs/{name}", name, *settings(name)], folder)
            for name in missions
        ]
    for name, run in zip(missions, runs, strict=True):
        run.result()
        check_success(name, json.loads((folder / "runs" / name / "report.json").read_text("utf-8")))


def settings(name: str) -> list[str]:
    """Options of the command line for the arguments of a mission."""
    given = ARGUMENTS.get(name, {}).items()
    return [word for key, value in given for word in ("--set", f"{key}={value}")]


def refused(treepilot: Path, mission: str, remedy: str, folder: Path) -> None:
    """Run a mission that needs an extra; it must be refused with the remedy before it begins."""
    done = subprocess.run(
        [treepilot, *WORDS, "runs/refused", mission], cwd=folder, env=OWN, check=False,
        capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode != 2 or remedy not in done.stdout + done.stderr:
        sys.exit(
            f"{mission}: exit code {done.returncode}, expected 2 and {remedy!r}\n"
            f"{done.stdout[-3000:]}{done.stderr[-3000:]}"
        )


def called(treepilot: Path, words: list[str], folder: Path) -> None:
    """Run a command in that folder; its exit code must be 0."""
    done = subprocess.run(
        [treepilot, *words], cwd=folder, env=OWN, check=False, capture_output=True, text=True
    )
    if done.returncode != 0:
        sys.exit(
            f"treepilot {' '.join(words)}: exit code {done.returncode}, expected 0\n"
            f"{done.stdout[-3000:]}{done.stderr[-3000:]}"
        )


def pip(python: Path | str, *words: Path | str) -> None:
    """Run pip of that Python, quietly and with its usual cache."""
    subprocess.run(
        [python, "-m", "pip", "--disable-pip-version-check", "--quiet", *words],
        env=OWN, check=True,
    )  # fmt: skip


if __name__ == "__main__":
    main()
