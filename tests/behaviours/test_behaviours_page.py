"""docs/behaviours.md: its Python blocks run as they stand, and its table is complete."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from py_trees.common import Status

from behaviours.catalogue import build, find_behaviours
from behaviours.testing import ScriptedRobot, tick
from stack.types import Scan

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "behaviours.md").read_text()
BLOCKS = re.findall(r"^```python(?: file=(\S+))?\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
SCRIPTS = [text for file, text in BLOCKS if not file]


@pytest.fixture
def folder(tmp_path):
    """The page's plugin files, where it says they are."""
    (tmp_path / "my_behaviours").mkdir()
    for file, text in BLOCKS:
        if file:
            (tmp_path / file).write_text(text)
    return tmp_path


def test_there_are_blocks_to_test():
    assert len(SCRIPTS) == 3
    assert len(BLOCKS) == 6


@pytest.mark.parametrize("text", SCRIPTS)
def test_scripts_run(text):
    exec(compile(text, "docs/behaviours.md", "exec"), {"__name__": "page"})


def test_the_pages_own_test_passes(folder):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "my_behaviours"],
        cwd=folder, capture_output=True, text=True, check=False,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert "3 passed" in done.stdout, done.stdout


def test_the_behaviour_that_measures(folder):
    catalogue = find_behaviours(["./my_behaviours"], folder)
    assert catalogue.problems == ()
    measure = build(catalogue.get("measure_ahead"), "ahead", {"at_least": "50 cm"})
    robot = ScriptedRobot()
    assert tick(measure, robot, 0.5) is Status.RUNNING
    robot.scan = Scan(0.0, np.full(3, 0.31, dtype=np.float32), -1.5, 1.5, 0.1, 12.0)
    assert tick(measure, robot) is Status.FAILURE
    assert (measure.failure.code, measure.failure.sentence) == ("TOO_NEAR", "only 0.31 m ahead")


def test_the_table_lists_every_behaviour_in_its_own_words():
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", PAGE.partition("## What there is")[2], re.M)
    catalogue = find_behaviours()
    assert rows == [(name, catalogue.get(name).summary) for name in catalogue.names()]
