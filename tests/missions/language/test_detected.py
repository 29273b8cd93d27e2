"""The value `detected` and the function `contains` in conditions."""

import pytest

from behaviours.testing import ScriptedRobot
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.testing.scripted_values import set_value
from missions.testing.session import run_files

HEAD = "mission: watch\nrobot: scout\nworld: small_room\n"
WAIT = "run: {wait_until: \"contains(detected, 'chair')\", timeout: 3 s}\n"


class Context:
    def __init__(self, robot):
        self.robot = robot


def test_it_lists_the_labels_of_the_newest_picture():
    robot, read = ScriptedRobot(), ROBOT_VALUES["detected"].read
    assert read(Context(robot)) == []  # no result yet
    set_value(robot, "detected", ["chair", "chair", "person"])
    assert read(Context(robot)) == ["chair", "chair", "person"]


@pytest.mark.parametrize(("seen", "status"), [("[door, chair]", "success"), ("[door]", "failure")])
def test_a_mission_waits_for_a_label(tmp_path, seen, status):
    case = f"  - {{name: it, at: {{1 s: {{detected: {seen}}}}}, expect: {{status: {status}}}}}\n"
    file = tmp_path / "watch.yaml"
    file.write_text(f"{HEAD}{WAIT}tests:\n{case}", "utf-8")
    assert run_files([str(file)]).exit_code == 0
