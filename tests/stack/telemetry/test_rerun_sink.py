import os
import re
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

from stack.telemetry.grid_colours import OUTSIDE_MAP, coloured, cost_table, map_table
from stack.telemetry.hub import Telemetry
from stack.telemetry.outlines import outline, uncertainty_ellipse
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Layer, MissionState, RecordFull, TreeRow
from stack.telemetry.rerun.sink import RerunSink
from stack.telemetry.tree_text import NOTHING, activity, tree_markdown
from stack.types import CostGrid, Pose2D
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


def test_the_recording_is_sound_and_small(recording, tmp_path):
    indexed = tmp_path / "indexed.rrd"
    assert rerun("optimize", recording, "-o", indexed).returncode == 0  # adds the index
    verified = rerun("verify", indexed)
    assert verified.returncode == 0, verified.stderr
    assert recording.stat().st_size < 5_000_000 / 3  # at most 5 MB a minute


def test_each_entity_has_its_rate_and_constants_are_written_once(recording):
    rows = rows_by_entity(recording)
    assert rows["/world/robot_pose"] == 100  # 20 s at 5 Hz
    assert rows["/plots/speed"] == 1 + 100  # its legend
    assert rows["/world/scan"] == 1 + 100  # its colour, size and frame
    assert rows["/world/outline"] == 1  # follows the pose
    assert rows["/world/particles"] == 1 + 40  # 2 Hz
    assert rows["/world/local_plan"] == 1 + 40
    windows = [count for path, count in rows.items() if path.startswith("/world/local_costmap/")]
    shapes = len(windows)  # the window is clipped at walls; each shape is an entity
    assert sum(windows) == 20 + shapes + (shapes - 1)  # 1 Hz; constants; a change hides the other
    assert rows["/world/camera/picture"] == 1 + 20  # 2 Hz, but every second snapshot has none
    assert rows["/log/mission"] == 4
    assert rows["/activity"] == 3 + 3  # three phrases, and a colour table for each new one
    assert rows["/tree/006_to_the_meeting_room"] == 1 + 2  # colours, idle, running
    assert 20 <= rows["/tree_text"] <= 24


def test_of_a_grid_only_the_changed_tiles_are_written(recording):
    rows = rows_by_entity(recording)
    tiles = {path: count for path, count in rows.items() if path.startswith("/world/map/")}
    assert tiles == {"/world/map/0_0": 1 + 1}  # one tile of 512 cells, once
    costs = [count for path, count in rows.items() if path.startswith("/world/global_costmap/")]
    assert costs and set(costs) == {1 + 1}  # a new version every 5 s, but the same cells


def test_the_robot_model_is_there(recording):
    rows = rows_by_entity(recording)
    assert "/world/rover/visual_geometries/base_link/visual_0" in rows
    assert rows["/world/joints"] == 3


def test_a_killed_recording_is_readable(tmp_path):
    program = """
import sys
from dataclasses import replace
from pathlib import Path
from tests.stack.telemetry.synthetic_run import SyntheticRun
from stack.telemetry.rerun.sink import RerunSink
run = SyntheticRun()
sink = RerunSink(Path(sys.argv[1]))
sink.open(run.info())
first = run.snapshot_at(0.0)
for k in range(60):
    sink.snapshot(replace(first, time=k * 0.2))
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
    # 12 s at 5 Hz, written every 4 s: the last write was at 8 s.
    assert rows_by_entity(broken)["/world/robot_pose"] == 41
    with broken.open("rb+") as file:  # as if it was killed in the middle of a write
        file.truncate(broken.stat().st_size - 100)
    assert rerun("optimize", broken, "-o", repaired).returncode == 0
    assert rerun("verify", repaired).returncode == 0
    assert rows_by_entity(repaired)["/world/robot_pose"] >= 21


def write_until(sink, run, seconds):
    for k in range(round(seconds * 5)):
        sink.snapshot(run.snapshot_at(k * 0.2))


def test_the_recording_stops_at_its_size_limit(tmp_path):
    run, path = SyntheticRun(), tmp_path / "mission.rrd"
    sink = RerunSink(path, RecordingParameters(size_limit=1.0, particle_rate=100.0))
    sink.open(run.info())
    with pytest.raises(RecordFull, match=r"mission.rrd reached its limit of 1 MB"):
        write_until(sink, run, 60.0)
    sink.close(None)
    assert 500_000 < path.stat().st_size <= 1_000_000
    assert rows_by_entity(path)["/world/robot_pose"] >= 21  # readable


def test_a_removed_file_is_noticed(tmp_path):
    run, path = SyntheticRun(), tmp_path / "mission.rrd"
    sink = RerunSink(path)
    sink.open(run.info())
    sink.snapshot(run.snapshot_at(0.0))
    path.unlink()
    with pytest.raises(FileNotFoundError, match="was removed"):
        write_until(sink, run, 10.0)


def test_a_full_disk_leaves_complete_messages(tmp_path):
    """A limit of the file size, which fails as a full disk does, in the middle of a write."""
    program = """
import resource, signal, sys
from pathlib import Path
from tests.stack.telemetry.synthetic_run import SyntheticRun
from stack.telemetry.rerun.sink import RerunSink
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
run, sink = SyntheticRun(), RerunSink(Path(sys.argv[1]))
sink.open(run.info())
sink.snapshot(run.snapshot_at(0.0))
complete = Path(sys.argv[1]).stat().st_size
resource.setrlimit(resource.RLIMIT_FSIZE, (complete + 1000, complete + 1000))
try:
    for k in range(1, 60):
        sink.snapshot(run.snapshot_at(k * 0.2))
except OSError as error:
    print(error.strerror, Path(sys.argv[1]).stat().st_size == complete)
"""
    path = tmp_path / "mission.rrd"
    done = subprocess.run(
        [sys.executable, "-c", program, path], capture_output=True, text=True, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.stdout == "File too large True\n"
    assert rows_by_entity(path)["/world/robot_pose"] == 1


def test_a_changed_corner_of_a_large_costmap_costs_one_tile(tmp_path, info, snapshot_at):
    cells = np.zeros((1000, 1000), np.uint8)
    cells[10, 10] = cells[500, 500] = 254
    path, sink = tmp_path / "a.rrd", None
    sink = RerunSink(path, RecordingParameters(global_costmap_rate=5.0))
    sink.open(info)

    def show(time, version, *changes):
        layer = Layer(version, CostGrid(cells.copy(), 0.05), changes)
        sink.snapshot(snapshot_at(time=time, layers={"global_costmap": layer}))

    show(0.0, 1)
    cells[990, 990] = 100
    cells[20, 20] = 200  # but not announced as changed: not looked at
    show(0.2, 2, (2, (980, 1000, 980, 1000)))
    cells[500, 500] = 0
    show(0.4, 4, (4, (500, 501, 500, 501)))  # version 3 is not known: everything is looked at
    sink.close(None)
    rows = rows_by_entity(path)
    tiles = {path: n for path, n in rows.items() if path.startswith("/world/global_costmap/")}
    side = "/world/global_costmap/"
    assert tiles == {side + "0_0": 1 + 2, side + "3_3": 1 + 2, side + "7_7": 1 + 1}


def test_a_map_that_grows_keeps_its_tiles(tmp_path, info, snapshot_at):
    cells = np.zeros((200, 200), np.uint8)
    cells[5, 5] = 254
    larger = np.zeros((300, 300), np.uint8)
    larger[100 + 5, 100 + 5] = larger[0, 0] = 254
    path = tmp_path / "a.rrd"
    sink = RerunSink(path, RecordingParameters(global_costmap_rate=5.0))
    sink.open(info)
    for time, grid in ((0.0, CostGrid(cells, 0.05)), (0.2, CostGrid(larger, 0.05, (-5.0, -5.0)))):
        layers = {"global_costmap": Layer(1 + round(time * 5), grid)}
        sink.snapshot(snapshot_at(time=time, layers=layers))
    sink.close(None)
    rows = rows_by_entity(path)
    tiles = {path: n for path, n in rows.items() if path.startswith("/world/global_costmap/")}
    # the first tile did not change; cell (0, 0) is now 100 cells lower left
    assert tiles == {"/world/global_costmap/0_0": 1 + 1, "/world/global_costmap/-1_-1": 1 + 1}


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
    assert dropped == []
    assert rows_by_entity(tmp_path / "a.rrd")["/mission"] == 1 + 2  # colours, running, error


def test_rerun_is_not_imported_before_it_is_needed():
    program = """
import sys
from stack.telemetry.rerun.sink import RerunSink
RerunSink("mission.rrd")
sys.exit("rerun" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


def test_rows_are_turned_for_the_screen_and_colours_are_quiet():
    cells = np.array([[0, 100], [-1, 0]], np.int8)
    picture = coloured(cells.view(np.uint8), map_table())
    assert picture.shape == (2, 2, 4) and picture[:, :, :3].max() < 170
    assert (picture[1, 1] > picture[0, 1])[:3].all()  # row 0 of the grid is at the bottom
    assert map_table()[OUTSIDE_MAP, 3] == 0
    costs = coloured(np.array([[0, 1, 252, 253, 254, 255]], np.uint8), cost_table("x"))
    assert costs[0, :, 3].tolist() == [0, 10, 95, 130, 130, 0]


def test_an_outline_is_closed_and_turned():
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    drawn = outline(Pose2D(10.0, 0.0, np.pi / 2), square, 0.5)
    assert np.allclose(drawn[0], (9.0, 1.0, 0.5)) and np.array_equal(drawn[0], drawn[-1])


def test_the_ellipse_contains_95_per_cent():
    # sqrt(5.991), the quantile of chi-square with two degrees of freedom, is 2.448 deviations.
    ellipse = uncertainty_ellipse(Pose2D(0.0, 0.0), np.diag([0.04, 0.01, 1.0]))
    assert np.allclose(np.abs(ellipse[:, :2]).max(axis=0), (0.4896, 0.2448))


def test_the_tree_as_text(snapshot_at, info):
    rows = (
        TreeRow(0, -1, "Patrol", "sequence", "running"),
        TreeRow(1, 0, "go_to *dock*", "navigate_to_pose", "failure", "no\nway"),
        TreeRow(2, 0, "wait", "wait", "running", "2 s"),
    )
    text = tree_markdown(snapshot_at(tree=rows), info)
    assert "- ▶ **Patrol**\n  - ✘ **go\\_to \\*dock\\*** *no way*\n  - ▶ **wait** *2 s*" in text
    assert activity(rows) == "wait" and activity(()) == NOTHING
