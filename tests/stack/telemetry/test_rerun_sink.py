import os
import re
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

from stack.telemetry.grid_colours import cost_picture, map_picture
from stack.telemetry.hub import Telemetry
from stack.telemetry.outlines import outline, uncertainty_ellipse
from stack.telemetry.records import MissionState, TreeRow
from stack.telemetry.rerun_sink import RerunSink
from stack.telemetry.tree_text import NOTHING, activity, tree_markdown
from stack.types import CostGrid, OccupancyGrid, Pose2D
from tests.stack.telemetry.synthetic_run import SyntheticRun

RERUN = Path(sysconfig.get_path("scripts")) / "rerun"
ROOT = Path(__file__).parents[3]


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


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Twenty seconds of a run at twenty steps a second."""
    path = tmp_path_factory.mktemp("rerun") / "mission.rrd"
    run, dropped = SyntheticRun(), []
    telemetry = Telemetry(run.info(), [RerunSink(path)], dropped.append)
    for step in range(400):
        telemetry.advance(step, step * 0.05)
        if step % 100 == 0:
            telemetry.emit("say", f"step {step}", source="mission")
        telemetry.publish(lambda step=step: run.snapshot_at(step * 0.05))
    telemetry.close({"result": "success"})
    assert dropped == []
    return path


def test_the_recording_is_sound(recording):
    verified = rerun("verify", recording)
    assert verified.returncode == 0, verified.stderr
    assert recording.stat().st_size < 4_000_000


def test_snapshots_come_at_the_period_and_layers_when_they_change(recording):
    rows = rows_by_entity(recording)
    assert rows["/world/robot_pose"] == 200  # 20 s at 10 Hz
    assert rows["/plots/speed"] == 1 + 200  # its legend
    assert rows["/world/map"] == 2  # its frame, and one version
    assert rows["/world/global_costmap"] == 1 + 4  # a version every five seconds
    assert rows["/world/local_costmap"] == 1 + 200
    assert rows["/world/camera/picture"] == 1 + 40  # two pictures a second
    assert rows["/log/mission"] == 4
    assert rows["/activity"] == 3 + 3  # three phrases, and a colour table for each new one
    assert rows["/tree/006_to_the_meeting_room"] == 1 + 2  # colours, idle, running
    assert 20 <= rows["/tree_text"] <= 24


def test_the_robot_model_is_there(recording):
    rows = rows_by_entity(recording)
    assert "/world/rover/visual_geometries/base_link/visual_0" in rows
    assert rows["/world/joints"] == 3


def test_a_killed_recording_can_be_repaired(tmp_path):
    program = """
import sys
from pathlib import Path
from tests.stack.telemetry.synthetic_run import SyntheticRun
from stack.telemetry.rerun_sink import RerunSink
run = SyntheticRun()
sink = RerunSink(Path(sys.argv[1]))
sink.open(run.info())
first = run.snapshot_at(0.0)
sink.snapshot(first)
from dataclasses import replace
path = Path(sys.argv[1])
for k in range(1, 80):
    sink.snapshot(replace(first, time=k * 0.1))
    if k % 20 == 0:
        size = path.stat().st_size
        while path.stat().st_size == size:
            pass
print("enough", flush=True)
sys.stdin.read()
"""
    broken, repaired = tmp_path / "broken.rrd", tmp_path / "repaired.rrd"
    run = subprocess.Popen(
        [sys.executable, "-c", program, broken],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert run.stdout.readline() == b"enough\n"
    run.send_signal(signal.SIGKILL)
    run.communicate()
    assert rerun("verify", broken).returncode != 0
    assert rerun("optimize", broken, "-o", repaired).returncode == 0
    assert rerun("verify", repaired).returncode == 0
    assert rows_by_entity(repaired)["/world/robot_pose"] >= 20


def test_a_run_with_little_to_show_is_drawn_too(tmp_path, info, snapshot_at):
    dropped = []
    telemetry = Telemetry(info, [RerunSink(tmp_path / "a.rrd")], dropped.append)
    bare = {
        "particles": None, "scan": None, "path": None, "goal": None, "layers": {}, "image": None,
        "truth": None, "people": None, "tracks": (), "tree": (), "covariance": np.zeros((3, 3)),
    }  # fmt: skip
    telemetry.publish(lambda: snapshot_at(time=0.0, **bare))
    telemetry.advance(2, 0.1)
    telemetry.publish(lambda: snapshot_at(time=0.1))
    telemetry.advance(4, 0.2)
    empty = {"people": np.empty((0, 3)), "particles": np.empty((0, 3), np.float32)}
    telemetry.publish(lambda: snapshot_at(time=0.2, **(bare | empty)))
    telemetry.close(None, lambda: snapshot_at(time=0.2, state=MissionState.ERROR))
    assert dropped == [] and rerun("verify", tmp_path / "a.rrd").returncode == 0
    assert rows_by_entity(tmp_path / "a.rrd")["/mission"] == 1 + 2  # colours, running, error


def test_rerun_is_not_imported_before_it_is_needed():
    program = """
import sys
from stack.telemetry.rerun_sink import RerunSink
RerunSink("mission.rrd")
sys.exit("rerun" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


def test_rows_are_turned_for_the_screen_and_colours_are_quiet():
    cells = np.array([[0, 100], [-1, 0]], np.int8)
    picture = map_picture(OccupancyGrid(cells, 0.05))
    assert picture.shape == (2, 2, 4) and picture[:, :, :3].max() < 170
    assert (picture[1, 1] > picture[0, 1])[:3].all()  # row 0 of the grid is at the bottom
    costs = cost_picture(CostGrid(np.array([[0, 1, 252, 253, 254, 255]], np.uint8), 0.05), "x")
    assert costs[0, :, 3].tolist() == [0, 10, 95, 130, 130, 0]


def test_an_outline_is_closed_and_turned():
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    drawn = outline(Pose2D(10.0, 0.0, np.pi / 2), square, 0.5)
    assert np.allclose(drawn[0], (9.0, 1.0, 0.5)) and np.array_equal(drawn[0], drawn[-1])


def test_the_ellipse_has_two_deviations_as_half_axes():
    ellipse = uncertainty_ellipse(Pose2D(0.0, 0.0), np.diag([0.04, 0.01, 1.0]))
    assert np.allclose(np.abs(ellipse[:, :2]).max(axis=0), (0.4, 0.2))


def test_the_tree_as_text(snapshot_at, info):
    rows = (
        TreeRow(0, -1, "Patrol", "sequence", "running"),
        TreeRow(1, 0, "go_to *dock*", "navigate_to_pose", "failure", "no\nway"),
        TreeRow(2, 0, "wait", "wait", "running", "2 s"),
    )
    text = tree_markdown(snapshot_at(tree=rows), info)
    assert "- ▶ **Patrol**\n  - ✗ **go\\_to \\*dock\\*** *no way*\n  - ▶ **wait** *2 s*" in text
    assert activity(rows) == "wait" and activity(()) == NOTHING
