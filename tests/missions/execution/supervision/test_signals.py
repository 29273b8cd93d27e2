"""Signals to the command and to its engine: who ends, what the robot does, what is written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

import pytest

from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import MissionState
from stack.telemetry.rendezvous import RunHandle, live_runs
from tests.missions.execution.test_engine import (
    PATIENCE,
    ROOT,
    on_hangup,
    order,
    state_becomes,
    until,
)

pytestmark = pytest.mark.slow

MISSION = """\
mission: waiting
robot: scout
world: small_room
run: {sequence: [{wait: 1000 s}]}
"""


class Started:
    """A headless run at real time: its command, its engine and its folder."""

    def __init__(self, folder: Path, *words: str, hangup: signal.Handlers = signal.SIG_DFL) -> None:
        self.folder = folder / f"run-{uuid4().hex}"
        (folder / "waiting.yaml").write_text(MISSION)
        self.command = subprocess.Popen(
            [sys.executable, "-m", "missions.cli.app", "run", str(folder / "waiting.yaml"),
             "--headless", "--speed", "1", "--out", str(self.folder), *words],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            preexec_fn=on_hangup(hangup),
        )  # fmt: skip
        self.handle = until(self._announced)
        self.client = TelemetryClient(self.handle)
        state_becomes(self.client, MissionState.RUNNING)

    def _announced(self) -> RunHandle | None:
        assert self.command.poll() is None, self.command.communicate()
        return next((run for run in live_runs() if run.run_id == self.folder.name), None)

    def ends_with(self) -> tuple[int, str]:
        """The exit code of the command and what it wrote."""
        output, errors = self.command.communicate(timeout=PATIENCE)
        return self.command.returncode, output + errors

    @property
    def report(self) -> dict[str, object]:
        return json.loads((self.folder / "report.json").read_text("utf-8"))

    def close(self) -> None:
        self.client.close()
        for process in (self.command.pid, self.handle.pid):
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.command.communicate()


@pytest.fixture
def start(tmp_path) -> Iterator[object]:
    runs = []

    def begin(*words: str, **more: signal.Handlers) -> Started:
        runs.append(Started(tmp_path, *words, **more))
        return runs[-1]

    yield begin
    for run in runs:
        run.close()


def state_of(process: int) -> str:
    """R, S, T…: from Linux' table of processes."""
    return Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()[0]


@pytest.mark.parametrize("words", [(), ("--on-hangup", "stop")], ids=["continue", "stop"])
def test_a_closed_terminal_ends_the_command_and_not_the_mission(start, words):
    run = start(*words)
    run.command.send_signal(signal.SIGHUP)
    assert run.ends_with()[0] == 130
    if words:
        assert state_becomes(run.client, MissionState.PAUSED).reason == "the terminal was closed"
    assert order(run.client, "resume").done == bool(words)
    assert order(run.client, "abort").done
    until(lambda: (run.folder / "report.json").exists())
    assert run.report["status"] == "aborted"


def test_a_closed_terminal_may_abort_the_mission(start):
    run = start("--on-hangup", "abort")
    run.command.send_signal(signal.SIGHUP)
    assert run.ends_with()[0] == 130
    until(lambda: (run.folder / "report.json").exists())
    assert (run.report["status"], run.report["reason"]) == (
        "interrupted",
        "the terminal was closed",
    )


@pytest.mark.parametrize("words", [(), ("--on-hangup", "abort")], ids=["default", "abort"])
def test_a_run_under_nohup_survives_a_closed_terminal(start, words):
    """SIGHUP goes to the command; the engine has a session of its own."""
    run = start(*words, hangup=signal.SIG_IGN)
    for process in (run.command.pid, run.handle.pid):
        os.kill(process, signal.SIGHUP)
    assert order(run.client, "pause").done  # it would fail if the mission had ended
    assert run.command.poll() is None
    assert order(run.client, "abort").done
    assert run.ends_with()[0] == 1


def test_an_engine_whose_supervisor_was_killed_does_as_after_a_closed_terminal(start):
    run = start("--on-hangup", "stop")
    run.command.kill()
    assert state_becomes(run.client, MissionState.PAUSED).reason == "the terminal was closed"


def test_suspending_the_command_suspends_the_engine(start):
    run = start()
    run.command.send_signal(signal.SIGTSTP)
    until(lambda: state_of(run.command.pid) == state_of(run.handle.pid) == "T")
    run.command.send_signal(signal.SIGCONT)
    until(lambda: state_of(run.handle.pid) != "T")
    assert order(run.client, "abort").done
    assert run.ends_with()[0] == 1


def test_a_suspended_engine_is_reported_and_still_ends_after_a_signal(start):
    run = start()
    os.kill(run.handle.pid, signal.SIGSTOP)
    until(lambda: "suspended" in (run.folder / "log.txt").read_text("utf-8"))
    run.command.send_signal(signal.SIGINT)
    code, written = run.ends_with()
    assert code == 3
    assert f"it is suspended; continue it with: kill -CONT {run.handle.pid}" in written
    assert "did not end within 2 s" in str(run.report["reason"])
