"""The model of an arm from what the simulation loads: the frames are those of the robot."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import HERE, read_robot
from stack.frames.links import RobotLinks
from stack.manipulation.kinematics import ArmKinematics
from stack.manipulation.model import ArmModel

ROBOT = read_robot(HERE / "panda_table" / "robot.yaml")
LINKS = RobotLinks(ROBOT.links, "base")
KINEMATICS = ArmKinematics(ArmModel(ROBOT.model, ROBOT.arm, links=ROBOT.links))


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_the_tool_is_where_the_frames_of_the_robot_have_it(shares):
    limits = ROBOT.arm.limits
    positions = limits.lower + np.array(shares) * (limits.upper - limits.lower)
    base = LINKS.pose(ROBOT.arm.base_link, {})
    assert base[2, 3] == 0.6  # the column of the robot file
    expected = LINKS.chain(ROBOT.arm.tool_link).pose(positions)
    assert base @ KINEMATICS.forward(positions) == pytest.approx(expected, abs=1e-9)
