"""Recorded snapshots become a rerun recording: for runs that were made with --no-rerun."""

import subprocess
import sysconfig
from pathlib import Path

from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.rerun.recorded import draw_recorded
from stack.telemetry.snapshots.log import SnapshotLog
from tests.stack.telemetry.synthetic_run import SyntheticRun

RERUN = Path(sysconfig.get_path("scripts")) / "rerun"


def test_a_recording_is_drawn_from_the_snapshots(tmp_path):
    run = SyntheticRun()
    sinks = [
        Recorder(RunFolder(tmp_path)),
        SnapshotLog(tmp_path / SNAPSHOTS, RecordingParameters()),
    ]
    telemetry = Telemetry(run.info(), sinks)
    for step in range(200):
        telemetry.advance(step, step * 0.05)
        if step % 50 == 0:
            telemetry.emit("say", f"it is step {step}", source="mission")
        telemetry.publish(lambda step=step: run.snapshot_at(step * 0.05))
    telemetry.close(None)
    draw_recorded(tmp_path, tmp_path / "mission.rrd")
    printed = subprocess.run(
        [RERUN, "rrd", "print", "-vvv", tmp_path / "mission.rrd"],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert "it is step 150" in printed
    for entity in ("/map", "plots/speed", "tree_text"):
        assert entity in printed
    assert [file.name for file in tmp_path.glob(".*")] == []
