"""A map that is loaded during a run: the filter goes on in the frame of the new map."""

from dataclasses import replace
from pathlib import Path

import pytest

from stack.types import Pose2D
from tests.benchmarks.localisation import Drive

SHIFT = Pose2D(20.0, -5.0)


@pytest.mark.parametrize("known", [True, False])
def test_the_pose_is_that_in_the_new_map(known):
    drive = Drive("office", 3, people=0)
    for _ in drive.run(2.0):
        pass
    ground = drive.robot.place
    x, y = ground.grid.origin
    moved = replace(ground.grid, origin=(x + SHIFT.x, y + SHIFT.y))
    drive.filter.load_map(moved, Path(), SHIFT.compose(drive.robot.pose) if known else None)
    for _ in drive.run(10.0):
        pass
    there = SHIFT.compose(drive.robot.pose)
    # 7 cm is the largest error in the office without people, with the pose known from the start
    assert drive.filter.estimate.pose.distance_to(there) < 0.1
