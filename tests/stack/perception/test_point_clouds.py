"""Point clouds that behaviours ask for."""

from dataclasses import replace

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.types import Image, Perceived
from tests.stack.navigation.test_capabilities import Rig
from tests.stack.perception.cameras.pictures import SCOUT, floor_picture


@pytest.fixture
def rig():
    made = Rig()
    yield made
    made.toy.navigator.close()


def with_depth_camera(rig):
    """Give the rig's robot the depth camera of scout."""
    object.__setattr__(rig.world.robot, "depth_cameras", SCOUT.depth_cameras)
    return rig.perception


def see(rig, picture):
    rig.now.see(Perceived(0.0, rig.world.estimate, measurements={"depth": picture}))


def test_a_cloud_is_that_of_the_newest_picture_since_the_camera_is_on(rig):
    perception = with_depth_camera(rig)
    see(rig, floor_picture(-0.1))
    assert perception.point_cloud() is None  # taken before anybody asked
    see(rig, floor_picture(0.0))
    cloud = perception.point_cloud("depth", voxel=0.1)
    assert cloud.stamp == 0.0 and np.abs(cloud.points[:, 2]).max() < 0.05
    assert len(perception.point_cloud("depth", voxel=0.1, above=0.06).points) == 0


def test_wrong_arguments_are_refused(rig):
    with pytest.raises(ParameterError, match="the robot has no depth camera"):
        rig.perception.point_cloud()
    perception = with_depth_camera(rig)
    with pytest.raises(ParameterError, match="unknown depth camera 'dept'"):
        perception.point_cloud("dept")
    with pytest.raises(ParameterError, match="expected more than 0 m, got 0"):
        perception.point_cloud(voxel=0.0)


def test_blocks_need_a_pair_of_pictures_of_one_time(rig):
    perception = with_depth_camera(rig)
    with pytest.raises(ParameterError, match="no colour camera"):
        perception.blocks()
    object.__setattr__(rig.world.robot, "camera", SCOUT.camera)
    colour = SCOUT.camera.model
    picture = Image(0.1, np.zeros((colour.height, colour.width, 3), np.uint8), colour)

    def seen(time, **pictures):
        rig.now.see(Perceived(time, rig.world.estimate, measurements=pictures))
        return perception.blocks()

    assert seen(0.0) is None
    assert seen(0.1, camera=picture) is None
    assert seen(0.2, camera=picture, depth=floor_picture(0.5)) is None  # 0.4 s apart
    assert seen(0.2, camera=picture, depth=floor_picture(0.2)) is None  # where was the base then?
    rig.world.frames.add(replace(rig.world.odometry, stamp=0.2))
    assert seen(0.2, camera=picture, depth=floor_picture(0.2)) == ()
    with pytest.raises(ParameterError, match="unknown depth camera 'hnd'"):
        perception.blocks("hnd")
