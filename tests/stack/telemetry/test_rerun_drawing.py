"""What is drawn for rerun of the snapshots of a run."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stack.telemetry.grid_colours import OUTSIDE_MAP, coloured, cost_table, map_table
from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.outlines import outline, uncertainty_ellipse
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Event, Layer, MissionState, TreeRow
from stack.telemetry.rerun.recorded import draw_recorded
from stack.telemetry.snapshots.log import SnapshotLog
from stack.telemetry.tree_text import NOTHING, activity, tree_markdown
from stack.types import CostGrid, Pose2D
from tests.stack.telemetry.rerun_recording import drawn, rerun, rows_by_entity
from tests.stack.telemetry.synthetic_run import SyntheticRun

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Twenty seconds of a run at twenty steps a second."""
    folder = tmp_path_factory.mktemp("rerun")
    run, dropped = SyntheticRun(), []
    sinks = [Recorder(RunFolder(folder)), SnapshotLog(folder / SNAPSHOTS, RecordingParameters())]
    telemetry = Telemetry(run.info(), sinks, dropped.append)
    for step in range(400):
        telemetry.advance(step, step * 0.05)
        if step % 100 == 0:
            telemetry.emit("say", f"step {step}", source="mission")
        telemetry.publish(lambda step=step: run.snapshot_at(step * 0.05))
    telemetry.close({"result": "success"})
    assert dropped == []
    draw_recorded(folder, folder / "mission.rrd")
    return folder / "mission.rrd"


def test_the_recording_is_sound_and_small(recording, tmp_path):
    indexed = tmp_path / "indexed.rrd"
    assert rerun("optimize", recording, "-o", indexed).returncode == 0  # adds the index
    verified = rerun("verify", indexed)
    assert verified.returncode == 0, verified.stderr
    assert recording.stat().st_size < 5_000_000 / 3  # at most 5 MB a minute
    assert [file.name for file in recording.parent.glob(".*")] == []


def test_each_change_is_drawn_and_constants_are_written_once(recording):
    rows = rows_by_entity(recording)
    assert rows["/world/robot_pose"] == 100  # 20 s at 5 Hz
    assert rows["/plots/speed"] == 1 + 100  # its legend
    assert rows["/world/scan"] == 1 + 100  # its colour, size and frame
    assert rows["/world/outline"] == 1  # follows the pose
    assert rows["/world/particles"] == 1 + 20  # 1 Hz
    assert rows["/world/local_plan"] == 1 + 100
    windows = [count for path, count in rows.items() if path.startswith("/world/local_costmap/")]
    shapes = len(windows)  # the window is clipped at walls; each shape is an entity
    assert sum(windows) == 20 + shapes + (shapes - 1)  # 1 Hz; constants; a change hides the other
    assert rows["/world/camera/picture"] == 1 + 20  # 1 Hz
    assert rows["/log/mission"] == 4
    assert rows["/activity"] == 3 + 3  # three phrases, and a colour table for each new one
    assert rows["/tree/006_to_the_meeting_room"] == 1 + 2  # colours, idle, running
    assert rows["/tree_text"] == 45 + 2  # "n m to go" until 9 s; at 9 and 12 s another node


def test_of_a_grid_only_the_changed_tiles_are_drawn(recording):
    rows = rows_by_entity(recording)
    tiles = {path: count for path, count in rows.items() if path.startswith("/world/map/")}
    assert tiles == {"/world/map/0_0": 1 + 1}  # one tile of 512 cells, once
    costs = [count for path, count in rows.items() if path.startswith("/world/global_costmap/")]
    assert costs and set(costs) == {1 + 1}  # a new version every 5 s, but the same cells


def test_the_robot_model_is_there(recording):
    rows = rows_by_entity(recording)
    assert "/world/rover/visual_geometries/base_link/visual_0" in rows
    assert rows["/world/joints"] == 3


def test_a_full_disk_leaves_the_last_recording_and_nothing_else(recording):
    """A limit of the file size, which fails as a full disk does, in the middle of a write."""
    program = """
import resource, signal, sys
from pathlib import Path
from stack.telemetry.rerun.recorded import draw_recorded
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
file = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    draw_recorded(file.parent, file)
except OSError as error:
    print(error.strerror)
"""
    before = recording.read_bytes()
    done = subprocess.run(
        [sys.executable, "-c", program, recording], capture_output=True, text=True, cwd=ROOT,
        check=False,
    )  # fmt: skip
    assert done.stdout == "File too large\n", done.stderr
    assert recording.read_bytes() == before
    assert [file.name for file in recording.parent.glob(".*")] == []


def tiles_of(recording):
    rows = rows_by_entity(recording)
    return {path: n for path, n in rows.items() if path.startswith("/world/global_costmap/")}


def test_a_changed_corner_of_a_large_costmap_costs_one_tile(tmp_path, info, snapshot_at):
    cells = np.zeros((1000, 1000), np.uint8)
    cells[10, 10] = cells[500, 500] = 254
    shown = []

    def show(version, *changes):
        layer = Layer(version, CostGrid(cells.copy(), 0.05), changes)
        time = 2.0 * len(shown)  # a global costmap is recorded at most so often
        shown.append(snapshot_at(time=time, layers={"global_costmap": layer}))

    show(1)
    cells[990, 990] = 100
    show(2, (2, (980, 1000, 980, 1000)))
    cells[500, 500] = 0
    show(4, (4, (500, 501, 500, 501)))  # version 3 is not known: recorded as a whole
    side = "/world/global_costmap/"
    assert tiles_of(drawn(tmp_path, info, shown)) == {
        side + "0_0": 1 + 1, side + "3_3": 1 + 2, side + "7_7": 1 + 1,
    }  # fmt: skip


def test_a_map_that_grows_keeps_its_tiles(tmp_path, info, snapshot_at):
    cells = np.zeros((200, 200), np.uint8)
    cells[5, 5] = 254
    larger = np.zeros((300, 300), np.uint8)
    larger[100 + 5, 100 + 5] = larger[0, 0] = 254
    grids = CostGrid(cells, 0.05), CostGrid(larger, 0.05, (-5.0, -5.0))
    shown = [
        snapshot_at(time=2.0 * n, layers={"global_costmap": Layer(n + 1, grid)})
        for n, grid in enumerate(grids)
    ]
    # the first tile did not change; cell (0, 0) is now 100 cells lower left
    assert tiles_of(drawn(tmp_path, info, shown)) == {
        "/world/global_costmap/0_0": 1 + 1, "/world/global_costmap/-1_-1": 1 + 1,
    }  # fmt: skip


def test_a_run_with_little_to_show_is_drawn_too(tmp_path, info, snapshot_at):
    bare = {
        "particles": None, "scan": None, "path": None, "goal": None, "layers": {}, "image": None,
        "truth": None, "people": None, "tracks": (), "tree": (), "covariance": np.zeros((3, 3)),
    }  # fmt: skip
    empty = {"people": np.empty((0, 3)), "particles": np.empty((0, 3), np.float32)}
    recording = drawn(tmp_path, info, [
        snapshot_at(time=0.0, **bare), snapshot_at(time=0.2),
        snapshot_at(time=0.4, **(bare | empty)), snapshot_at(time=0.6, state=MissionState.ERROR),
    ])  # fmt: skip
    assert rows_by_entity(recording)["/mission"] == 1 + 2  # colours, running, error


def test_a_lane_shows_what_held_the_robot(tmp_path, info, snapshot_at):
    """A person from 2 s on, an obstacle from 3 s on, each told a second later."""
    told = [
        (3.0, "held", "person", 2.0), (4.0, "held", "obstacle", 3.0),
        (5.0, "held_end", "person", 2.0), (7.5, "held_end", "obstacle", 3.0),
    ]  # fmt: skip
    events = [
        Event(n, n, time, "info", "safety", kind, kind, {"cause": cause, "begin": begin})
        for n, (time, kind, cause, begin) in enumerate(told)
    ]
    recording = drawn(tmp_path, info, [snapshot_at(time=8.0)], events)
    printed = rerun("print", "-vvv", "--entity", "/held", recording).stdout
    for state in ("held: person", "held: obstacle, person", "held: obstacle"):
        assert f"[{state}]" in printed
    # a table of colours for each of four states; person, both, obstacle, nothing, and the begin
    assert rows_by_entity(recording)["/held"] == 4 + 5


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
    assert "- ▶ **Patrol**\n  - ✗ **go\\_to \\*dock\\*** *no way*\n  - ▶ **wait** *2 s*" in text
    assert activity(rows) == "wait" and activity(()) == NOTHING
