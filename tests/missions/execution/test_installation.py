"""What an installation lacks is known before anything moves, with the command that installs it."""

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from missions.execution.fit.installation import check_renderer
from missions.execution.prepare import RunOptions, diagnose
from missions.execution.resources import load_robot
from stack import optional_packages
from stack.errors import InputError
from stack.optional_packages import MISSING_DEVICE, MISSING_PACKAGE, Package
from stack.sim.sensors import gl_trial

ROOT = Path(__file__).parents[3]
OPTIONAL = [item for item in vars(optional_packages).values() if isinstance(item, Package)]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


PROVIDERS = {"pinocchio": "pin", "serial": "pyserial", "can": "python-can"}
"""Distributions whose names are not those of their modules."""


@pytest.fixture
def without(monkeypatch):
    """Hide packages."""
    gl_trial.opengl_problem.cache_clear()
    yield lambda *names: [monkeypatch.setitem(sys.modules, name, None) for name in names]
    gl_trial.opengl_problem.cache_clear()


@pytest.mark.parametrize("package", OPTIONAL, ids=lambda package: package.module)
def test_the_command_installs_the_package(package):
    """It names an extra, or a dependency as it is declared."""
    name, _, extra = package.requirement.rstrip("]").partition("[")
    if name != PROJECT["name"]:
        assert package.requirement in PROJECT["dependencies"]
        return
    provider = PROVIDERS.get(package.module, package.module)
    assert any(entry.startswith(provider) for entry in PROJECT["optional-dependencies"][extra])


@pytest.mark.parametrize("estimator", ["slam", "pose_graph"])
def test_a_mission_with_a_pose_graph_needs_gtsam(without, tmp_path, estimator):
    mission = tmp_path / "m.yaml"
    mission.write_text(
        "mission: m\nrobot: scout\nworld: small_room\n"
        f"localisation: {estimator}\nrun: {{wait: 1 s}}\n"
    )
    without("gtsam")
    found = [item for item in diagnose(mission).findings if item.code == MISSING_PACKAGE]
    assert [str(item).removeprefix(str(tmp_path)) for item in found] == [
        f"/m.yaml:4:15 error[E450] the estimator '{estimator}' needs the Python package gtsam, "
        "which is not installed; install it: pip install 'gtsam>=4.3,<5'"
    ]


@pytest.mark.parametrize(
    ("name", "begin"),
    [("a.bag", b"#ROSBAG V2.0\n"), ("a.db3", b"SQLite format 3\0")],
)
def test_a_mission_on_a_ros_bag_needs_rosbags(without, tmp_path, name, begin):
    (tmp_path / name).write_bytes(begin)
    mission = tmp_path / "m.yaml"
    mission.write_text(
        f"mission: m\nrobot: {{use: replayed, log: {name}}}\nmap: none\nrun: {{wait: 1 s}}\n"
    )
    without("rosbags")
    (found,) = diagnose(mission).findings
    assert found.code == MISSING_PACKAGE and found.hint.endswith("'treepilot[logs]'")


PROBLEMS = {
    "package": ("moderngl", "OpenGL needs the Python package moderngl, which is not installed"),
    "driver": ("", "OpenGL on EGL cannot be used: "),
}


@pytest.mark.parametrize(("hidden", "sentence"), PROBLEMS.values(), ids=PROBLEMS)
def test_cameras_that_must_be_drawn_by_opengl_need_it(without, monkeypatch, hidden, sentence):
    """The device is tried in a process of its own; this platform of EGL does not exist."""
    if hidden:
        without(hidden)
    else:
        monkeypatch.setenv("EGL_PLATFORM", "nowhere")
        monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json")
    office = ROOT / "missions" / "02_office_patrol.yaml"
    with pytest.raises(InputError, match=f"--renderer gl: {sentence}"):
        diagnose(office, RunOptions(renderer="gl"))
    assert diagnose(office, RunOptions(renderer="auto")).plan is not None


def test_the_finding_stands_at_the_camera_that_asks_for_opengl(without, tmp_path):
    without("moderngl")
    scout = load_robot("scout_depth", ROOT)
    file = tmp_path / "robot.yaml"
    file.write_text(
        "camera: {renderer: tiny}\ndepth_cameras:\n  depth:\n    renderer: gl\n", "utf-8"
    )
    depth = {name: replace(it, renderer="gl") for name, it in scout.depth_cameras.items()}
    with pytest.raises(InputError) as refused:
        check_renderer(replace(scout, depth_cameras=depth, source=file), "")
    (found,) = refused.value.findings
    assert (found.mark.line, found.mark.column) == (4, 15)
    assert "renderer: auto" in found.hint


@pytest.fixture
def wheels(tmp_path):
    """A mission on own wheels, by the rest of its driver."""
    scout = ROOT / "robots" / "scout"
    text = (scout / "robot.yaml").read_text().replace("scout.urdf", str(scout / "scout.urdf"))

    def make(rest):
        body = f"body: {{use: wheels, driver: {{use: odrive_can, {rest}}}}}"
        (tmp_path / "robot.yaml").write_text(f"{text[: text.index('lidar:')]}\n{body}\n")
        mission = tmp_path / "m.yaml"
        mission.write_text(
            "mission: m\nrobot: ./robot.yaml\nworld: small_room\n"
            "localisation: dead_reckoning\nrun: {wait: 1 s}\n"
        )
        return [
            str(item).split("/robot.yaml:")[-1].partition(" ")[2]
            for item in diagnose(mission).findings
            if item.code in (MISSING_PACKAGE, MISSING_DEVICE)
        ]

    return make


def test_motor_drives_need_python_can(without, wheels):
    without("can")
    assert wheels("channel: can0") == [
        "error[E450] the driver 'odrive_can' needs the Python package can, which is not "
        "installed; install it: pip install 'treepilot[can]'"
    ]


def test_an_interface_that_is_not_there_is_a_warning(wheels, tmp_path, monkeypatch):
    monkeypatch.setattr("robots.motors.can_bus.NETWORK", tmp_path)
    setup = "set it up: sudo ip link set can7 up type can bitrate 500000 restart-ms 100"
    assert wheels("channel: can7") == [f"warning[W450] there is no CAN interface can7; {setup}"]
    (tmp_path / "can7").mkdir()
    (tmp_path / "can7" / "operstate").write_text("down\n")
    assert wheels("channel: can7") == [f"warning[W450] the CAN interface can7 is down; {setup}"]
    (tmp_path / "can7" / "operstate").write_text("up\n")
    assert wheels("channel: can7") == []
    found = wheels("interface: slcan, channel: /dev/ttyACM77")
    assert found == ["warning[W450] there is no device /dev/ttyACM77; plug the CAN adapter in"]
