"""Records that cannot be written are named on the screen, in the report and by the exit code."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.telemetry.event_log import read_events

ROOT = Path(__file__).parents[3]
MISSION = "mission: short\nrobot: scout\nworld: small_room\nrun: {wait: {time: 2 s}}\n"


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "short.yaml"
    file.write_text(MISSION)
    return file


def removed_after(steps, mission, options):
    """The report of a run whose folder is removed after some steps."""
    run = Run(prepare(mission, options), options)
    try:
        for _ in range(steps):
            run.step()
        shutil.rmtree(run.folder)
        while not run.is_over:
            run.step()
        run.finish()
    finally:
        run.close()
    return run.report


def test_a_removed_folder_is_told_everywhere(mission, tmp_path, capfd):
    out = tmp_path / "run"
    options = RunOptions(out=out, serve=False, record=("sensors",))
    report = removed_after(5, mission, options)
    assert (report.status, report.exit_code) == ("success", 3)
    lost = {item["record"]: item for item in report.records_lost}
    assert set(lost) == {"events.jsonl", "log.txt", "sensors.mcap", "snapshots.mcap"}
    # 5 steps of 0.05 s were made; the log of the sensors is written in each step
    assert lost["sensors.mcap"]["time"] == pytest.approx(0.25)
    assert lost["sensors.mcap"]["reason"] == "the file was removed"
    shown = capfd.readouterr().err
    assert f"! records lost: events.jsonl from event {lost['events.jsonl']['event']} on" in shown
    assert "records lost: snapshots.mcap from" in report.summary()
    assert json.loads((out / "report.json").read_text())["records_lost"] == report.records_lost


def test_a_run_can_stop_when_records_are_lost(mission, tmp_path):
    options = RunOptions(out=tmp_path / "run", serve=False, on_lost_records="stop")
    report = removed_after(5, mission, options)
    assert report.status == "aborted" and report.exit_code == 3
    assert report.reason.startswith("records lost: snapshots.mcap from")
    assert report.simulated_seconds < 1.0  # the next snapshot comes within 0.2 s


def test_a_full_disk_leaves_complete_lines_and_a_report(mission, tmp_path):
    """A limit of the file size fails as a full disk does, in the middle of a write."""
    program = """
import resource, signal, sys
from pathlib import Path
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
options = RunOptions(out=Path(sys.argv[2]), serve=False)
run = Run(prepare(sys.argv[1], options), options)
resource.setrlimit(resource.RLIMIT_FSIZE, (800, 800))
while not run.is_over:
    run.step()
run.finish()
run.close()
print(run.report.summary())
sys.exit(run.report.exit_code)
"""
    done = subprocess.run(
        [sys.executable, "-c", program, mission, tmp_path / "run"],
        capture_output=True, text=True, cwd=ROOT, check=False,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    events = list(read_events(tmp_path / "run" / "events.jsonl"))
    assert (tmp_path / "run" / "events.jsonl").read_bytes().endswith(b"\n")
    assert f"records lost: events.jsonl from event {len(events)} on (File too large)" in done.stdout
    assert "records lost: report.json from 2" in done.stdout  # of 2 to 3 kB
    assert "! records lost: events.jsonl" in done.stderr
    assert {item.name for item in (tmp_path / "run").iterdir()} == {
        "events.jsonl", "inputs", "inputs.json", "log.txt", "mission.yaml", "snapshots.mcap",
    }  # fmt: skip


def test_a_changed_working_directory_does_not_move_the_records(mission, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = RunOptions(out=Path("run"), serve=False)
    (tmp_path / "elsewhere").mkdir()
    os.chdir("elsewhere")
    run = Run(prepare(mission, options), options)
    try:
        run.step()
        os.chdir(tmp_path)
        run.interrupt()
        while not run.is_over:
            run.step()
        run.finish()
    finally:
        run.close()
    assert run.report.records_lost == []
    assert (tmp_path / "run" / "report.json").exists()
    assert "records in run\n" in run.report.summary() + "\n"  # as short as it can be typed
