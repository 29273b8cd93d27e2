"""What tests of plugins create by name, and what is said of names and files that will not do."""

from __future__ import annotations

import pytest
from py_trees.common import Status

from behaviours.motion.spin import Spin
from missions.inspection.component_scaffold import new_component
from missions.inspection.diagnosis import findings_of
from missions.inspection.listing import installed
from missions.testing.plugins import choose_component, describe_robot, make_behaviour
from stack.errors import InputError, ParameterError

BEEP = """
from treepilot import Behaviour, Status, output, port

class Beep(Behaviour):
    time: float = port("how long", unit="s")
    left: float = output("the rest", unit="s")

    def update(self) -> Status:
        self.left = self.time
        return Status.SUCCESS
"""
BEELINE = """
from dataclasses import dataclass
from treepilot import Planner, parameter

class Beeline(Planner):
    @dataclass(frozen=True)
    class Parameters:
        spacing: float = parameter(0.05, "m", above=0.0, help="between two poses")

    def plan(self, costs, start, goal, options=None):
        return self.parameters.spacing
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "beep.py").write_text(BEEP)
    (tmp_path / "beeline.py").write_text(BEELINE)
    return tmp_path


def test_a_behaviour_of_a_file_gets_values_as_a_mission_writes_them(folder):
    beep = make_behaviour("beep", {"time": "2 min"}, plugin=folder / "beep.py")
    beep.tick_once()
    assert (beep.name, beep.status, beep.left) == ("beep", Status.SUCCESS, 120.0)


def test_a_word_of_the_language_names_no_behaviour_wherever_plugins_are_read(folder):
    """`round_robin` in a mission is the node: a behaviour of that name would never run."""
    (folder / "beep.py").write_text(BEEP.replace("Beep", "RoundRobin"))
    mission = folder / "m.yaml"
    mission.write_text(
        "mission: m\nrobot: scout\nworld: office\nplugins: [./beep.py]\nrun: {say: a}\n"
    )
    word = "'round_robin' is a word of the mission language"
    assert [item.code for item in findings_of(mission) if word in item.sentence] == ["E110"]
    assert any(word in problem for problem in installed(str(mission)).problems)
    with pytest.raises(InputError, match=word):
        make_behaviour("round_robin", plugin=folder / "beep.py")
    with pytest.raises(InputError, match="is a word of the mission language"):
        new_component("planner", "round_robin", folder)


def test_shipped_behaviours_and_leaves_of_py_trees_need_no_plugin():
    assert isinstance(make_behaviour("spin", {"angle": "90 deg"}), Spin)
    ticks = {"duration": 5, "completion_status": "success"}
    assert make_behaviour("py_trees.behaviours.TickCounter", ticks).duration == 5


def test_a_component_of_a_folder_given_from_the_current_one(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    choice = choose_component("planner", "beeline", {"spacing": "10 cm"}, plugin=folder.name)
    assert choice.create(describe_robot("scout")).plan(None, None, None) == 0.1
    assert choose_component("planner", "astar").component.__name__ == "Astar"


def test_names_that_do_not_exist(folder):
    with pytest.raises(InputError, match="there is no behaviour 'bep'; did you mean 'beep'"):
        make_behaviour("bep", plugin=folder)
    with pytest.raises(InputError, match="there is no planner 'beline'; did you mean 'beeline'"):
        choose_component("planner", "beline", plugin=folder)
    with pytest.raises(
        InputError, match="there is no kind of component 'planer'; did you mean 'planner'"
    ):
        choose_component("planer", "beeline", plugin=folder)
    with pytest.raises(InputError, match="there is no robot 'scot'; did you mean 'scout'"):
        describe_robot("scot")


def test_values_that_do_not_fit(folder):
    with pytest.raises(ParameterError, match="beep needs this port: how long"):
        make_behaviour("beep", plugin=folder)
    with pytest.raises(ParameterError, match="'10 s' is in s"):
        choose_component("planner", "beeline", {"spacing": "10 s"}, plugin=folder)


def test_a_file_that_cannot_be_imported_is_reported_by_both(folder):
    (folder / "beep.py").write_text("import maths\n")
    said = r"beep\.py: line 1: cannot import: No module named 'maths'"
    with pytest.raises(InputError, match=said):
        make_behaviour("beep", plugin=folder)
    with pytest.raises(InputError, match=said):
        choose_component("planner", "beeline", plugin=folder)
    with pytest.raises(InputError, match="there is no such plugin folder"):
        make_behaviour("beep", plugin=folder / "nowhere")


def test_an_installed_package_that_is_broken_does_not_fail_the_tests_of_others(
    folder, tmp_path, monkeypatch
):
    metadata = tmp_path / "broken-0.1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 0.1\n")
    (metadata / "entry_points.txt").write_text("[treepilot.behaviours]\ngone = no_such_module\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert make_behaviour("beep", {"time": "1 s"}, plugin=folder / "beep.py").time == 1.0
