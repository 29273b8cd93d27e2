"""The fit of a lidar's mount on drives without noise, where the answer is exact."""

from math import radians
from pathlib import Path

import numpy as np
import pytest

from missions.commissioning.lidar_fit import MountProblem, carried, missing_drives
from missions.commissioning.recording import Drive, Track
from missions.commissioning.segments import chained, segments_of
from missions.execution.resources import load_robot
from stack.localisation.planar import as_row
from stack.types import Pose2D

STRAIGHT, LEFT, RIGHT = (0.02, 0.0, 0.0), (0.0, 0.0, 0.03), (0.0, 0.0, -0.03)
ROBOT = load_robot("scout", Path.cwd())


def seen_by_a_lidar(motions, *, true, described):
    """Segments of a drive; the reference has the described mount in place of the true one."""
    path = np.concatenate([np.tile(motion, (steps, 1)) for motion, steps in motions])
    stamps, poses = 0.05 * np.arange(len(path) + 1), chained(path)
    wrong = true.compose(described.inverse())
    rows = [Pose2D(*row).compose(wrong) for row in poses.tolist()]
    placed = np.array([as_row(pose) for pose in rows])
    placed[:, 2] = np.unwrap(placed[:, 2])
    return segments_of(Drive(ROBOT, Track(stamps, poses), np.zeros((0, 2)), Track(stamps, placed)))


def test_a_displacement_is_carried_by_a_mount():
    mount, motion = Pose2D(0.2, -0.1, 0.4), Pose2D(0.3, 0.05, -0.7)
    expected = mount.compose(motion).compose(mount.inverse())
    found = carried(as_row(motion)[None], as_row(mount))[0]
    assert found == pytest.approx(as_row(expected), abs=1e-12)


def test_the_mount_is_found():
    true, described = Pose2D(0.12, 0.03, radians(170.0)), Pose2D(0.10, 0.0, radians(180.0))
    square = [(STRAIGHT, 100), (LEFT, 52), (STRAIGHT, 100), (RIGHT, 104), (LEFT, 210)]
    segments = seen_by_a_lidar(square * 4, true=true, described=described)
    mount, deviations = MountProblem(segments, ROBOT, described).solve()
    assert mount[:2] == pytest.approx((0.12, 0.03), abs=1e-4)  # the weak prior pulls by 1e-5
    assert mount[2] == pytest.approx(radians(170.0), abs=1e-3)
    assert missing_drives("lidar", deviations, segments) == ()


@pytest.mark.parametrize(
    ("motions", "missing"),
    [
        ([(STRAIGHT, 4000)], "position of lidar"),
        ([(LEFT, 2000), (RIGHT, 2000)], "yaw of lidar"),
    ],
)
def test_what_the_drive_does_not_show_is_named(motions, missing):
    segments = seen_by_a_lidar(motions, true=Pose2D(0.1, 0.0), described=Pose2D(0.1, 0.0))
    _, deviations = MountProblem(segments, ROBOT, Pose2D(0.1, 0.0)).solve()
    assert any(text.startswith(missing) for text in missing_drives("lidar", deviations, segments))
