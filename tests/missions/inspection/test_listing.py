"""What `treepilot list` and `describe` say with the plugins of a mission."""

import shutil

import pytest

from missions.execution.resources import MISSIONS, find_mission
from missions.inspection.listing import description_of, installed, rows_of
from missions.inspection.scaffold import new_component
from stack.errors import InputError


@pytest.fixture
def mission(tmp_path):
    shutil.copytree(MISSIONS / "my_behaviours", tmp_path / "mine")
    file = tmp_path / "mission.yaml"
    file.write_text("mission: a\nplugins: [./mine]\nrun: anything\n")
    return str(file)


def test_a_missions_behaviours_are_listed_and_described(mission):
    known = installed(mission)
    assert known.problems == []
    assert "find_open_space" in dict(rows_of("behaviours", known))
    assert "shortest view worth driving to" in description_of("find_open_space", known)
    with pytest.raises(InputError, match="did you mean 'find_open_space'"):
        description_of("find_open_spac", known)
    with pytest.raises(InputError):
        description_of("find_open_space", installed())


def test_a_missions_components_are_listed_and_described(mission, tmp_path):
    new_component("planner", "beeline", tmp_path / "mine")
    known = installed(mission)
    assert "beeline" in dict(rows_of("planners", known))
    assert "spacing" in description_of("beeline", known)


def test_the_settings_of_fixed_parts_are_described():
    text = description_of("loop", installed())
    assert "control_rate" in text and "default 20 Hz" in text and ">= 5 and <= 200" in text
    with pytest.raises(InputError, match="did you mean 'obstacle_memory'"):
        description_of("obstacle_memor", installed())


def test_a_robot_s_camera_is_described_with_its_intrinsics():
    text = description_of("scout", installed())
    # f = 160 px / tan 35 deg
    assert "320 x 240 px, fx 228.50, fy 228.50, cx 160.00, cy 120.00 px, no distortion" in text
    assert "renderer = tiny  (" in text and "exposure = 0 s  (" in text


def test_a_broken_plugin_is_named_with_its_file_and_the_others_remain(mission, tmp_path):
    (tmp_path / "mine" / "broken.py").write_text("import nothing_of_that_name\n")
    known = installed(mission)
    (problem,) = known.problems
    assert problem.startswith(str(tmp_path / "mine" / "broken.py"))
    assert "No module named 'nothing_of_that_name'" in problem
    assert "find_open_space" in dict(rows_of("behaviours", known))


def test_a_mission_that_is_not_there_is_said(tmp_path):
    with pytest.raises(InputError, match="no such mission file"):
        installed(str(tmp_path / "nowhere.yaml"))


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("patol.yaml", "did you mean '{folder}/patrol.yaml'?"),
        ("02_ofice_patrol.yaml", "did you mean '02_office_patrol'?"),
        # `.yaml` makes any two names similar; only the rest counts
        ("map.yaml", "give the path of a mission file, or a name from `treepilot list missions`"),
        ("sub/patrol.yaml", "there is no folder '{folder}/sub'"),
    ],
)
def test_only_missions_with_similar_names_are_suggested(tmp_path, name, hint):
    (tmp_path / "patrol.yaml").write_text("")
    with pytest.raises(InputError) as caught:
        find_mission(tmp_path / name)
    (finding,) = caught.value.findings
    assert finding.hint == hint.format(folder=tmp_path)


def test_outputs_have_no_default():
    text = description_of("take_photo", installed())
    _, _, outputs = text.partition("outputs:\n")
    assert outputs == "  image  text  path of the picture, relative to the folder of the run"
