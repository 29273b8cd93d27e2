"""The tests pass and `make` works wherever the checkout is and whatever its folder is called.

Run are those tests that look at paths, compare output lines or start processes, as far as they need
no compiled kernels, which every copy would compile again.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
PACKAGES = ("treepilot", "missions", "behaviours", "stack", "tui", "robots")
PARTS = (*PACKAGES, "tests", "docs", "README.md", "LICENSE", "Makefile", "pyproject.toml")
SELECTION = (
    "tests/behaviours/test_catalogue.py",
    "tests/missions/language/test_include.py",
    "tests/missions/execution/test_client.py::test_help_lists_every_order_with_a_sentence",
    "tests/missions/cli/test_cli.py::test_list_and_describe_know_the_plugins_of_a_mission",
)


def checkout(folder: Path) -> Path:
    """A copy of what is under version control, as far as tests need it."""
    folder.mkdir(parents=True)
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, folder / part)
    return folder


def environment() -> dict[str, str]:
    """Ours without what this run of pytest and its make have left in it."""
    return {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTEST", "PYTHON", "MAKE", "MFLAGS"))
    }


def run_selection(folder: Path) -> str:
    """What pytest says about the selection in a checkout; absolute paths keep symbolic links."""
    done = subprocess.run(
        [sys.executable, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider",
         "-c", folder / "pyproject.toml", "--rootdir", folder, *(folder / it for it in SELECTION)],
        cwd=folder, env=environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_checkout_may_be_below_a_link_and_a_space_and_have_the_name_of_a_package(
    tmp_path: Path,
) -> None:
    checkout(tmp_path / "disk" / "a b" / "missions")
    (tmp_path / "home").symlink_to(tmp_path / "disk")
    assert " passed" in run_selection(tmp_path / "home" / "a b" / "missions")


def test_make_works_in_a_folder_with_a_space_in_its_name(tmp_path: Path) -> None:
    """With an environment that is there already: a stand-in notes what `make` asks of it."""
    folder = checkout(tmp_path / "a b")
    commands = folder / ".venv" / "bin"
    commands.mkdir(parents=True)
    for name in ("python", "treepilot", "ruff", "mypy"):
        (commands / name).write_text('#!/bin/sh\necho "${0##*/} $*" >> "$PWD/asked.txt"\n')
        (commands / name).chmod(0o755)
    for target in ("run", "check", "test", "wheel-test", "bench"):
        subprocess.run(["make", target], cwd=folder, env=environment(), check=True)
    asked = (folder / "asked.txt").read_text("utf-8").splitlines()
    assert [line for line in asked if " pip " not in line and " -c " not in line] == [
        "treepilot run missions/02_office_patrol.yaml",
        "ruff check treepilot missions behaviours stack tui robots tests",
        "ruff format --check treepilot missions behaviours stack tui robots tests",
        "mypy ",
        "python -m pytest -q -n 2 --dist loadgroup",
        "python -m tests.wheel",
        "python -m tests.benchmarks --trials 2 --worlds 5 --seeds 2 --kidnaps 10 --runs 1"
        " --twists 400 --presses 20",
    ]
    assert (folder / ".venv" / ".installed-test").exists()
