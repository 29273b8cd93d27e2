"""The operator's hold on a run: it is announced before it moves, and reached by its identity."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.client.telling import tell
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.execution.running import execute
from stack.errors import BodyError, InputError, TelemetryError
from stack.telemetry.event_log import read_events
from stack.telemetry.hub import Telemetry
from stack.telemetry.rendezvous import announce, live_runs, run_directory
from stack.telemetry.sinks import Sink
from tests.missions.execution.live_run import HEAD
from tests.missions.execution.test_engine import ROOT
from tests.stack.telemetry.conftest import runtime_directory  # noqa: F401 - a fixture
from tests.stack.telemetry.test_rendezvous import about

DRIVE = HEAD + "run: {navigate_to_pose: {goal: [5.0, 3.8, 0]}}\n"


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "drive.yaml"
    file.write_text(DRIVE)
    return file


@pytest.mark.slow
def test_a_robot_that_nobody_can_command_does_not_start(mission, tmp_path, runtime_directory):  # noqa: F811
    """The engine used to write a line into its log and to drive without a control channel."""
    run_directory().chmod(0o755)
    done = subprocess.run(
        [sys.executable, "-m", "missions.cli.app", "run", mission, "--headless",
         "--out", tmp_path / "run"],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 2
    assert "nobody could command or stop it: other users have access to" in done.stderr
    assert "chmod 700" in done.stderr
    assert not (tmp_path / "run").exists()


def test_a_socket_that_cannot_be_bound_ends_the_run(mission, tmp_path, runtime_directory):  # noqa: F811
    options = RunOptions(out=tmp_path / "run")
    (run_directory() / f"{os.getpid()}-0.sock").mkdir()  # in the way
    with pytest.raises(InputError, match="nobody could command or stop it: cannot open"):
        Run(prepare(mission, options), options)
    assert live_runs() == []


class Broken:
    """A sink that does not open."""

    def open(self, info):
        raise OSError("no")

    def close(self, report):
        self.closed = True


def test_a_required_sink_raises_its_error_and_is_closed():
    sink, telemetry = Broken(), Telemetry(about("r"))
    assert not telemetry.attach(Broken())
    with pytest.raises(OSError, match="no"):
        telemetry.attach(sink, required=True)
    assert sink.closed


def test_the_identity_is_the_one_that_the_options_give(mission, runtime_directory):  # noqa: F811
    identity = "0123456789abcdef" * 2
    options = RunOptions(identity=identity)
    run = Run(prepare(mission, options), options)
    try:
        (handle,) = live_runs()
        assert (handle.identity, handle.robot, handle.mission, handle.folder) == (
            identity, "scout", "drive", "",
        )  # fmt: skip
    finally:
        run.close()


def test_tell_refuses_to_choose_between_two_runs(tmp_path, runtime_directory):  # noqa: F811
    for part in "AB":
        announce(about("same"), tmp_path / part / "same")
    with pytest.raises(TelemetryError, match="2 runs match 'same'"):
        tell("same", "estop", {})
    shown = CliRunner().invoke(app, ["watch", "--list"]).output.splitlines()
    assert [line.split()[1] for line in shown] == ["NAME", "same", "same"]
    assert sorted(line[-6:] for line in shown[1:]) == ["A/same", "B/same"]
    assert all("no answer" in line for line in shown[1:])


def test_no_runs_are_listed_when_none_is_live(runtime_directory):  # noqa: F811
    assert CliRunner().invoke(app, ["watch", "--list"]).output == "no mission is running\n"


def test_an_interrupted_run_does_not_stop_in_slow_motion(mission):
    """At a thousandth of real time the robot used to be stopped for minutes before the report."""
    options = RunOptions(serve=False, speed=0.001)
    run = Run(prepare(mission, options), options)
    try:
        run.step()
        assert not run.is_ready()
        run.interrupt()
        assert run.is_ready()
    finally:
        run.close()


def test_a_robot_that_fails_while_nothing_is_stepped_ends_the_mission(mission):
    options = RunOptions(serve=False, speed=0.001)
    run = Run(prepare(mission, options), options)

    def lost():
        raise BodyError("the radio is silent")

    try:
        run.step()
        run.engine.runtime.serve = lost
        run.serve()
        assert run.engine.runtime.reason == "robot failed: the radio is silent"
        assert run.is_over
    finally:
        run.close()


class Radio(Sink):
    """A link to a ground station that fails after a number of snapshots."""

    link = "MAVLink"

    def __init__(self, snapshots):
        self.left = snapshots

    def wants_snapshot(self, time):
        self.left -= 1
        if not self.left:
            raise OSError(5, "Input/output error")
        return False


def test_a_link_lost_in_mid_run_is_in_the_log_and_in_the_report(tmp_path):
    file = tmp_path / "waits.yaml"
    file.write_text(HEAD + "run: {wait: 1 s}\n")
    options = RunOptions(out=tmp_path / "run", serve=False)
    report = execute(prepare(file, options), options, [Radio(5)])
    lost = {"link": "MAVLink", "reason": "Input/output error"}
    assert report.status == "success" and report.exit_code == 0
    (noted,) = report.links_lost
    assert noted == {"time": pytest.approx(0.25, abs=0.1), **lost}  # the fifth step of 0.05 s
    told = [
        event for event in read_events(tmp_path / "run/events.jsonl") if event.kind == "link_lost"
    ]
    assert [(event.level, event.fields) for event in told] == [("warning", lost)]
    assert "MAVLink lost at 0." in report.summary()


def test_a_control_server_that_fails_in_mid_run_does_not_end_the_mission(
    tmp_path,
    runtime_directory,  # noqa: F811
):
    file = tmp_path / "waits.yaml"
    file.write_text(HEAD + "run: {wait: 1 s}\n")
    options = RunOptions()
    run = Run(prepare(file, options), options)
    try:
        run.step()
        run._server._socket.close()  # as after an error of ZeroMQ
        while not run.is_over:
            run.step()
        report = run.finish()
    finally:
        run.close()
    assert report.status == "success"
    (lost,) = report.links_lost
    assert lost["link"] == "control by dashboards and `treepilot tell`"
    assert live_runs() == []
