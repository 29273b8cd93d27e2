"""docs/behaviours.md: its measuring behaviour measures, and its table is complete."""

import re
from pathlib import Path

import numpy as np
from py_trees.common import Status

from behaviours.catalogue import build, find_behaviours
from behaviours.testing import ScriptedRobot, tick
from stack.types import Scan

PAGE = (Path(__file__).parents[2] / "docs" / "behaviours.md").read_text("utf-8")


def test_the_behaviour_that_measures(tmp_path):
    file = "my_behaviours/measure_ahead.py"
    (tmp_path / "my_behaviours").mkdir()
    (tmp_path / file).write_text(PAGE.split(f"```python file={file}\n")[1].split("```")[0], "utf-8")
    catalogue = find_behaviours(["./my_behaviours"], tmp_path)
    measure = build(catalogue.get("measure_ahead"), "ahead", {"at_least": "50 cm"})
    robot = ScriptedRobot()
    assert tick(measure, robot, 0.5) is Status.RUNNING
    robot.scan = Scan(0.0, np.full(3, 0.31, dtype=np.float32), -1.5, 1.5, 0.1, 12.0)
    assert tick(measure, robot) is Status.FAILURE
    assert (measure.failure.code, measure.failure.sentence) == ("TOO_NEAR", "only 0.31 m ahead")


def test_the_table_lists_every_behaviour_in_its_own_words():
    table = PAGE.partition("## Shipped behaviours")[2]
    rows = re.findall(r"^\| `(\w+)` \| (.*) \| (.*?) ?\|$", table, re.M)
    catalogue = find_behaviours()
    kinds = [(name, catalogue.get(name)) for name in catalogue.names()]
    assert rows == [(name, kind.summary, ", ".join(kind.needs)) for name, kind in kinds]
