"""Orders from another process to a real engine, and what the log keeps of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.client.telling import status_lines, tell
from missions.execution.supervision.launch import LaunchOptions
from missions.run_options import RunOptions
from stack.errors import InputError, TelemetryError
from stack.telemetry.client import TelemetryClient
from stack.telemetry.event_log import read_events
from stack.telemetry.records import MissionState
from tests.missions.execution.live_run import HEAD
from tests.missions.execution.test_engine import ROOT, order, state_becomes, supervised, until

MISSION = """
run:
  sequence:
    - wait: {time: 1 s}
      name: settle
    - navigate_to_pose: {goal: [5.0, 3.8, 0]}
      name: out
    - wait: {time: 1 s}
      name: rest
"""


@pytest.fixture
def engine(tmp_path):
    """An engine that stops before `out`, watches its file, and runs at 8 times real time."""
    mission = tmp_path / "lively.yaml"
    mission.write_text(HEAD + MISSION)
    folder = tmp_path / f"live-{os.getpid()}"
    options = LaunchOptions(
        (str(mission),), RunOptions(watch=True, breakpoints=("out",), out=folder), speed="8"
    )
    with supervised(options) as (process, run):
        yield process, folder, mission, run


def stands(client):
    """Return once a snapshot says that the robot stands."""
    until(lambda: (s := client.poll()) and abs(s.measured.linear) + abs(s.measured.angular) < 0.02)


@pytest.mark.slow
def test_break_step_force_and_reload_over_telemetry(engine):
    process, folder, mission, run = engine
    client = TelemetryClient(run)
    paused = state_becomes(client, MissionState.PAUSED)
    assert paused.reason == "stopped at breakpoint: before 'out' (lively.yaml:9)"
    assert paused.debugging.breakpoints == paused.debugging.held == (2,)
    assert [row.status for row in paused.tree] == ["running", "success", "idle", "idle"]

    assert order(client, "step", ticks=3).reason == "3 ticks"
    stepped = state_becomes(client, MissionState.PAUSED)
    assert 0.3 <= stepped.time - paused.time < 1.5  # three ticks and coming to a stand
    assert stepped.tree[2].status == "running"
    stands(client)  # only then do orders find the robot held, as the log says below
    assert not order(client, "step", ticks=0).done

    assert tell(folder.name, "break", {"node": "lively.yaml:11"}) == (
        "breakpoint set before 'rest' (lively.yaml:11)"
    )
    with pytest.raises(InputError, match="did you mean 'rest'"):
        tell(folder.name, "break", {"node": "rst"})
    assert tell(folder.name, "force", {"node": "out", "status": "success"}).endswith("success")
    assert tell(folder.name, "continue", {}) == "the mission continues"
    at_rest = until(lambda: (s := client.poll()) and s.debugging.held == (3,) and s)
    assert at_rest.pose.x < 4.0  # it was forced to be done on the way
    assert any("● " in line and "rest  (starts" in line for line in status_lines(folder.name))
    shown = CliRunner().invoke(app, ["tell", folder.name, "nodes"])
    assert shown.output.startswith("paused: stopped at breakpoint: before 'rest'")

    mission.write_text(HEAD + "run: {wiat: 1 s}\n")
    faulty = until(lambda: (s := client.poll()) and s.debugging.faults and s)
    assert faulty.debugging.faults[0].startswith("lively.yaml:4:")
    mission.write_text(HEAD + MISSION.replace("name: out", "name: out again"))
    fresh = until(lambda: (s := client.poll()) and s.debugging.generation == 1 and s)
    assert fresh.tree[2].name == "out again"
    assert fresh.debugging.breakpoints == (3,)  # `rest` is still there, `out` is not
    tell(folder.name, "abort", {"reason": "enough"})
    assert process.wait(timeout=30) == 1
    client.close()

    commands = [
        (event.fields["command"], event.fields["held"])
        for event in read_events(folder / "events.jsonl")
        if event.kind == "command"
    ]
    assert commands == [
        ("break", False), ("step", True), ("step", True), ("break", True), ("break", True),
        ("force", True), ("continue", True), ("abort", True),
    ]  # fmt: skip
    assert "out again" in (folder / "mission-2.yaml").read_text()


def test_there_may_be_nobody_to_tell():
    with pytest.raises(TelemetryError, match="no run 'nobody-at-all' is live"):
        tell("nobody-at-all", "pause", {})


def test_a_breakpoint_where_there_is_no_node_is_refused_before_anything_moves(tmp_path):
    file = tmp_path / "lively.yaml"
    file.write_text(HEAD + MISSION)
    done = subprocess.run(
        [sys.executable, "-m", "missions.cli.app", "run", str(file), "--headless", "--break", "uot",
         "--out", str(tmp_path / "run")],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (2, "no node is called 'uot'; did you mean 'out'?\n")
    assert not (tmp_path / "run").exists()


def test_help_lists_every_order_with_a_sentence():
    text = CliRunner().invoke(app, ["tell", "--help"]).output
    listed = dict(re.findall(r"^  (\w+) +(\S.*)$", text.partition("Commands:\n")[2], re.MULTILINE))
    assert listed.keys() == {
        "pause", "resume", "continue", "step", "break", "unbreak", "force", "abort", "estop",
        "release", "nodes", "goal", "pose", "set", "speed", "behaviour",
        "cancel", "drop_box", "move_door", "push", "lift", "silence_sensor", "set_charge",
    }  # fmt: skip
    assert str(ROOT) not in text
