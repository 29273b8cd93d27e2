"""Builds the wheel, installs it into an empty environment and drives a mission with it.

Run by `make wheel-test`. Nothing of the checkout is in reach of the installed command: it runs in
another folder and without PYTHONPATH.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from zipfile import ZipFile

ROOT = Path(__file__).parents[1]
PACKAGES = ("missions", "behaviours", "stack", "tui", "robots")
MISSION = "01_drive_to_a_point"
OWN = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def main() -> None:
    """Print one line a stage; a stage that fails ends the process with its message."""
    with tempfile.TemporaryDirectory(prefix="wheel test ") as name:
        folder = Path(name)
        wheel = built(folder / "wheel")
        print(f"built {wheel.name}: {compared(wheel)} files, as in the checkout")
        commands = installed(wheel, folder / "environment")
        print(f"installed; {MISSION} {driven(commands / 'treepilot', folder / 'elsewhere')}")


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


def driven(treepilot: Path, folder: Path) -> str:
    """Drive a shipped mission in an empty folder; its report's status, which is success."""
    folder.mkdir()
    words = ["run", MISSION, "--headless", "--speed", "max", "--out", "run"]
    done = subprocess.run([treepilot, *words], cwd=folder, env=OWN, check=False)
    if done.returncode != 0:
        sys.exit(f"treepilot {' '.join(words)}: exit code {done.returncode}, expected 0")
    report = json.loads((folder / "run" / "report.json").read_text("utf-8"))
    if report["status"] != "success":
        sys.exit(f"report.json says {report['status']!r}, expected 'success'")
    return str(report["status"])


def pip(python: Path | str, *words: Path | str) -> None:
    """Run pip of that Python, quietly and with its usual cache."""
    subprocess.run(
        [python, "-m", "pip", "--disable-pip-version-check", "--quiet", *words],
        env=OWN, check=True,
    )  # fmt: skip


if __name__ == "__main__":
    main()
