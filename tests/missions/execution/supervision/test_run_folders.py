"""Run folders: an old one is refused before anything starts, and each run has its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

MISSION = """\
mission: short
robot: scout
world: small_room
run: {sequence: [{wait: 0.2 s}]}
"""


def begin(folder: Path, *words: str) -> subprocess.Popen[str]:
    mission = folder / "short.yaml"
    mission.write_text(MISSION)
    return subprocess.Popen(
        [sys.executable, "-m", "missions.cli.app", "run", str(mission), "--headless",
         *words],
        cwd=folder, env=None, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_the_folder_of_a_finished_run_is_refused(tmp_path):
    old = tmp_path / "old"
    old.mkdir()
    (old / "report.json").write_text('{"status": "success"}')
    process = begin(tmp_path, "--out", str(old))
    output, errors = process.communicate()
    assert (process.returncode, output) == (2, "")
    assert "is not empty; choose another" in errors
    assert [file.name for file in old.iterdir()] == ["report.json"]


def test_of_two_runs_with_one_folder_one_is_refused(tmp_path):
    both = [begin(tmp_path, "--out", str(tmp_path / "same")) for _ in range(2)]
    errors = [process.communicate()[1] for process in both]
    assert sorted(process.returncode for process in both) == [0, 2]
    assert sum("is not empty; choose another" in text for text in errors) == 1


def test_three_runs_begun_at_once_get_three_folders(tmp_path):
    three = [begin(tmp_path) for _ in range(3)]
    for process in three:
        process.communicate()
    assert [process.returncode for process in three] == [0, 0, 0]
    folders = list((tmp_path / "runs").iterdir())
    assert len(folders) == 3
    assert all((folder / "report.json").is_file() for folder in folders)
