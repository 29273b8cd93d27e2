"""A dashboard that is ended from outside leaves the mission to itself, also while it starts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from fcntl import ioctl
from pathlib import Path
from termios import TIOCSCTTY
from threading import Thread

import pytest

from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import MissionState
from stack.telemetry.rendezvous import live_runs
from tests.missions.execution.supervision.test_signals import MISSION
from tests.missions.execution.test_engine import PATIENCE, ROOT, order, state_becomes, until

pytestmark = pytest.mark.slow


def read_all(terminal: int) -> None:
    with suppress(OSError):
        while os.read(terminal, 1 << 16):
            pass


def child_with(word: bytes, parent: int) -> int | None:
    """The child process of a process with this word in its command line."""
    for status in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            above = int(status.read_text("utf-8").rpartition(")")[2].split()[1])
            if above == parent and word in status.with_name("cmdline").read_bytes().split(b"\0"):
                return int(status.parent.name)
    return None


@pytest.mark.parametrize(
    ("number", "early"),
    [(signal.SIGTERM, True), (signal.SIGINT, True), (signal.SIGTERM, False), (signal.SIGINT, False),
     (signal.SIGKILL, False)],
)  # fmt: skip
def test_a_signal_to_the_dashboard_alone_does_not_end_the_mission(tmp_path, number, early):
    ours, theirs = os.openpty()
    file, folder = tmp_path / "waiting.yaml", tmp_path / f"{tmp_path.name}-{number}"
    file.write_text(MISSION)
    command = subprocess.Popen(
        [sys.executable, "-m", "missions.cli.app", "run", str(file), "--out",
         str(folder)],
        cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        preexec_fn=lambda: ioctl(0, TIOCSCTTY, 0),
    )  # fmt: skip
    Thread(target=read_all, args=(ours,), daemon=True).start()
    try:
        dashboard = until(lambda: child_with(b"tui", command.pid))
        run = until(lambda: next((run for run in live_runs() if run.run_id == folder.name), None))
        client = TelemetryClient(run)
        if not early:
            state_becomes(client, MissionState.RUNNING)
        os.kill(dashboard, number)
        until(lambda: child_with(b"tui", command.pid) is None)
        state_becomes(client, MissionState.RUNNING)
        assert command.poll() is None
        assert order(client, "abort").done
        assert command.wait(PATIENCE) == 1
        assert (folder / "report.json").exists()
        client.close()
    finally:
        command.kill()
        for descriptor in (ours, theirs):
            os.close(descriptor)
