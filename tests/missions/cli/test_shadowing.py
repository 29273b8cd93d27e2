"""Files with the names of our packages: the command works; elsewhere the error names them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from missions.shadowing import PACKAGES

ROOT = Path(__file__).parents[3]
MISSION = "mission: a\nrobot: scout\nworld: small_room\nrun: {say: hello}\n"


def python(*words: str, cwd: Path, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(map(str, filter(None, [path, ROOT]))),
    }
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, cwd=cwd,
        env=environment,
    )  # fmt: skip


def test_files_in_the_current_folder_do_not_hide_ours(tmp_path):
    for name in PACKAGES:
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('the wrong file')\n")
    (tmp_path / "a.yaml").write_text(MISSION)
    # -P: the script `treepilot` has the folder of the command first, not the current one.
    code = "from missions.cli.app import main; main()"
    done = python("-P", "-c", code, "run", "a.yaml", "--headless", "--no-rerun", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "hello" in done.stderr + done.stdout


@pytest.mark.parametrize("name", ["robots.py", "stack/__init__.py"])
def test_the_error_names_the_file_that_hides_ours(name, tmp_path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("")
    done = python("-P", "-c", "import missions", cwd=tmp_path, path=tmp_path)
    hidden = tmp_path / name.split("/")[0]
    assert f"{hidden} hides treepilot's package `{hidden.stem}`: rename it" in done.stderr
    (tmp_path / "script.py").write_text("import missions\n")
    done = python("script.py", cwd=tmp_path)
    assert f"{hidden} hides treepilot's package `{hidden.stem}`: rename it" in done.stderr
