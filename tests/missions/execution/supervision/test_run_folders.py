"""Run folders: runs that begin at once never share one."""

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


def test_of_runs_begun_at_once_each_has_a_folder_and_one_is_refused_that_of_another(tmp_path):
    own = [begin(tmp_path) for _ in range(2)]
    same = [begin(tmp_path, "--out", str(tmp_path / "same")) for _ in range(2)]
    errors = [process.communicate()[1] for process in same]
    assert sorted(process.returncode for process in same) == [0, 2]
    assert sum("is not empty; choose another" in text for text in errors) == 1
    for process in own:
        process.communicate()
    assert [process.returncode for process in own] == [0, 0]
    folders = list((tmp_path / "runs").iterdir())
    assert len(folders) == 2
    assert all((folder / "report.json").is_file() for folder in folders)
