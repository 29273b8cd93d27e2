import subprocess
import sys
from pathlib import Path

import pytest
from py_trees.behaviour import Behaviour

from behaviours.base import RobotBehaviour
from behaviours.catalogue import Problem, find_behaviours
from behaviours.kind import build, name_of
from behaviours.navigation.navigate_to_pose import NavigateToPose
from stack.errors import ParameterError
from stack.parameters import REQUIRED
from stack.types import Pose2D

ROOT = Path(__file__).parents[2]

GOOD = '''
from py_trees.common import Status
from behaviours.base import RobotBehaviour, port

class {name}(RobotBehaviour):
    """Blow the horn."""

    seconds: float = port("how long", unit="s", default=1.0)

    def update(self) -> Status:
        return Status.SUCCESS
'''


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "honk.py").write_text(GOOD.format(name="Honk"))
    return tmp_path / "mine"


def found_in(folder):
    return find_behaviours([f"./{folder.name}"], folder.parent, reserved={"repeat"})


def test_finds_the_built_in_ones_under_the_names_of_their_files():
    catalogue = find_behaviours()
    assert catalogue.problems == ()
    for name in catalogue.names():
        source = Path(catalogue.get(name).source)
        assert source.name == f"{name}.py"
        assert source.parents[1] == ROOT / "behaviours"
    assert {"navigate_to_pose", "wait", "set", "check", "take_photo"} <= set(catalogue.names())


def test_each_built_in_one_is_documented():
    catalogue = find_behaviours()
    for name in catalogue.names():
        kind = catalogue.get(name)
        assert kind.summary
        for declared in (*kind.ports.values(), *kind.outputs.values()):
            assert declared.help, f"{name}.{declared.name}"


@pytest.mark.parametrize(
    ("cls", "name"),
    [("NavigateToPose", "navigate_to_pose"), ("Wait", "wait"), ("HTTPGet", "http_get")],
)
def test_names(cls, name):
    assert name_of(type(cls, (), {})) == name


def test_describes_ports_and_outputs():
    kind = find_behaviours().get("navigate_to_pose")
    assert kind.cls is NavigateToPose
    assert kind.claims == ("base",)
    assert list(kind.ports) == ["goal", "tolerance", "partial", "accept", "accept_after"]
    assert kind.ports["goal"].default is REQUIRED
    assert list(kind.outputs) == ["remaining", "path_length", "time_taken"]


def test_builds_from_values_as_written():
    kind = find_behaviours().get("navigate_to_pose")
    drive = build(kind, "to the dock", {"goal": [4.0, 1.5, "90 deg"], "tolerance": "20 cm"})
    assert drive.name == "to the dock"
    assert drive.goal.x == 4.0
    assert drive.goal.heading == pytest.approx(1.5707963)
    assert drive.tolerance == pytest.approx(0.2)


def test_none_marks_a_port_that_is_bound_later():
    kind = find_behaviours().get("navigate_to_pose")
    drive = build(kind, "there", {"goal": None})
    drive.bind_input("goal", lambda: Pose2D(1.0, 2.0))
    assert drive.goal == Pose2D(1.0, 2.0)


@pytest.mark.parametrize(
    ("ports", "sentence", "hint"),
    [
        ({"gaol": [0, 0]}, "no port 'gaol'", "did you mean 'goal'?"),
        ({}, "needs this port: goal pose, map frame", ""),
        ({"goal": [0, 0], "tolerance": "3 s"}, "'3 s' is in s, expected a length", "allowed units"),
        ({"goal": [0, 0], "tolerance": 0}, "0 m must be above 0 m", ""),
    ],
)
def test_says_what_is_wrong_with_the_ports(ports, sentence, hint):
    with pytest.raises(ParameterError) as raised:
        build(find_behaviours().get("navigate_to_pose"), "step", ports)
    assert sentence in raised.value.sentence
    assert hint in raised.value.hint


def test_unknown_names_come_with_the_nearest():
    catalogue = find_behaviours()
    assert catalogue.get("navigate_to_pos") is None
    assert "did you mean 'navigate_to_pose'?" in catalogue.why_not("navigate_to_pos")
    assert catalogue.why_not("wait") == ""


def test_a_plugin_folder_relative_to_the_mission(folder):
    before = list(sys.path)
    catalogue = found_in(folder)
    assert catalogue.problems == ()
    kind = catalogue.get("honk")
    assert (kind.summary, kind.source) == ("Blow the horn.", str(folder / "honk.py"))
    assert kind.ports["seconds"].default == 1.0
    assert sys.path == before
    assert "honk" not in sys.modules


def test_a_plugin_that_changes_the_working_directory_changes_it_for_nobody_else(folder):
    (folder / "honk.py").write_text("import os\nos.chdir('/')\n" + GOOD.format(name="Honk"))
    before = Path.cwd()
    assert found_in(folder).get("honk") is not None
    assert Path.cwd() == before


def test_a_single_plugin_file(folder):
    assert find_behaviours([str(folder / "honk.py")]).get("honk") is not None


def test_two_folders_may_hold_files_of_the_same_name(tmp_path):
    for part, cls in (("a", "Honk"), ("b", "Flash")):
        (tmp_path / part).mkdir()
        (tmp_path / part / "signal.py").write_text(GOOD.format(name=cls))
    catalogue = find_behaviours(["./a", "./b"], tmp_path)
    assert catalogue.problems == ()
    assert catalogue.get("honk").cls.__module__ != catalogue.get("flash").cls.__module__


def test_files_of_a_folder_may_import_each_other_and_tests_are_left_alone(folder):
    (folder / "_horn.py").write_text("LOUDNESS = 0.25\n")
    (folder / "test_honk.py").write_text("raise RuntimeError('not for missions')\n")
    source = "from ._horn import LOUDNESS\n" + GOOD.format(name="Whisper")
    (folder / "whisper.py").write_text(source.replace("default=1.0", "default=LOUDNESS"))
    catalogue = found_in(folder)
    assert catalogue.problems == ()
    assert catalogue.get("whisper").ports["seconds"].default == 0.25


def test_an_edited_plugin_is_read_again(folder):
    assert found_in(folder).get("honk") is not None
    (folder / "honk.py").write_text(GOOD.format(name="HonkTwice"))
    assert found_in(folder).get("honk_twice") is not None


HONK = "from __future__ import annotations\n" + GOOD.format(name="Honk")

BROKEN = {
    "syntax": ("def f(:\n    pass\n", "line 1: invalid syntax"),
    "import": ("\nimport no_such_library\n", "line 2: cannot import: No module named 'no_such"),
    "exception": ("\n\n1 / 0\n", "line 3: ZeroDivisionError: division by zero"),
    "exit": ("raise SystemExit(3)\n", "SystemExit: 3"),
    "a type no file can write": (
        HONK.replace("seconds: float", "seconds: dict"),
        "Honk: port seconds: a mission file cannot write a value of type dict",
    ),
    "an unknown type": (
        HONK.replace("seconds: float", "seconds: Foat"),
        "Honk: name 'Foat' is not defined",
    ),
    "no type": (
        HONK.replace("seconds: float", "seconds"),
        "Honk.seconds: a port needs a type annotation",
    ),
    "a default of another type": (
        HONK.replace("default=1.0", "default='loud'"),
        "Honk: port seconds: invalid default: expected a duration, got 'loud'",
    ),
    "a default of None": (
        HONK.replace("default=1.0", "default=None"),
        "its type must end in | None",
    ),
    "a reserved port": (HONK.replace("seconds:", "status:"), "may not be called 'status'"),
    "a name twice": (GOOD.format(name="Spin"), "Spin: 'spin' is already defined in"),
    "a word of the language": (
        GOOD.format(name="Repeat"),
        "'repeat' is a word of the mission language",
    ),
}


@pytest.mark.parametrize(("text", "sentence"), BROKEN.values(), ids=BROKEN)
def test_a_broken_plugin_is_reported_and_the_others_work(folder, text, sentence):
    (folder / "honk.py").write_text(GOOD.format(name="Flash"))
    (folder / "broken.py").write_text(text)
    catalogue = found_in(folder)
    [problem] = catalogue.problems
    assert problem.file == str(folder / "broken.py")
    assert sentence in problem.sentence
    assert "Traceback" not in problem.sentence
    assert {"flash", "wait"} <= set(catalogue.names())


def test_missing_plugins_are_reported(tmp_path):
    (tmp_path / "empty").mkdir()
    catalogue = find_behaviours(["./nowhere", "./empty", "no_such_module"], tmp_path)
    assert catalogue.problems == (
        Problem(str(tmp_path / "nowhere"), "there is no such plugin folder", 0),
        Problem(str(tmp_path / "empty"), "this folder contains no plugin file (*.py)", 1),
        Problem("no_such_module", "cannot import: No module named 'no_such_module'", 2),
    )


def test_a_dotted_module(tmp_path, monkeypatch):
    (tmp_path / "signals_of_mine.py").write_text(GOOD.format(name="Honk"))
    monkeypatch.syspath_prepend(tmp_path)
    assert find_behaviours(["signals_of_mine"]).get("honk") is not None


def test_a_package_with_one_broken_module(tmp_path, monkeypatch):
    package = tmp_path / "signals_package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "honk.py").write_text(GOOD.format(name="Honk"))
    (package / "bad.py").write_text("1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    catalogue = find_behaviours(["signals_package"])
    assert catalogue.get("honk") is not None
    assert catalogue.problems == (
        Problem("signals_package.bad", "line 1: ZeroDivisionError: division by zero", 0),
    )


def test_private_files_and_folders_of_a_package_are_not_searched(tmp_path, monkeypatch):
    package = tmp_path / "signals_with_helpers"
    (package / "_parts").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "honk.py").write_text(GOOD.format(name="Honk"))
    (package / "_private.py").write_text(GOOD.format(name="Whisper"))
    (package / "_parts" / "__init__.py").write_text(GOOD.format(name="Hum"))
    (package / "_parts" / "click.py").write_text(GOOD.format(name="Click"))
    monkeypatch.syspath_prepend(tmp_path)
    found = set(find_behaviours(["signals_with_helpers"]).names())
    assert found - set(find_behaviours().names()) == {"honk"}


def test_a_plain_py_trees_leaf_by_its_dotted_name():
    catalogue = find_behaviours()
    kind = catalogue.get("py_trees.behaviours.TickCounter")
    assert kind.ports["duration"].type is int
    assert kind.ports["completion_status"].one_of == ("success", "failure", "running", "invalid")
    assert not kind.bindable
    counter = build(kind, "three ticks", {"duration": 2, "completion_status": "success"})
    assert isinstance(counter, Behaviour) and not isinstance(counter, RobotBehaviour)
    counter.tick_once()
    assert counter.name == "three ticks"
    with pytest.raises(ParameterError, match="expected a whole number, got '2'"):
        build(kind, "", {"duration": "2", "completion_status": "success"})


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("py_trees.composites.Sequence", "only leaves"),
        ("py_trees.decorators.Inverter", "only leaves"),
        ("py_trees.timers.Timer", "wall time; use `wait`"),
        ("py_trees.behaviours.Sucess", "has no 'Sucess'"),
        ("collections.OrderedDict", "`plugins: [collections]`"),
        ("no_such_module.Thing", "`plugins: [no_such_module]`"),
    ],
)
def test_invalid_dotted_names(name, sentence):
    catalogue = find_behaviours()
    assert catalogue.get(name) is None
    assert sentence in catalogue.why_not(name)


def test_checking_missions_loads_nothing_heavy():
    program = (
        "import sys; from behaviours.catalogue import find_behaviours\n"
        "assert 'navigate_to_pose' in find_behaviours().names(); print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.split())
    assert "behaviours.navigation.navigate_to_pose" in loaded
    assert not {"numba", "cv2", "pybullet", "rerun", "textual", "yaml"} & loaded
