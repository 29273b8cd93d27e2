"""What is said and written about an engine that ended without a report."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from missions.execution.report import Report, read_report
from missions.execution.supervision.supervisor import Supervisor
from stack.errors import TelemetryError
from stack.runtime.holdups import held_seconds, holds_of
from stack.telemetry.event_log import read_events
from stack.telemetry.hub import EVENTS
from stack.telemetry.records import Event


def end_of(supervisor: Supervisor) -> str:
    """Return in one sentence how the engine ended."""
    node = supervisor.node
    where = f"; {node} had not returned" if node else ""
    if supervisor.killed:
        return f"the engine was killed: {supervisor.killed}{where}"
    code = supervisor.engine.returncode
    if code < 0:
        return f"the engine was ended by {_signal_name(-code)}{where}"
    return f"the engine process ended by itself with exit code {code}{where}"


def lost_reports(supervisor: Supervisor, reason: str, status: str = "error") -> list[Report]:
    """Return a report for each mission of an engine that sent none; write those that are missing.

    A mission that had ended before has its report in its folder. The others consist of what the
    engine told before its first step and of its last beat. How a mission had ended, if the engine
    told that, comes before what became of the engine.

    Args:
        supervisor: of the engine, which has ended.
        reason: how it ended.
        status: of the reports.
    """
    beat = supervisor.progress
    wall = max(0.0, beat.wall - supervisor.began)
    found = []
    for folder, draft in supervisor.drafts.items():
        written = read_report(Path(folder)) if folder else None
        if written is not None:
            found.append(written)
            continue
        ending = supervisor.endings.get(folder, "")
        report = Report(
            **{
                **draft, "status": status,
                "reason": f"the mission ended: {ending}; then {reason}" if ending else reason,
                "simulated_seconds": beat.time, "wall_seconds": wall,
                "real_time_factor": beat.time / max(wall, 1e-9), "distance_m": beat.distance,
                "log_sha256": _hash_of_events(folder),
                "held": held_seconds(holds_of(_events(folder), beat.time)),
            }
        )  # fmt: skip
        _write(folder, report)
        found.append(report)
    return found


def _events(folder: str) -> Iterator[Event]:
    """Yield the events that can be read."""
    with suppress(OSError, TelemetryError):
        yield from read_events(Path(folder) / EVENTS)


def _hash_of_events(folder: str) -> str:
    """Return the SHA-256 of the complete lines of events.jsonl; empty without one."""
    if not folder:
        return ""
    digest = sha256()
    try:
        with (Path(folder) / EVENTS).open("rb") as lines:
            for line in lines:
                if line.endswith(b"\n"):
                    digest.update(line)
    except OSError:
        return ""
    return digest.hexdigest()


def _write(folder: str, report: Report) -> None:
    """Write report.json, unless the engine has, or the folder is gone."""
    file = Path(folder) / "report.json"
    if not folder or file.exists():
        return
    with suppress(OSError):
        unfinished = file.with_name(".report.json.new")
        unfinished.write_text(report.to_json() + "\n", "utf-8")
        unfinished.replace(file)


def _signal_name(number: int) -> str:
    with suppress(ValueError):
        return f"signal {number} ({signal.Signals(number).name})"
    return f"signal {number}"
