"""A live run is shown in rerun's viewer, and does not notice what becomes of the viewer."""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest

from missions.inspection.exchange.rerun_viewer import follow, free_port, listens, viewer_program
from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.snapshots.log import SnapshotLog
from tests.missions.execution.test_engine import until
from tests.stack.telemetry.rerun_recording import rerun, rows_by_entity
from tests.stack.telemetry.synthetic_run import SyntheticRun

ROOT = Path(__file__).parents[3]


class LiveRun:
    """A run that is being written."""

    def __init__(self, folder):
        self._run = SyntheticRun()
        log = SnapshotLog(folder / SNAPSHOTS, RecordingParameters())
        recorder = Recorder(RunFolder.create(folder, "mission: x\n"))
        self._telemetry = Telemetry(self._run.info(), [recorder, log])
        self._step = 0

    def go_on(self, steps):
        """Record so many snapshots."""
        for _ in range(steps):
            self._telemetry.advance(self._step, 0.2 * self._step)
            self._telemetry.publish(lambda: self._run.snapshot_at(0.2 * self._step))
            self._step += 1

    def end(self):
        self._telemetry.close(None)


@contextmanager
def receiver(*options):
    """A viewer without a window: the server to which recordings are sent."""
    port = free_port()
    viewer = subprocess.Popen(
        [viewer_program(), *options, "--bind", "127.0.0.1", "--port", str(port)],
        stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        until(lambda: listens(port))
        yield viewer, f"rerun+http://127.0.0.1:{port}/proxy"
    finally:
        viewer.kill()
        viewer.wait()


@contextmanager
def following(folder, viewer, url):
    thread = Thread(target=follow, args=(folder, url, lambda: viewer.poll() is None))
    thread.start()
    yield thread
    thread.join(60.0)
    assert not thread.is_alive()


@pytest.mark.slow
def test_a_run_that_is_still_written_is_shown_to_its_end(tmp_path):
    received, run = tmp_path / "received.rrd", LiveRun(tmp_path / "run")
    with receiver("--save", str(received)) as (viewer, url):
        with following(tmp_path / "run", viewer, url):  # it waits for the first snapshot
            run.go_on(30)
            until(lambda: received.exists() and rows_by_entity(received))
            run.go_on(20)
            run.end()
        until(lambda: rows_by_entity(received).get("/world/robot_pose", 0) == 50)
    assert rerun("stats", received).returncode == 0


def test_a_killed_viewer_ends_the_following_and_not_the_run(tmp_path):
    run = LiveRun(tmp_path / "run")
    with receiver("--serve-grpc") as (viewer, url):
        run.go_on(10)
        with following(tmp_path / "run", viewer, url):
            viewer.kill()
            viewer.wait()
            run.go_on(10)
    run.end()


@pytest.mark.slow
def test_a_mission_goes_on_without_the_viewer_that_was_asked_for(tmp_path):
    """A display that is not there: the viewer starts, and ends with an error."""
    done = subprocess.run(
        [sys.executable, "-m", "missions.cli.app", "run", "01_drive_to_a_point", "--headless",
         "--speed", "2", "--view", "--out", str(tmp_path / "run")],
        env={"DISPLAY": "127.0.0.1:999", "PATH": ""}, cwd=ROOT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "rerun's viewer is not shown:" in done.stderr and "mission: success" in done.stderr


@pytest.mark.slow
def test_a_run_does_not_import_rerun(tmp_path):
    program = (
        "import sys, missions;"
        "missions.run('01_drive_to_a_point', out=sys.argv[1]); sys.exit('rerun' in sys.modules)"
    )
    command = [sys.executable, "-c", program, tmp_path / "run"]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == 0
