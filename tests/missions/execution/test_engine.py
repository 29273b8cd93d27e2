"""The engine behind a dashboard: it outlives its viewers, takes orders, and answers signals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time  # watching other processes takes wall time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from missions.execution.supervision.launch import LaunchOptions
from missions.execution.supervision.supervisor import Supervisor
from missions.run_options import RunOptions
from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Ack, Command, MissionState, Snapshot
from stack.telemetry.rendezvous import RunHandle

ROOT = Path(__file__).parents[3]
PATIENCE = 60.0

pytestmark = pytest.mark.slow


@pytest.fixture
def engine(tmp_path) -> Iterator[tuple[subprocess.Popen[bytes], Path, RunHandle]]:
    """An engine at twice real time, and the run it announced."""
    folder = tmp_path / f"run-{os.getpid()}"
    options = LaunchOptions(("02_office_patrol",), RunOptions(out=folder), speed="2")
    with supervised(options) as (process, run):
        yield process, folder, run


@contextmanager
def supervised(options: LaunchOptions) -> Iterator[tuple[subprocess.Popen[bytes], RunHandle]]:
    """The engine of a run, and its telemetry; killed at the end."""
    supervisor = Supervisor(options.request(), 0.0, show=False)
    try:
        supervisor.wait(lambda: bool(supervisor.started))
        yield supervisor.engine, RunHandle(**supervisor.started[0]["handle"])
    finally:
        supervisor.end_now("the test is over")
        supervisor.close()


def until(look):
    """What `look` returns once it is true."""
    deadline = time.monotonic() + PATIENCE  # noqa: TID251
    while time.monotonic() < deadline:  # noqa: TID251
        if result := look():
            return result
        time.sleep(0.02)  # noqa: TID251
    raise AssertionError(f"nothing within {PATIENCE} s")


def on_hangup(handler: signal.Handlers = signal.SIG_DFL) -> Callable[[], object]:
    """What a child process does before it begins: SIGHUP as a shell has it, or as nohup does.

    It would inherit the choice of whoever runs the tests.
    """
    return lambda: signal.signal(signal.SIGHUP, handler)


def order(client: TelemetryClient, kind: str, **arguments: object) -> Ack:
    client.send(Command(kind, kind, arguments))
    return until(lambda: next((ack for ack in client.acks() if ack.id == kind), None))


def state_becomes(client: TelemetryClient, state: MissionState) -> Snapshot:
    def arrived() -> Snapshot | None:
        snapshot = client.poll()
        return snapshot if snapshot is not None and snapshot.state is state else None

    return until(arrived)


def test_an_operator_pauses_resumes_stops_and_aborts(engine):
    process, folder, run = engine
    client = TelemetryClient(run)
    state_becomes(client, MissionState.RUNNING)
    assert order(client, "pause").done
    paused = state_becomes(client, MissionState.PAUSED)
    standing = until(lambda: (s := client.poll()) and abs(s.measured.linear) < 0.02 and s)
    assert standing.time - paused.time < 3.0
    refused = order(client, "release")
    assert not refused.done
    assert "not engaged" in refused.reason
    assert order(client, "resume").done
    state_becomes(client, MissionState.RUNNING)
    assert order(client, "estop").done
    state_becomes(client, MissionState.EMERGENCY_STOP)
    assert not order(client, "resume").done  # a resume does not undo an emergency stop
    assert order(client, "release").done
    state_becomes(client, MissionState.PAUSED)  # a reset never starts motion
    assert order(client, "resume").done
    state_becomes(client, MissionState.RUNNING)
    assert order(client, "set_parameter", name="goal_checker.position", value=0.2).done
    wrong = order(client, "set_parameter", name="goal_checker.position", value=-1)
    assert not wrong.done
    assert "above 0" in wrong.reason
    assert order(client, "abort").done
    assert process.wait(timeout=PATIENCE) == 1
    report = json.loads((folder / "report.json").read_text())
    assert (report["status"], report["reason"]) == ("aborted", "by the operator")
    client.close()


@pytest.mark.pain("n2696", "n3770")
def test_the_mission_outlives_its_viewers_and_a_later_one_attaches(engine):
    process, _, run = engine
    viewer = subprocess.Popen(
        [sys.executable, "-c",
         "import sys, time; from stack.telemetry.client import TelemetryClient\n"
         "from stack.telemetry.rendezvous import find_run\n"
         "client = TelemetryClient(find_run(sys.argv[1]))\n"
         "while client.poll() is None: time.sleep(0.02)\n"
         "print('seen', flush=True); time.sleep(600)", run.identity],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert viewer.stdout is not None
    assert viewer.stdout.readline() == "seen\n"
    viewer.kill()
    viewer.communicate()
    client = TelemetryClient(run)
    first = state_becomes(client, MissionState.RUNNING)
    later = until(lambda: (s := client.poll()) and s.time > first.time + 1.0 and s)
    assert process.poll() is None
    assert later.layers["map"].version >= 1
    numbers = [event.number for event in client.events()]
    assert numbers == list(range(len(numbers)))  # the whole backlog, without a gap
    client.close()


def test_a_signal_ends_the_run_as_interrupted_with_a_report(engine):
    process, folder, run = engine
    client = TelemetryClient(run)
    state_becomes(client, MissionState.RUNNING)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=PATIENCE) == 130
    assert json.loads((folder / "report.json").read_text())["status"] == "interrupted"
    client.close()
