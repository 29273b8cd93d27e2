"""`treepilot new KIND NAME`: what is written works, is clean, and drives a robot."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import missions
from missions.cli.new import new_robot
from missions.execution.prepare import RunOptions, diagnose, prepare
from missions.inspection.component_scaffold import new_component
from missions.inspection.file_scaffold import new_mission
from robots.load import read_robot
from stack.errors import InputError

ROOT = Path(__file__).parents[3]
KINDS = ["planner", "controller", "estimator", "layer"]

MISSION = """
mission: own way
robot: scout
world: small_room
plugins: [./my_plugins]
navigation:
  planner: {use: beeline, spacing: 10 cm}
  controller: {use: nose_first, cruise_speed: 50 cm/s}
run:
  navigate_to_pose: {goal: [1.2, 2.8, 90 deg]}
  timeout: 40 s
"""


def run(*command, cwd):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MYPYPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=cwd, capture_output=True, text=True, check=False,
        env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_mission_of_an_arm_without_wheels_moves_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = new_mission("wave", Path(), "bench_top", "panda_table")
    assert diagnose(file, RunOptions()).findings == ()
    assert "posture: folded" in file.read_text()


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_passes_its_own_tests(kind, tmp_path):
    files = new_component(kind, "my_own", tmp_path / "my_plugins")
    assert [file.name for file in files] == ["my_own.py", "test_my_own.py"]
    said = run("pytest", "-q", "-p", "no:cacheprovider", "my_plugins", cwd=tmp_path)
    assert "passed" in said and "failed" not in said


@pytest.mark.parametrize("name", ["my_own", "n" * 40])
def test_what_is_written_is_clean(name, tmp_path):
    for kind in KINDS:
        files = [str(file) for file in new_component(kind, name, tmp_path / kind)]
        settings = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
        run("ruff", "check", *settings, *files, cwd=ROOT)
        run("ruff", "format", "--check", *settings, *files, cwd=ROOT)


@pytest.fixture
def folder(tmp_path):
    """A mission with a planner and a controller as they are written."""
    new_component("planner", "beeline", tmp_path / "my_plugins")
    new_component("controller", "nose_first", tmp_path / "my_plugins")
    (tmp_path / "own_way.yaml").write_text(MISSION)
    return tmp_path


def findings(folder, old, new):
    path = folder / "own_way.yaml"
    path.write_text(MISSION.replace(old, new))
    with pytest.raises(InputError) as caught:
        prepare(path, RunOptions())
    return [f"{item.code} {item.mark.line}:{item.mark.column} {item.sentence}"
            for item in caught.value.findings]  # fmt: skip


@pytest.mark.slow
def test_a_robot_drives_with_a_planner_and_a_controller_from_a_folder(folder):
    report = missions.run(folder / "own_way.yaml", seed=1)
    assert (report.status, report.reason) == ("success", "")
    assert report.collisions == 0


def test_the_plan_holds_the_components_of_the_folder(folder):
    choices = prepare(folder / "own_way.yaml", RunOptions()).choices
    assert choices["planner"].component.__name__ == "Beeline"
    assert choices["planner"].parameters.spacing == pytest.approx(0.1)
    assert choices["controller"].component.__name__ == "NoseFirst"


def test_a_layer_of_the_folder_stands_in_its_place(folder):
    new_component("layer", "quiet_corner", folder / "my_plugins")
    layers = "costmap: {layers: [static, {use: quiet_corner, radius: 2 m}]}"
    path = folder / "own_way.yaml"
    path.write_text(MISSION.replace("navigation:\n", f"navigation:\n  {layers}\n"))
    second = prepare(path, RunOptions()).choices["costmap"].parts[1]
    assert (second.name, second.component.__name__) == ("quiet_corner", "QuietCorner")
    [line] = findings(folder, "navigation:\n", f"navigation:\n  {layers.replace('2 m', '2 s')}\n")
    assert "layer 2: radius: '2 s' is in s" in line


def test_parameters_of_plugged_components_are_checked_where_they_stand(folder):
    [line] = findings(folder, "spacing: 10 cm", "spacing: 10 s")
    assert line.startswith("E111 7:36 spacing: '10 s' is in s")
    [line] = findings(folder, "cruise_speed", "cruse_speed")
    assert line.startswith("E111 8:46 cruse_speed: there is no parameter")


def test_a_component_that_no_plugin_brings_is_reported(folder):
    [line] = findings(folder, "beeline", "beelin")
    assert line.startswith("E111 7:18 there is no planner 'beelin'")


def test_a_plugin_that_takes_a_built_in_name_is_reported(folder):
    file = folder / "my_plugins" / "mine.py"
    file.write_text((folder / "my_plugins" / "beeline.py").read_text().replace("Beeline", "Astar"))
    found = findings(folder, "", "")
    assert found[0].startswith("E110 5:1")
    assert "mine.py: Astar: 'astar' is already a planner" in found[0]


def test_a_broken_plugin_does_not_take_the_others_down(folder):
    (folder / "my_plugins" / "broken.py").write_text("import nothing_of_that_name\n")
    [line] = findings(folder, "", "")
    assert line.startswith("E110") and "broken.py: line 1: cannot import" in line


def test_what_is_wrong_with_a_plugin_is_found_where_that_plugin_is_named(folder):
    (folder / "other").mkdir()
    (folder / "other" / "broken.py").write_text("import nothing_of_that_name\n")
    found = findings(folder, "[./my_plugins]", "[./my_plugins, ./nowhere, ./other]")
    assert [line.split()[:2] for line in found] == [["E110", "5:25"], ["E110", "5:36"]]


def test_a_component_by_module_and_class(folder):
    path = folder / "own_way.yaml"
    path.write_text(MISSION.replace("use: beeline, spacing: 10 cm",
                                    "use: 'stack.planning.astar:Astar'"))  # fmt: skip
    assert prepare(path, RunOptions()).choices["planner"].component.__name__ == "Astar"
    [line] = findings(folder, "use: beeline, spacing: 10 cm", "use: 'stack.errors:InputError'")
    assert "it does not inherit treepilot.Planner" in line


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("astar", "'astar' is already a planner"), ("StraightLine", "cannot name a planner")],
)
def test_names_that_will_not_do(name, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        new_component("planner", name, tmp_path)
    assert list(tmp_path.iterdir()) == []


CART = """<robot name="Cart"><link name="base"><inertial><mass value="3"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>WHEELS</robot>"""
WHEEL = """<link name="NAME_wheel"><inertial><mass value="0.2"/>
<inertia ixx="2e-4" iyy="2e-4" izz="2e-4"/></inertial><collision><geometry><sphere radius="0.05"/>
</geometry></collision></link><joint name="NAME" type="continuous"><parent link="base"/>
<child link="NAME_wheel"/><origin xyz="0 SIDE 0.05"/><axis xyz="0 1 0"/></joint>"""


def test_a_new_robot_is_clean_and_named_by_its_urdf(tmp_path, monkeypatch, capsys):
    wheels = WHEEL.replace("NAME", "left").replace("SIDE", "0.15")
    wheels += WHEEL.replace("NAME", "right").replace("SIDE", "-0.15")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "cart.urdf").write_text(CART.replace("WHEELS", wheels))
    monkeypatch.chdir(tmp_path)
    new_robot(Path("in/cart.urdf"), folder=Path("mine"))
    said = capsys.readouterr().out
    assert "wrote mine/robot.yaml: drive differential, mass 3.4 kg" in said
    assert "treepilot check ./mine/robot.yaml" in said
    robot = read_robot(tmp_path / "mine" / "robot.yaml")
    assert (robot.name, robot.warnings) == ("cart", ())
    with pytest.raises(InputError, match="delete it, or choose another folder: --in FOLDER"):
        new_robot(Path("in/cart.urdf"), "other_cart", Path("mine"))  # the file's name is the same
    with pytest.raises(InputError, match="'scout' is the name of a shipped robot"):
        new_robot(Path("in/cart.urdf"), "scout", Path("other"))
