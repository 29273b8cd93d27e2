"""A recorded run of half a minute: four events, and changes of three nodes."""

from pathlib import Path

from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.snapshots.log import SnapshotLog
from tests.stack.telemetry.synthetic_run import SyntheticRun

SECONDS = 30
EVENTS = {4.0: "info", 11.0: "warning", 17.0: "error", 17.05: "info"}
"""Time and level of each event that is not routine."""


class Wall:
    """A wall clock that only the test moves."""

    now = 50.0

    def __call__(self):
        return self.now


def record(path: Path) -> None:
    """Write the records of the run into a folder."""
    run = SyntheticRun()
    sinks = [Recorder(RunFolder(path)), SnapshotLog(path / SNAPSHOTS, RecordingParameters())]
    telemetry, before = Telemetry(run.info(), sinks), {}
    for step in range(SECONDS * 20):
        time = step * 0.05
        telemetry.advance(step, time)
        level = EVENTS.get(round(time, 2))
        if level:
            telemetry.emit("say", f"it is {time:g}", source="mission", level=level)
        for row in run.tree_at(time):
            if before.get(row.id, row.status) != row.status:
                telemetry.emit("node_status", "", source="tree", node=row.id, to=row.status)
            before[row.id] = row.status
        telemetry.publish(lambda time=time: run.snapshot_at(time))
    telemetry.close(None)
