"""The command line as a person uses it: exit codes, streams, and words."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import pytest
from typer.main import get_command

from missions.cli.app import app, main

SHIPPED = Path(__file__).parents[3] / "missions"


def process(*words: str, columns: int = 100) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own, as a shell starts it."""
    environment = {**os.environ, "PYTHONPATH": str(SHIPPED.parent), "COLUMNS": str(columns)}
    return subprocess.run(
        [sys.executable, "-m", "missions.cli.app", *words], capture_output=True, text=True,
        check=False, env=environment,
    )  # fmt: skip


def treepilot(*words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The entry point of the command in this process, with its exit code and both streams."""
    out, errors = StringIO(), StringIO()
    with (
        chdir(cwd or Path.cwd()),
        patch.dict(os.environ, {"COLUMNS": "100"}),
        patch.object(sys, "argv", ["treepilot", *words]),
        redirect_stdout(out),
        redirect_stderr(errors),
    ):
        try:
            main()
            code = 0
        except SystemExit as ended:
            code = ended.code or 0
    return subprocess.CompletedProcess(words, code, out.getvalue(), errors.getvalue())


def test_a_process_ends_with_the_exit_code_and_its_words_on_stderr(tmp_path):
    done = process("run", str(tmp_path / "no_such_mission.yaml"))
    assert (done.returncode, done.stdout) == (2, "")
    assert "no such mission file" in done.stderr


def test_typer_need_not_compile_the_annotations_of_commands_at_every_start():
    files = {file: file.read_text("utf-8") for file in (SHIPPED / "cli").rglob("*.py")}
    postponed = "from __future__ import annotations"
    assert files
    assert [file for file, text in files.items() if postponed in text.splitlines()] == []


def test_help_has_one_whole_line_for_each_command():
    done = process("--help", columns=80)
    assert done.returncode == 0
    listed = done.stdout.partition("Commands:\n")[2].splitlines()
    names = [line.split()[0] for line in listed]
    assert sorted(names) == sorted(get_command(app).commands)
    for line in listed:
        assert len(line) <= 80 and line.endswith(".") and not line.endswith("..."), line


def commands_of(group, name="treepilot"):
    for word, command in group.commands.items():
        yield f"{name} {word}", command
        if hasattr(command, "commands"):
            yield from commands_of(command, f"{name} {word}")


def test_every_command_and_every_option_has_a_help_line():
    commands = dict(commands_of(get_command(app)))
    assert len(commands) > 50
    assert [name for name, command in commands.items() if not command.help] == []
    silent = [
        f"{name} {parameter.name}"
        for name, command in commands.items()
        for parameter in command.params
        if parameter.name != "help" and not getattr(parameter, "help", None)
    ]
    assert silent == []


def test_checking_imports_no_heavy_library():
    code = (
        "import sys; from missions.inspection.check import check_files;"
        "assert not check_files(['01_drive_to_a_point']);"
        "heavy = {'numba', 'pybullet', 'cv2', 'rerun', 'textual', 'pymavlink'};"
        "loaded = heavy & {*sys.modules}; assert not loaded, loaded"
    )
    environment = {**os.environ, "PYTHONPATH": str(SHIPPED.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("run", "no_such_mission.yaml"), "no such mission file"),
        (("run", "02_office_patrl.yaml"), "02_office_patrol"),
        (("run", "01_drive_to_a_point", "--set", "gaol=[1,1]"), "did you mean 'goal'"),
        (("run", "01_drive_to_a_point", "--set", "goal"), "NAME=VALUE"),
        (("run", "01_drive_to_a_point", "--speed", "0"), "--speed 0"),
        (("run", "01_drive_to_a_point", "--robot", "scuot"), "did you mean 'scout'"),
        (("run", "01_drive_to_a_point", "--world", "ofice"), "did you mean"),
        (("run", "01_drive_to_a_point", "--start", "1"), "x,y,heading"),
        (("run", "01_drive_to_a_point", "--sped", "1"), "No such option"),
        (("describe", "navigate_to_pos"), "did you mean 'navigate_to_pose'"),
        (("list", "things"), "things"),
        (("explain", "E1322"), "did you mean 'E132'"),
        (("check", "missing.yaml"), "missing.yaml:1:1 error[E001]"),
        (("watch", "no-such-run"), "watch needs a terminal"),
    ],
)
def test_wrong_usage_exits_with_2_and_says_what_to_do(words, expected, tmp_path):
    done = treepilot(*words, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert expected in done.stderr + done.stdout
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs").exists()


def test_a_folder_that_is_not_empty_is_refused(tmp_path):
    (tmp_path / "precious.txt").write_text("keep me")
    done = treepilot("run", "01_drive_to_a_point", "--out", str(tmp_path))
    assert done.returncode == 2
    assert "is not empty" in done.stderr
    assert [item.name for item in tmp_path.iterdir()] == ["precious.txt"]


@pytest.mark.parametrize(
    "kind", ["behaviours", "robots", "worlds", "missions", "planners", "layers"]
)
def test_lists_say_something_about_everything(kind):
    done = treepilot("list", kind)
    assert done.returncode == 0
    assert all(len(line.split()) >= 3 for line in done.stdout.splitlines())


def test_describe_shows_types_units_defaults_and_ranges():
    done = treepilot("describe", "wall_follow")
    assert done.returncode == 0
    assert "left | right" in done.stdout
    done = treepilot("describe", "pure_pursuit")
    assert "m/s" in done.stdout


def test_list_and_describe_know_the_plugins_of_a_mission(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "broken.py").write_text("import nothing_of_that_name\n")
    (tmp_path / "m.yaml").write_text("mission: a\nplugins: [./mine]\nrun: say\n")
    done = treepilot("list", "behaviours", "--mission", str(tmp_path / "m.yaml"))
    assert done.returncode == 0 and "navigate_to_pose" in done.stdout
    assert done.stderr.startswith(f"not available: {tmp_path / 'mine' / 'broken.py'}: line 1")
    shipped = ("--mission", "06_your_own_behaviour")
    assert "longest view" in treepilot("describe", "find_open_space", *shipped).stdout


def test_show_draws_the_tree_in_three_ways():
    assert "navigate_to_pose" in treepilot("show", "02_office_patrol").stdout
    assert treepilot("show", "02_office_patrol", "--dot").stdout.startswith("digraph")
    assert "flowchart" in treepilot("show", "02_office_patrol", "--mermaid").stdout


def test_new_says_what_it_wrote_and_how_to_use_it(tmp_path):
    done = treepilot("new", "planner", "beeline", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "wrote my_plugins/test_beeline.py" in done.stdout
    assert "    plugins: [./my_plugins]\n    navigation: {planner: beeline}\n" in done.stdout
    assert (tmp_path / "my_plugins" / "beeline.py").is_file()
    again = treepilot("new", "planner", "beeline", cwd=tmp_path)
    assert again.returncode == 2 and "already exists" in again.stderr
    done = treepilot("new", "behaviour", "ring_bell", "--in", "mine", cwd=tmp_path)
    assert "plugins: [./mine]" in done.stdout and (tmp_path / "mine" / "ring_bell.py").is_file()


@pytest.mark.parametrize("world", ["office", "small_room", "./flat.yaml"])
def test_new_missions_and_worlds_have_no_findings_and_their_tests_pass(world, tmp_path):
    if world.startswith("."):
        done = treepilot("new", "world", "flat", cwd=tmp_path)
        assert done.stdout.startswith("wrote flat.yaml\n") and done.returncode == 0
        assert treepilot("doctor", "./flat.yaml", cwd=tmp_path).stdout.splitlines()[-1] == (
            "clean: scout can use 0 passages and 3 places without difficulty"
        )
    done = treepilot("new", "mission", "patrol", "--world", world, cwd=tmp_path)
    assert (
        "wrote patrol.yaml" in done.stdout and "Run it:  treepilot run patrol.yaml" in done.stdout
    )
    checked = treepilot("check", "--strict", "patrol.yaml", cwd=tmp_path)
    assert checked.stderr == "1 file checked, no errors\n"
    assert "1 passed" in treepilot("test", "patrol.yaml", cwd=tmp_path).stdout
    again = treepilot("new", "mission", "patrol", cwd=tmp_path)
    assert again.returncode == 2 and "patrol.yaml already exists" in again.stderr


def test_new_missions_need_a_free_name_and_a_world(tmp_path):
    for words, said in (
        (("mission", "02_office_patrol"), "is the name of a shipped mission"),
        (("mission", "Patrol.yaml"), "without .yaml"),
        (("mission", "a", "--world", "ofice"), "did you mean 'office'?"),
        (("behaviour", "switch"), "is a word of the mission language"),
    ):
        done = treepilot("new", *words, cwd=tmp_path)
        assert done.returncode == 2 and said in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_new_names_pytest_only_where_it_is_installed(tmp_path):
    with patch("missions.cli.new.find_spec", return_value=None):
        done = treepilot("new", "planner", "beeline", cwd=tmp_path)
    assert "install pytest (pip install pytest), then:  python -m pytest" in done.stdout


NEEDS_A_GOAL = """mission: a
robot: scout
world: office
arguments: {goal: {type: Pose}}
run: {navigate_to_pose: $goal}
tests: [{name: a, mock: {navigate_to_pose: {returns: success}}, expect: {status: success}}]
"""


@pytest.mark.parametrize("command", ["check", "show", "test", "parameters"])
def test_required_arguments_can_be_set_everywhere(command, tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(NEEDS_A_GOAL)
    without = treepilot(command, str(file))
    assert without.returncode == 2
    done = treepilot(command, str(file), "--set", "goal=[1, 5, 0]")
    assert done.returncode == 0, done.stderr


def test_check_counts_files_errors_and_warnings(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("mission: a\nrobot: scot\nworld: ofice\nrun: {sey: a}\n")
    assert treepilot("check", str(file)).stderr.endswith("\n1 file checked, 3 errors\n")
    unused = "mission: a\nrobot: scout\nworld: office\nplaces: {p: [1, 5]}\nrun: {say: a}\n"
    file.write_text(unused + "trees: {t: {do: {say: a}}}\n")
    done = treepilot("check", str(file), str(file))
    assert done.stderr.endswith("2 files checked, no errors, 2 warnings\n")


def test_parameters_changed_shows_what_a_file_or_option_sets():
    words = ("parameters", "01_drive_to_a_point", "--changed")
    assert treepilot(*words).stdout == ""
    done = treepilot(*words, "--parameter", "controller.cruise_speed=0.4")
    (line,) = done.stdout.splitlines()
    assert line.split()[:2] == ["controller.cruise_speed", "0.4"]


def test_parameters_are_filtered_by_kind_or_text():
    words = ("parameters", "01_drive_to_a_point")
    names = [line.split()[0] for line in treepilot(*words, "safety").stdout.splitlines()]
    assert "safety.padding" in names and all(name.startswith("safety.") for name in names)
    names = [line.split()[0] for line in treepilot(*words, "cruise").stdout.splitlines()]
    assert names == ["controller.cruise_speed"]
    done = treepilot(*words, "cruse_speed")
    assert done.returncode == 2 and "did you mean 'cruise_speed'?" in done.stderr
    done = treepilot(*words, "safety", "--changed")
    assert (done.returncode, done.stdout) == (0, "")
    assert "no file or option sets a parameter of 'safety'" in done.stderr


def test_the_help_of_list_names_every_kind():
    said = treepilot("list", "--help").stdout
    for kind in ("behaviours", "goal_checkers", "estimators", "odometry", "layers"):
        assert kind in said
        assert treepilot("list", kind).returncode == 0


def test_show_refuses_what_it_cannot_draw(tmp_path):
    for words, said in (
        (("a", "b"), "for a world: show world W"),
        (("world", "office"), "needs --png FILE"),
        (("02_office_patrol", "--png", "a.png"), "show world WORLD --png FILE"),
    ):
        done = treepilot("show", *words, cwd=tmp_path)
        assert done.returncode == 2 and said in done.stderr


def test_check_gives_findings_as_json_for_editors(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_text("mission: a\nrobot: scout\nworld: office\nrun: {wait: 2 m}\n")
    done = treepilot("check", "--json", str(file))
    assert done.returncode == 2
    (found,) = json.loads(done.stdout)
    assert (found["line"], found["column"], found["code"]) == (4, 13, "E132")
    assert found["severity"] == "error"


def test_explain_prints_cause_example_and_fix():
    done = treepilot("explain", "E201")
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()[2:]] == ["cause", "example", "fix"]


def test_test_runs_a_missions_cases_and_exits_with_1_when_one_fails(tmp_path):
    file = tmp_path / "m.yaml"
    text = "mission: a\nrobot: scout\nworld: office\nrun: {wait: 2 s}\ntests: [{name: one}%s]\n"
    file.write_text(text % "")
    assert treepilot("test", str(file)).returncode == 0
    file.write_text(text % ", {name: two, expect: {within: 1 s}}")
    done = treepilot("test", str(file))
    assert done.returncode == 1
    assert "1 failed, 1 passed" in done.stdout
    assert treepilot("test", str(file), "-k", "one", "--coverage").returncode == 0


def begin(tmp_path: Path, *options: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(SHIPPED.parent)}
    words = ["run", "02_office_patrol", "--headless", "--speed", "20", *options]
    return subprocess.Popen(
        [sys.executable, "-m", "missions.cli.app", *words, "--out", str(tmp_path / "run")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip


def wait_for_events(folder: Path, count: int, patience: float = 60.0) -> None:
    deadline = time.monotonic() + patience  # noqa: TID251
    events = folder / "events.jsonl"
    while time.monotonic() < deadline:  # noqa: TID251
        if events.exists() and events.read_bytes().count(b"\n") >= count:
            return
        time.sleep(0.05)  # noqa: TID251
    raise AssertionError(f"no {count} events within {patience} s")


@pytest.mark.slow
def test_ctrl_c_stops_the_robot_writes_the_report_and_exits_130(tmp_path):
    process = begin(tmp_path)
    wait_for_events(tmp_path / "run", 3)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert process.returncode == 130
    report = json.loads((tmp_path / "run" / "report.json").read_text())
    assert report["status"] == "interrupted"
