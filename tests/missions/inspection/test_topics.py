"""`treepilot topic` on a recorded run, and on a live one in another process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from itertools import pairwise

import pytest
import yaml
from typer.testing import CliRunner

import treepilot
from missions.cli.app import app
from tests.missions.execution.test_connect import engine
from tests.missions.execution.test_engine import ROOT

MISSION = """
mission: short
robot: scout
world: small_room
run: {wait: 2 s}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of two seconds with its sensors."""
    home = tmp_path_factory.mktemp("topics")
    (home / "short.yaml").write_text(MISSION)
    treepilot.run(home / "short.yaml", seed=1, out=home / "run", record=["sensors"])
    return str(home / "run")


def topic(*words):
    done = CliRunner().invoke(app, ["topic", *words])
    if isinstance(done.exception, treepilot.TreepilotError):
        return 2, str(done.exception)
    return done.exit_code, done.output


def test_the_list_has_fields_layers_events_and_sensors(folder):
    code, text = topic("list", folder)
    assert code == 0
    types = dict(line.split(None, 1) for line in text.splitlines())
    assert types["pose"] == "Pose2D"
    assert types["layers.map"] == "OccupancyGrid"
    assert types["sensors.lidar"] == "Scan"
    assert types["events"] == "Event"
    assert types["scan"] == "Scan"  # the first snapshot has none
    assert types["image"].split() == ["Image", "no", "message"]
    assert "time" not in types  # no topic


def test_every_listed_topic_can_be_printed_and_timed(folder):
    for line in topic("list", folder)[1].splitlines():
        name = line.split()[0]
        if line.endswith("no message"):
            assert topic("echo", folder, name) == (0, "")
            continue
        code, text = topic("echo", folder, name, "-n", "1")
        assert (code, name in text) == (0, True), (name, text)
        code, text = topic("echo", folder, name, "-n", "1", "--json")
        assert json.loads(text)["topic"] == name
        assert topic("hz", folder, name)[0] == 0


def test_echo_prints_documents_of_yaml_and_parts(folder):
    _, text = topic("echo", folder, "pose", "-n", "2")
    first, second = list(yaml.safe_load_all(text))[:2]
    assert first["pose"].keys() == {"x", "y", "heading"}
    assert second["time"] > first["time"]
    _, text = topic("echo", folder, "parameters.controller.cruise_speed", "-n", "1")
    assert yaml.safe_load(text.removesuffix("---\n"))["parameters.controller.cruise_speed"] > 0.0
    _, text = topic("echo", folder, "scan", "-n", "1")
    assert "ranges: 360 values, " in text
    _, text = topic("echo", folder, "scan.ranges", "-n", "1", "--full")
    assert len(next(yaml.safe_load_all(text))["scan.ranges"]) == 360  # one per degree


def test_every_is_of_the_robots_clock(folder):
    _, text = topic("echo", folder, "pose.x", "--every", "0.5", "--json")
    times = [json.loads(line)["time"] for line in text.splitlines()]
    assert 4 <= len(times) <= 5  # 2 s
    assert all(b - a >= 0.5 for a, b in pairwise(times))


def test_the_rates_of_sensors_are_those_of_the_robot(folder):
    assert topic("hz", folder, "sensors.lidar")[1].startswith("10.00 Hz, period 0.100 to 0.100 s")
    assert topic("hz", folder, "sensors.imu")[1].startswith("20.00 Hz")
    assert topic("hz", folder, "layers.map")[1] == "1 message, no rate\n"
    assert "rate of the recording" in topic("hz", folder, "scan")[1]
    assert "rate of the recording" not in topic("hz", folder, "sensors.lidar")[1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("echo", "posse"), "did you mean 'pose'"),
        (("echo", "pose.z"), "there is no 'z' in the topic 'pose.z'"),
        (("echo", "pose.x.y"), "a float has no parts"),
        (("echo", "counters.replan"), "did you mean 'replans'"),
        (("echo", "layers.mapp"), "did you mean 'map'"),
        (("hz", "sensors.lidr"), "did you mean 'lidar'"),
        (("hz", "a", "b"), "expected [RUN] TOPIC"),
    ],
)
def test_what_is_no_topic_is_refused(folder, words, message):
    command, *rest = words
    code, text = topic(command, folder, *rest)
    assert (code, message in text) == (2, True), text


def test_a_run_that_is_not_there_is_refused():
    code, text = topic("echo", "no-such-run", "pose")
    assert (code, "there is no run 'no-such-run'" in text) == (2, True)


@pytest.mark.slow
def test_a_live_run_until_control_c(tmp_path):
    with engine(tmp_path / "run") as (_, name):
        assert "pose" in topic("list", name)[1]
        code, text = topic("echo", name, "pose", "-n", "3", "--json")
        times = [json.loads(line)["time"] for line in text.splitlines()]
        assert code == 0
        assert times == sorted({*times})
        rate = topic("hz", name, "scan", "-n", "1")[1]
        assert 1.0 < float(rate.split()[0]) <= 10.01  # the lidar's rate; a viewer may miss some
        assert topic("echo", name, "sensors.lidar")[0] == 2
        echo = subprocess.Popen(
            [sys.executable, "-m", "missions.cli.app", "topic", "echo", name, "pose.x"],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        assert echo.stdout is not None
        assert echo.stdout.readline().startswith("time:")
        echo.send_signal(signal.SIGINT)
        assert echo.wait(timeout=20.0) == 130
        assert "Traceback" not in echo.communicate()[1]
