"""Recordings for rerun, drawn of snapshots that a run has recorded."""

import re
import subprocess
import sysconfig
from pathlib import Path

from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.rerun.recorded import draw_recorded
from stack.telemetry.snapshots.log import SnapshotLog

RERUN = Path(sysconfig.get_path("scripts")) / "rerun"


def rerun(*arguments):
    return subprocess.run(
        [RERUN, "rrd", *map(str, arguments)], capture_output=True, text=True, check=False
    )


def rows_by_entity(recording):
    """Rows in the chunks of each entity, static ones included."""
    printed = rerun("print", recording).stdout
    counted = {}
    for rows, path in re.findall(r"with (\d+) rows .*? - (/\S*) - ", printed):
        counted[path] = counted.get(path, 0) + int(rows)
    return counted


def drawn(folder, info, snapshots, events=()):
    """Record events, which come before all snapshots, and snapshots; return what is drawn."""
    folder.mkdir(exist_ok=True)
    sinks = [Recorder(RunFolder(folder)), SnapshotLog(folder / SNAPSHOTS, RecordingParameters())]
    for sink in sinks:
        sink.open(info)
        for event in events:
            sink.event(event)
        for snapshot in snapshots:
            sink.snapshot(snapshot)
        sink.close(None)
    draw_recorded(folder, folder / "mission.rrd")
    return folder / "mission.rrd"
