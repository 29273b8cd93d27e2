"""Poses of links for positions of joints: two ways to compute them agree."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from robots.urdf.model import RobotModel
from robots.urdf.reading import Attachment, UrdfSource, read_urdf
from stack.errors import Mark
from stack.frames.links import RobotLinks

ROBOT = read_robot(find_robot("fetcher", Path()))
PANDA = UrdfSource(read_robot(find_robot("panda_table", Path())).urdf)
ATTACHED = Attachment(PANDA, "base", (0.12, 0.0, 0.36), (0.0, 0.0, 0.0), Mark("robot.yaml"))
MODEL = RobotModel(read_urdf(UrdfSource(ROBOT.urdf, attached=(ATTACHED,)))[0])
NAMES = (*ROBOT.arm.joints, *ROBOT.arm.gripper.joints)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(-3.0, 3.0), min_size=len(NAMES), max_size=len(NAMES)))
def test_posed_links_are_where_the_chains_have_them(values):
    positions = dict(zip(NAMES, values, strict=True))
    links, posed = RobotLinks(ROBOT.links, "base"), MODEL.posed(positions)
    for name in MODEL.links:
        moving = {**positions, "left_wheel": 0.0, "right_wheel": 0.0}
        assert posed[name] == pytest.approx(links.pose(name, moving), abs=1e-12)
    for pose in posed.values():
        assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
