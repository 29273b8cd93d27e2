"""A run that is killed leaves what it has written."""

from __future__ import annotations

import subprocess
import sys

import pytest

from stack.telemetry.event_log import read_events
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
