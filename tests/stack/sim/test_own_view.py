"""What a lidar sees of its robot: other links at its height, not the one it is in."""

from dataclasses import replace

import numpy as np
import pytest

from robots.load import HERE, read_robot
from stack.sim.physics.pybullet_engine.own_view import own_ranges
from stack.types import Pose2D
from tests.stack.sim.masted_robot import masted


def test_a_mast_is_seen_and_the_housing_is_not(tmp_path):
    """Closed form: half the angle of a circle of 2.5 cm at 40 cm is asin(1/16) = 3.6 degrees."""
    robot = read_robot(masted(tmp_path))
    ranges = own_ranges(robot.model, robot.lidar)
    seen = np.degrees(robot.lidar.angles[np.isfinite(ranges)])
    assert seen == pytest.approx(np.arange(-3.0, 4.0), abs=1e-9)
    assert ranges.min() == pytest.approx(0.375, abs=0.003)


@pytest.mark.parametrize("height", [0.1, 0.7])
def test_what_is_below_or_above_the_plane_is_not_seen(tmp_path, height):
    """The mast ends at 0.6 m; at 0.1 m the lidar would be inside the base, which is left out."""
    robot = read_robot(masted(tmp_path, length=0.2))  # from 0.2 m to 0.4 m
    lidar = replace(robot.lidar, height=height, mount=Pose2D(0.0, 0.0))
    beams = np.degrees(lidar.angles[np.isfinite(own_ranges(robot.model, lidar))])
    assert not (np.abs(beams) < 10.0).any()


def test_the_robots_of_treepilot_do_not_see_themselves():
    for file in HERE.glob("*/robot.yaml"):
        robot = read_robot(file)
        for lidar in robot.real_lidars.values():
            assert np.isinf(own_ranges(robot.model, lidar)).all()
