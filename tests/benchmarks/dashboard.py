"""What the dashboard costs: processor time of its process, and bytes to the terminal.

A real engine drives 02_office_patrol at real time. The viewer is a process of its own under a
pseudo-terminal of a given size, which this process empties. Only the viewer's time is counted,
from /proc, and only after the first seconds, in which it starts.

`cost_of_watching` is the other side: the engine's processor time for a part of the mission, without
dashboards and with three of them, of which one is frozen and one was killed.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import termios
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from select import select
from time import monotonic  # noqa: TID251 - other processes take wall time
from typing import Any, TypeVar

from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Command, MissionState
from stack.telemetry.rendezvous import RunHandle, live_runs
from tests.benchmarks.table import Rows

SIZES = ((120, 40), (220, 60))
SETTLING, MEASURED = 4.0, 10.0
"""Wall seconds after each change that are left out, and that are measured."""

PATIENCE = 120.0
"""Wall seconds that an engine may take to answer; a first start compiles kernels."""

MISSION = "02_office_patrol"

WATCHED_SPEED, WATCHED = 2, (12.0, 40.0)
"""Times real time, and the part of the mission whose processor time is measured, seconds."""

T = TypeVar("T")


def run() -> Rows:
    """A row for each size of the terminal and each state of the run."""
    with tempfile.TemporaryDirectory() as folder:
        return [row for size in SIZES for row in _rows(Path(folder), size)]


def _rows(folder: Path, size: tuple[int, int]) -> Rows:
    columns, lines = size
    with (
        _engine(folder / f"run-{os.getpid()}-{columns}x{lines}") as (engine, handle),
        _viewer(handle, columns, lines) as viewer,
    ):
        client = TelemetryClient(handle)
        try:
            rows = [viewer.row("running")]
            _command(client, "pause", MissionState.PAUSED)
            rows.append(viewer.row("paused"))
            _command(client, "abort", MissionState.ABORTED)
        finally:
            client.close()
        engine.wait(timeout=PATIENCE)
        rows.append(viewer.row("over"))
    return rows


def cost_of_watching(pairs: int) -> Rows:
    """A row for each pair of runs; which of the two is first alternates."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for pair in range(pairs):
            used = {
                watched: _engine_time(Path(folder) / f"run-{os.getpid()}-{pair}-{watched}", watched)
                for watched in ((False, True) if pair % 2 else (True, False))
            }
            rows.append({
                "pair": pair + 1, "alone s": used[False], "watched s": used[True],
                "cost %": 100.0 * (used[True] / used[False] - 1.0),
            })  # fmt: skip
    return rows


def _engine_time(folder: Path, watched: bool) -> float:
    """Processor time of the engine from WATCHED[0] to WATCHED[1], seconds."""
    used: list[float] = []
    with (
        _engine(folder, WATCHED_SPEED) as (_, handle),
        _three_viewers(handle) if watched else nullcontext(_rest) as rest,
        closing(TelemetryClient(handle)) as client,
    ):
        for time in WATCHED:
            _until(partial(_is_at, client, time), rest)
            used.append(_processor_time(handle.pid))
    return used[1] - used[0]


@contextmanager
def _three_viewers(handle: RunHandle) -> Iterator[Callable[[], object]]:
    """Start three dashboards, freeze one and kill one; what empties the terminal of the third."""
    with ExitStack() as viewers:
        seen, frozen, killed = (viewers.enter_context(_viewer(handle, *SIZES[0])) for _ in range(3))
        seen.read_for(SETTLING)
        frozen.signal(signal.SIGSTOP)
        killed.signal(signal.SIGKILL)
        yield partial(seen.read_for, 0.05)


def _is_at(client: TelemetryClient, time: float) -> bool:
    return (snapshot := client.poll()) is not None and snapshot.time >= time


class _Viewer:
    """The dashboard's process, and our end of its terminal."""

    def __init__(self, process: subprocess.Popen[bytes], terminal: int, size: str) -> None:
        self._process, self._terminal, self._size = process, terminal, size

    def row(self, state: str) -> dict[str, Any]:
        """Measure the present state of the run."""
        self.read_for(SETTLING)
        began, processor = monotonic(), _processor_time(self._process.pid)
        received = self.read_for(MEASURED)
        wall = monotonic() - began
        return {
            "terminal": self._size, "state": state,
            "core %": 100.0 * (_processor_time(self._process.pid) - processor) / wall,
            "kB/s": received / wall / 1e3,
        }  # fmt: skip

    def signal(self, number: signal.Signals) -> None:
        """Freeze or kill the dashboard."""
        self._process.send_signal(number)

    def read_for(self, seconds: float) -> int:
        """Empty the terminal for a while; return the number of bytes."""
        deadline, received = monotonic() + seconds, 0
        while (left := deadline - monotonic()) > 0.0:
            if select([self._terminal], [], [], left)[0]:
                received += len(os.read(self._terminal, 1 << 16))
        return received


@contextmanager
def _engine(folder: Path, speed: float = 1) -> Iterator[tuple[subprocess.Popen[bytes], RunHandle]]:
    engine = subprocess.Popen(
        [sys.executable, "-m", "missions.cli.app", "run", MISSION, "--headless",
         "--speed", str(speed), "--out", str(folder)],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    try:
        yield engine, _until(lambda: _announced(folder.name))
    finally:
        engine.terminate()
        engine.wait()


@contextmanager
def _viewer(handle: RunHandle, columns: int, lines: int) -> Iterator[_Viewer]:
    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (lines, columns))
    process = subprocess.Popen(
        [sys.executable, "-m", "tui", handle.address, handle.identity],
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        env={**os.environ, "TERM": "xterm-256color", "COLORTERM": "truecolor"},
    )  # fmt: skip
    os.close(theirs)
    try:
        yield _Viewer(process, ours, f"{columns}x{lines}")
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
        os.close(ours)


def _announced(run_id: str) -> RunHandle | None:
    return next((run for run in live_runs() if run.run_id == run_id), None)


def _command(client: TelemetryClient, kind: str, state: MissionState) -> None:
    client.send(Command(kind, kind))
    _until(lambda: (snapshot := client.poll()) is not None and snapshot.state is state)


def _processor_time(pid: int) -> float:
    """User and system time of a process so far, seconds: fields 14 and 15 of proc(5)."""
    text = Path(f"/proc/{pid}/stat").read_text("utf-8")
    user, system = text.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def _rest() -> None:
    select([], [], [], 0.05)


def _until(look: Callable[[], T | None], rest: Callable[[], object] = _rest) -> T:
    """What `look` returns once it is true."""
    deadline = monotonic() + PATIENCE
    while monotonic() < deadline:
        if result := look():
            return result
        rest()
    raise TimeoutError(f"nothing within {PATIENCE} s")
