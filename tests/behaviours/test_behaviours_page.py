"""docs/behaviours.md: its measuring behaviour measures, and its table is complete."""

import re
import typing
from ast import literal_eval
from pathlib import Path

import numpy as np
import pytest
from py_trees.common import Status

import treepilot
from behaviours.catalogue import find_behaviours
from behaviours.kind import build
from behaviours.testing import ScriptedRobot, tick
from missions.inspection.check import check_files
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


def rows_of(heading):
    """Cells of the table below a heading, without its first two lines."""
    table = PAGE.partition(f"{heading}\n")[2].partition("\n## ")[0]
    lines = [line for line in table.splitlines() if line.startswith("|")][2:]
    return [re.split(r" (?<!\\)\| ", line.strip("| ")) for line in lines]


def test_the_attributes_of_the_class_are_listed_and_each_example_is_valid():
    hints = typing.get_type_hints(treepilot.Behaviour)
    known = {name for name, hint in hints.items() if typing.get_origin(hint) is typing.ClassVar}
    examples = [line for row in rows_of("### What the class says about itself")
                for line in re.findall(r"`(\w+ = [^`]+)`", row[0])]  # fmt: skip
    assert {line.partition(" = ")[0] for line in examples} == known
    for line in examples:
        name, _, value = line.partition(" = ")
        default = getattr(treepilot.Behaviour, name)
        assert isinstance(literal_eval(value), tuple if default is None else type(default)), line


PORTS = """
from __future__ import annotations
from dataclasses import dataclass
from treepilot import Behaviour, Expression, Pose2D, Status, parameter, port

@dataclass(frozen=True)
class Grip:
    force: float = parameter(1.0, "N", help="of the fingers")

class Mine(Behaviour):
    DECLARATION

    def update(self) -> Status:
        return Status.SUCCESS
"""
MISSION = """
mission: a
robot: scout
world: small_room
places: {shelf_a: [1, 1]}
plugins: [./mine.py]
run:
  mine: {PORT}
"""


@pytest.mark.parametrize("row", rows_of("## Ports"), ids=lambda row: row[0].split(":")[0][1:])
def test_each_port_of_the_table_accepts_the_value_beside_it(row, tmp_path):
    declaration = re.match(r"`([^`]+)`", row[0])[1].replace("\\|", "|").replace("…", "a sentence")
    (tmp_path / "mine.py").write_text(PORTS.replace("DECLARATION", declaration), "utf-8")
    for value in re.findall(r"`([^`]+)`", row[1]) or [""]:
        mission = tmp_path / "mine.yaml"
        mission.write_text(MISSION.replace("PORT", value))
        assert [line.text for line in check_files([str(mission)])] == []
