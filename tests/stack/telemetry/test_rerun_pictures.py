"""Depth pictures, their frustum and depth obstacles in a recording."""

from dataclasses import replace

import numpy as np

from stack.telemetry.rerun.sink import RerunSink
from tests.stack.perception.cameras.pictures import floor_picture
from tests.stack.telemetry.synthetic_run import SyntheticRun
from tests.stack.telemetry.test_rerun_sink import rerun, rows_by_entity


def test_depth_pictures_and_obstacles_are_recorded_twice_a_second(tmp_path):
    path, run = tmp_path / "mission.rrd", SyntheticRun()
    sink = RerunSink(path)
    sink.open(run.info())
    points = np.array([[1.0, 2.0, 0.3], [1.1, 2.0, 0.0]], np.float32)
    for n in range(20):  # 4 s at 5 Hz; a new picture in each
        time = 0.2 * n
        snapshot = replace(
            run.snapshot_at(time), depth_points=points, depth_image=floor_picture(time, n)
        )
        sink.snapshot(snapshot)
    sink.close({"result": "success"})
    rows = rows_by_entity(path)
    assert rows["/world/depth/picture"] == 1 + 8  # its frame; 2 Hz
    assert rows["/world/depth/lens"] == rows["/world/depth/mount"] == 1
    assert rows["/world/depth_points"] == 1 + 8  # colour, size and frame
    indexed = tmp_path / "indexed.rrd"
    assert rerun("optimize", path, "-o", indexed).returncode == 0
    assert rerun("verify", indexed).returncode == 0
