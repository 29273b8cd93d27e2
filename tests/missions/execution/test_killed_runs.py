"""A run that is killed leaves what it has written."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import pytest

from missions.execution.prepare import prepare
from missions.execution.report import read_report
from missions.execution.report_builder import unstarted_report
from missions.execution.supervision.lost_engine import lost_reports
from missions.run_options import RunOptions
from stack.telemetry.event_log import event_line, read_events
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Event
from stack.telemetry.sensor_log import read_about, read_observations
from stack.telemetry.snapshots.recording import SnapshotRecording
from tests.missions.execution.test_engine import until

PROGRAM = """
import sys
import missions
missions.run("02_office_patrol", out=sys.argv[1], record=("sensors",))
"""


@pytest.mark.slow
def test_a_killed_run_leaves_records_that_can_be_read(tmp_path):
    run = subprocess.Popen([sys.executable, "-c", PROGRAM, tmp_path], stderr=subprocess.DEVNULL)
    log, recording = tmp_path / "sensors.mcap", tmp_path / "snapshots.mcap"
    try:
        for file in (log, recording):
            until(lambda file=file: file.exists() and file.stat().st_size > 100_000)
        assert run.poll() is None
    finally:
        run.kill()
        run.wait()
    numbers = [event.number for event in read_events(tmp_path / "events.jsonl")]
    assert numbers and numbers == [*range(len(numbers))]
    assert (tmp_path / "events.jsonl").read_bytes().endswith(b"\n")
    assert (tmp_path / "mission.yaml").read_text("utf-8").startswith("# Patrol of an office")
    assert not (tmp_path / "report.json").exists()
    with SnapshotRecording(tmp_path) as recorded:
        assert len(recorded.times) > 10 and not recorded.is_complete
    times = [observation.time for observation in read_observations(log)]
    assert len(times) > 10
    assert times == pytest.approx([0.05 * n for n in range(len(times))])
    assert read_about(log)["mission"] == "02_office_patrol"


def test_the_report_of_a_killed_engine_sums_up_what_held_the_robot(tmp_path):
    """Held from 2 s on, by an obstacle for 3 s, and by a person until the last beat, at 9 s."""
    told = [
        ("held", {"effect": "stopped", "cause": "obstacle", "begin": 2.0}),
        ("held_end", {"effect": "stopped", "cause": "obstacle", "begin": 2.0, "seconds": 3.0}),
        ("held", {"effect": "slower", "cause": "person", "begin": 6.5}),
    ]
    lines = [
        event_line(Event(number, 0, 7.0, "info", "safety", kind, "", fields))
        for number, (kind, fields) in enumerate(told)
    ]
    (tmp_path / "events.jsonl").write_bytes(b"".join(lines) + b'{"cut')
    plan, folder = prepare("01_drive_to_a_point", RunOptions()), RunFolder(tmp_path)
    draft = unstarted_report(plan, RunOptions(), folder).plain()
    ended = SimpleNamespace(
        progress=SimpleNamespace(time=9.0, wall=12.0, distance=1.0), began=10.0,
        drafts={str(tmp_path): draft}, endings={},
    )  # fmt: skip
    (report,) = lost_reports(ended, "the engine was ended by signal 9 (SIGKILL)")
    assert report.held == {"stopped": {"obstacle": 3.0}, "slower": {"person": 2.5}}
    assert read_report(tmp_path) == report
