"""What an arm must not touch: names, the block in the hand, frames."""

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.geometry.rotations import from_angles
from stack.manipulation.scene import Box, SceneObject
from stack.navigation.capabilities.surroundings import Surroundings
from stack.types import Block

AT_MAP = from_angles((1.0, 2.0, 0.6), (0.0, 0.0, np.pi / 2.0))
"""map <- base link: an arm at (1, 2), 60 cm high, that looks along y of the map."""


def block(x, y, colour="red"):
    pose = from_angles((x, y, 0.025), (0.0, 0.0, 0.0))
    return Block(colour, pose, np.full(3, 0.05), np.zeros((4, 4)), 0.0)


def tool(x, y, z=0.03):
    return from_angles((x, y, z), (np.pi, 0.0, 0.0))


@pytest.fixture
def around():
    pose = from_angles((1.0, 2.5, 0.58), (0.0, 0.0, 0.0))
    return Surroundings([SceneObject("the bench", Box((1.2, 0.7, 0.04)), pose)])


def test_boxes_of_the_map_stand_in_the_frame_of_the_arm(around):
    scene = around.scene(np.linalg.inv(AT_MAP), np.eye(4))
    # 0.5 m along y of the map is 0.5 m ahead of the arm; the middle of the top is 2 cm below it.
    assert scene.objects[0].pose[:3, 3] == pytest.approx((0.5, 0.0, -0.02), abs=1e-12)
    pose, size = around.box("the bench", np.linalg.inv(AT_MAP))
    assert pose[:3, 3] == pytest.approx((0.5, 0.0, -0.02)) and size.tolist() == [1.2, 0.7, 0.04]
    with pytest.raises(ParameterError, match="no box of the world is called 'bench'"):
        around.box("bench", np.eye(4))


def test_names_are_unique_and_a_block_is_known_by_its_place(around):
    around.see([block(0.5, 0.0), block(0.6, 0.0), block(0.5, 0.2, "blue")], None)
    assert list(around.blocks) == ["red block", "red block 2", "blue block"]
    assert around.name_of(block(0.605, 0.0)) == "red block 2"
    assert around.name_of(block(0.4, 0.0)) == "red block 3"
    assert len(around.scene(np.eye(4), np.eye(4)).objects) == 5


def test_a_held_block_moves_with_the_tool_and_stays_where_it_is_released(around):
    around.see([block(0.5, 0.0)], None)
    around.hold(block(0.5, 0.0), tool(0.5, 0.0), 0.05)
    scene = around.scene(np.eye(4), np.eye(4))
    assert [item.name for item in scene.objects] == ["the bench"]
    assert (scene.held.name, scene.width) == ("red block", 0.05)
    # The block is 5 mm below the tool, which looks down: +5 mm along its z.
    assert scene.held.pose[:3, 3] == pytest.approx((0.0, 0.0, 0.005))
    around.see([block(0.3, 0.3), block(0.5, 0.0, "blue")], tool(0.3, 0.3))
    assert list(around.blocks) == ["blue block"], "what was seen in the hand is the held block"
    around.release(tool(0.4, -0.2))
    assert around.held is None
    assert around.blocks["red block"].pose[:3, 3] == pytest.approx((0.4, -0.2, 0.025))


def test_a_lost_block_is_nowhere(around):
    around.hold(block(0.5, 0.0), tool(0.5, 0.0), 0.05)
    around.lose()
    around.release(tool(0.4, -0.2))
    assert around.held is None and not around.blocks
