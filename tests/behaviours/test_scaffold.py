import subprocess
import sys
from pathlib import Path

import pytest

from behaviours.catalogue import find_behaviours
from behaviours.scaffold import new_behaviour
from stack.errors import InputError

ROOT = Path(__file__).parents[2]


def run(*command, cwd=ROOT):
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=cwd, capture_output=True, text=True, check=False,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_template_works_and_its_test_passes(tmp_path):
    folder = tmp_path / "my_behaviours"
    files = new_behaviour("ring_bell", folder)
    assert [file.name for file in files] == ["ring_bell.py", "test_ring_bell.py"]
    catalogue = find_behaviours(["./my_behaviours"], tmp_path)
    assert catalogue.problems == ()
    assert catalogue.get("ring_bell").summary.startswith("Ring bell")
    assert "2 passed" in run("pytest", "-q", "-p", "no:cacheprovider", str(folder), cwd=tmp_path)


@pytest.mark.parametrize("name", ["ring_bell", "nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn"])
def test_the_template_is_clean(tmp_path, name):
    files = [str(file) for file in new_behaviour(name, tmp_path / "mine")]
    settings = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    run("ruff", "check", *settings, *files)
    run("ruff", "format", "--check", *settings, *files)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "test_ring_bell.py").write_text("mine")
    with pytest.raises(InputError, match=r"test_ring_bell\.py already exists"):
        new_behaviour("ring_bell", tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["test_ring_bell.py"]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("CloseGripper", "lower-case words joined by underscores"),
        ("close-gripper", "lower-case words joined by underscores"),
        ("close__gripper", "lower-case words joined by underscores"),
        ("../evil", "lower-case words joined by underscores"),
        ("", "lower-case words joined by underscores"),
        ("spin", "'spin' is taken: Turn in place by an angle"),
        ("retry", "word of the mission language"),
        ("while", "word of the mission language or of Python"),
        ("n" * 41, "41 characters, at most 40"),
        ("test_it", "is the name of a test"),
    ],
)
def test_invalid_names(tmp_path, name, sentence):
    with pytest.raises(InputError, match=sentence):
        new_behaviour(name, tmp_path, {"retry"})
    assert list(tmp_path.iterdir()) == []
