"""What `treepilot list` and `describe` say with the plugins of a mission."""

import re
import shutil
from pathlib import Path

import pytest

from missions.execution.component_choices import LISTS, SETTINGS, chosen
from missions.execution.prepare import diagnose
from missions.execution.resources import MISSIONS, find_mission
from missions.inspection.component_scaffold import new_component
from missions.inspection.listing import COMPONENTS, description_of, installed, rows_of
from stack.components import available, component
from stack.costmap.choosing import read_layers
from stack.costmap.parameters import CostmapParameters
from stack.documents import value_of
from stack.errors import InputError
from stack.parameters import declarations


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
    assert "control_rate" in text and "default 20 Hz" in text and ">= 10 and <= 200" in text
    assert "pose_history" not in text and "parameters for experts: 1, shown by --expert" in text
    whole = description_of("loop", installed(), expert=True)
    assert "pose_history" in whole and "--expert" not in whole
    with pytest.raises(InputError, match="did you mean 'obstacle_memory'"):
        description_of("obstacle_memor", installed())


def test_everything_with_a_name_is_described(mission):
    text = description_of("depth", installed())
    layer, settings = text.split("\n\nsettings ")
    assert layer.startswith("costmap layer depth: Obstacles from depth cameras")
    assert settings.startswith("depth: Use of the depth cameras") and "obstacles " in settings
    Path(mission).with_name("mine").joinpath("jackal.py").write_text(
        "from treepilot import Behaviour, Status\n\n\n"
        "class Jackal(Behaviour):\n"
        '    """Howl."""\n\n'
        "    def update(self) -> Status:\n        return Status.SUCCESS\n"
    )
    both = description_of("jackal", installed(mission))
    assert both.startswith("behaviour jackal: Howl.") and "\n\nrobot jackal" in both


@pytest.mark.parametrize("name", ["controller", "controllers"])
def test_for_a_kind_of_component_its_components_are_listed(name):
    lines = description_of(name, installed()).splitlines()
    assert lines[0] == "controllers:"
    assert [line.split()[0] for line in lines[1:-1]] == [
        "pure_pursuit",
        "mppi",
        "dwb",
        "graceful",
        "onnx_policy",
    ]
    assert lines[-1] == "parameters of one: treepilot describe NAME"


def test_one_parameter_is_described_with_where_it_is_written():
    assert description_of("safety.tight_speed", installed()).splitlines() == [
        "safety.tight_speed: highest speed of any point of the robot past an obstacle "
        "tight_padding away; 0: padding always holds",
        "  type     number in m/s",
        "  default  0.15 m/s",
        "  range    >= 0",
        "  at most  padding_speed, unless that is 0",
        "  write    navigation: {safety: {tight_speed: 0.15 m/s}}",
        "  one run  treepilot run MISSION --parameter safety.tight_speed=0.15",
    ]
    assert "  at least tight_speed, or 0" in description_of("safety.padding_speed", installed())


def test_a_parameter_of_several_components_is_described_for_each():
    one = description_of("controller.cruise_speed", installed())
    assert "  of       pure_pursuit, mppi, dwb, graceful\n" in one
    assert "  at most  `linear_speed` of the robot's limits\n" in one
    assert "  write    navigation: {controller: {cruise_speed: 0.8 m/s}}\n" in one
    two = description_of("controller.reverse_speed", installed()).split("\n\n")
    assert ["default  0.2 m/s" in text for text in two] == [True, False]
    assert "{controller: {use: dwb, reverse_speed: 0.1 m/s}}" in two[1]
    assert two[1] == description_of("dwb.reverse_speed", installed())


def described():
    """Every parameter of a part or component, by the name that describes it."""
    for settings, parameters in SETTINGS.items():
        yield from (f"{settings}.{name}" for name in declarations(parameters))
    for kind in COMPONENTS.values():
        for name, where in available(kind).items():
            fields = declarations(component(kind, where).Parameters)
            yield from (f"{name}.{field}" for field in fields)


def test_what_a_description_says_to_write_is_accepted():
    known, names = installed(), list(described())
    assert len(names) > 200
    for name in names[::4]:
        line = re.search(r"^  write    (.+)$", description_of(name, known), re.MULTILINE)[1]
        if "…" in line:
            continue  # no default that a file could state
        written = value_of(f"{{{line}}}")
        ((kind, wanted),) = written.get("navigation", written).items()
        use = wanted.pop("use", None)
        assert chosen(kind, use, wanted).parameters == chosen(kind, use, {}).parameters, name


@pytest.mark.parametrize(
    ("name", "layers"),
    [
        ("social.cost", ["static", "obstacle", "social"]),
        ("obstacle.decay", ["static", "obstacle"]),
        ("keepout.zones", ["static", "obstacle", "keepout"]),
    ],
)
def test_the_layers_that_a_description_says_to_write_include_the_usual_ones(name, layers):
    line = re.search(r"^  write    (.+)$", description_of(name, installed()), re.MULTILINE)[1]
    listed = value_of(f"{{{line.replace('…', '[]')}}}")["navigation"]["costmap"]["layers"]
    assert [layer.use for layer in read_layers(listed, CostmapParameters())] == layers


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("safety.paddin_speed", "safety has no parameter 'paddin_speed'; did you mean 'padding_sp"),
        ("safty.padding", "'safty' has no parameters; did you mean 'safety'"),
        ("safety.zone", "did you mean 'zones'"),
        ("padding_speed", "is a parameter; use `treepilot describe safety.padding_speed`"),
    ],
)
def test_an_unknown_parameter_names_the_nearest(name, error):
    with pytest.raises(InputError, match=re.escape(error)):
        description_of(name, installed())


@pytest.mark.parametrize("settings", sorted(LISTS))
def test_the_lists_of_a_part_are_mentioned_with_an_example_that_works(settings, tmp_path):
    listed = LISTS[settings]
    assert f"{listed.key}: {listed.help}\n  {listed.example}" in description_of(
        settings, installed()
    )
    assert listed.example in description_of(f"{settings}.{listed.key}", installed())
    file = tmp_path / "m.yaml"
    file.write_text(
        f"mission: m\nrobot: scout\nworld: small_room\n{listed.example}\nrun: {{say: a}}\n"
    )
    assert diagnose(file).findings == ()


def test_the_keys_of_a_safety_zone_are_described():
    text = description_of("safety.zones", installed())
    assert "stop | slow_down | limit | approach" in text and "time to contact" in text


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
