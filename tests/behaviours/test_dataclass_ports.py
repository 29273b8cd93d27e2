"""Ports whose type is a dataclass: written as a mapping, checked field by field."""

from textwrap import dedent

import pytest
from py_trees.common import Status

from behaviours.testing import ScriptedRobot
from missions.execution.prepare import RunOptions, prepare
from missions.trees.compiler import compile_mission
from stack.errors import InputError

PLUGIN = '''
from dataclasses import dataclass

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.parameters import parameter


@dataclass(frozen=True)
class Grip:
    """How to hold something."""

    force: float = parameter(5.0, "N", above=0.0, at_most=40.0, help="between the fingers")
    fingers: str = parameter("both", one_of=("both", "left", "right"), help="which move")


class Grasp(RobotBehaviour):
    """Take hold of something."""

    grip: Grip = port("how to hold it")
    others: list[Grip] = port("tried in turn when that fails", default=[])

    def update(self) -> Status:
        self.robot.say(f"{self.grip.force:g} N, {self.grip.fingers}, {len(self.others)} more")
        return Status.SUCCESS
'''
NODE = "grasp: {grip: {force: 10 N}, others: [{fingers: left}, {}]}"


@pytest.fixture
def read(tmp_path):
    (tmp_path / "grasp.py").write_text(PLUGIN)

    def read(node):
        text = f"""
            mission: m
            robot: scout
            world: small_room
            plugins: [./grasp.py]
            run: {{{node}}}
            """
        (tmp_path / "m.yaml").write_text(dedent(text))
        return prepare(tmp_path / "m.yaml", RunOptions()).mission

    return read


def test_a_mission_writes_it_as_a_mapping(read):
    tree = compile_mission(read(NODE))
    robot = ScriptedRobot()
    tree.setup(robot)
    tree.tick()
    assert tree.status is Status.SUCCESS
    assert robot.said == ["10 N, both, 2 more"]


@pytest.mark.parametrize(
    ("grip", "sentence"),
    [
        ("{force: 50 N}", "grip: force: 50 N must be at most 40 N"),
        ("{force: 5 m}", "grip: force: '5 m' is in m"),
        ("{forse: 5}", "grip: forse: there is no parameter 'forse' here; did you mean 'force'"),
        ("tight", "grip: expected a Grip {force, fingers}, got 'tight'"),
    ],
)
def test_each_field_is_checked(read, grip, sentence):
    with pytest.raises(InputError) as caught:
        read(f"grasp: {{grip: {grip}}}")
    [finding] = caught.value.findings
    assert finding.code == "E132"
    assert sentence in f"{finding.sentence}; {finding.hint}"
