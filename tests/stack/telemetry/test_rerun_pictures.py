"""Depth pictures, their frustum and depth obstacles in a recording."""

from dataclasses import replace

import numpy as np

from tests.stack.perception.cameras.pictures import floor_picture
from tests.stack.telemetry.rerun_recording import drawn, rows_by_entity
from tests.stack.telemetry.synthetic_run import SyntheticRun


def test_depth_pictures_and_obstacles_are_drawn_once_a_second(tmp_path):
    run = SyntheticRun()
    points = np.array([[1.0, 2.0, 0.3], [1.1, 2.0, 0.0]], np.float32)
    shown = [  # 4 s at 5 Hz; a new picture and other points in each
        replace(
            run.snapshot_at(0.2 * n), depth_points=points + 0.01 * n,
            depth_image=floor_picture(0.2 * n, n),
        )
        for n in range(20)
    ]  # fmt: skip
    rows = rows_by_entity(drawn(tmp_path, run.info(), shown))
    assert rows["/world/depth/picture"] == 1 + 4  # its frame; 1 Hz
    assert rows["/world/depth/lens"] == rows["/world/depth/mount"] == 1
    assert rows["/world/depth_points"] == 1 + 4  # colour, size and frame
