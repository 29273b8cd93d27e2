"""The area that an outline sweeps along a constant twist."""

from itertools import pairwise
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.drivetrain.kinematics import moved, poses_along, swept_poses
from stack.types import Pose2D, Twist

CORNERS = np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]])
RADIUS = hypot(0.3, 0.2)

speeds = st.floats(-1.5, 1.5)


@given(speeds, speeds, speeds, st.floats(0.05, 2.0))
def test_no_corner_moves_further_than_the_spacing(linear, angular, lateral, amount):
    start, twist = Pose2D(1.0, -2.0, 0.7), Twist(linear, angular, lateral)
    amounts, poses = swept_poses(start, twist, amount, RADIUS, 0.05)
    assert amounts[-1] == amount
    path = [start, *(Pose2D(*map(float, pose)) for pose in poses)]
    for before, after in pairwise(path):
        steps = after.transform(CORNERS) - before.transform(CORNERS)
        assert np.hypot(*steps.T).max() <= 0.05 + 1e-9


def test_the_last_pose_is_the_displacement_by_the_twist():
    start, twist = Pose2D(1.0, -2.0, 0.7), Twist(0.4, 0.8, -0.2)
    _, poses = swept_poses(start, twist, 1.5, RADIUS, 0.02)
    end = start.compose(moved(twist, 1.5))
    assert poses[-1] == pytest.approx((end.x, end.y, end.heading))


@pytest.mark.parametrize("angular", [0.0, 1e-12, 0.8, -2.0])
def test_poses_along_a_twist_are_those_of_single_motions(angular):
    start, twist = Pose2D(1.0, -2.0, 0.7), Twist(0.5, angular, 0.2)
    times = np.linspace(0.0, 2.0, 5)
    single = [start.compose(moved(twist, time)) for time in times]
    expected = [(pose.x, pose.y) for pose in single]
    poses = poses_along(start, twist, times)
    assert np.allclose(poses[:, :2], expected, atol=1e-12)
    assert np.allclose(poses[:, 2], 0.7 + angular * times)
