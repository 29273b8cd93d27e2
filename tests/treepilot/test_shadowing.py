"""Files with the names of our packages: the command works; elsewhere the error names them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from treepilot.shadowing import PACKAGES

ROOT = Path(__file__).parents[2]
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
    code = "from treepilot.__main__ import main; main()"
    done = python("-P", "-c", code, "run", "a.yaml", "--headless", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "hello" in done.stderr + done.stdout


def test_folders_without_modules_hide_nothing(tmp_path):
    for name in PACKAGES:
        (tmp_path / name).mkdir()
    (tmp_path / "missions" / "a.yaml").write_text(MISSION)
    script = "import treepilot; print(treepilot.run('missions/a.yaml').status)\n"
    (tmp_path / "script.py").write_text(script)
    done = python("script.py", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "success\n"), done.stderr


@pytest.mark.parametrize("name", ["robots.py", "missions/__init__.py", "stack/__init__.py"])
def test_the_error_names_the_file_that_hides_ours(name, tmp_path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("")
    hidden = tmp_path / name.split("/")[0]
    sentence = f"{hidden} hides treepilot's package `{hidden.stem}`: rename it"
    (tmp_path / "script.py").write_text("import treepilot\n")
    for done in (
        python("-P", "-c", "import treepilot", cwd=tmp_path, path=tmp_path),
        python("script.py", cwd=tmp_path),
        python("-m", "treepilot", "--help", cwd=tmp_path),
    ):
        assert sentence in done.stderr


def test_one_that_is_imported_already_is_named_too(tmp_path):
    """The folder of the script is taken out of the path too late."""
    (tmp_path / "robots.py").write_text("")
    code = "import sys, robots; del sys.path[0]; import treepilot"
    done = python("-c", code, cwd=tmp_path)
    assert f"{tmp_path / 'robots.py'} hides treepilot's package `robots`" in done.stderr
