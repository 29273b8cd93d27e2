"""What an arm must not touch: names, the block in the hand, frames."""

from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.errors import ParameterError
from stack.geometry.rotations import from_angles
from stack.manipulation.scene import Box, Cylinder, SceneObject
from stack.navigation.capabilities.surroundings import Surroundings, reach_of
from stack.types import Block

AT_MAP = from_angles((1.0, 2.0, 0.6), (0.0, 0.0, np.pi / 2.0))
"""map <- base link: an arm at (1, 2), 60 cm high, that looks along y of the map."""


def block(x, y, colour="red"):
    pose = from_angles((x, y, 0.025), (0.0, 0.0, 0.0))
    return Block(colour, pose, np.full(3, 0.05), np.zeros((4, 4)), 0.0)


def tool(x, y, z=0.03):
    return from_angles((x, y, z), (np.pi, 0.0, 0.0))


def see(around, blocks, gone=(), tool=None):
    return around.see(blocks, gone, tool, np.eye(4))


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
    see(around, [block(0.5, 0.0), block(0.6, 0.0), block(0.5, 0.2, "blue")])
    assert list(around.blocks) == ["red block", "red block 2", "blue block"]
    assert around.name_of(block(0.605, 0.0)) == "red block 2"
    assert around.name_of(block(0.4, 0.0)) == "red block 3"
    assert len(around.scene(np.eye(4), np.eye(4)).objects) == 5


def test_a_held_block_moves_with_the_tool_and_stays_where_it_is_released(around):
    see(around, [block(0.5, 0.0)])
    around.hold(block(0.5, 0.0), tool(0.5, 0.0), 0.05)
    scene = around.scene(np.eye(4), np.eye(4))
    assert [item.name for item in scene.objects] == ["the bench"]
    assert (scene.held.name, scene.width) == ("red block", 0.05)
    # The block is 5 mm below the tool, which looks down: +5 mm along its z.
    assert scene.held.pose[:3, 3] == pytest.approx((0.0, 0.0, 0.005))
    see(around, [block(0.3, 0.3), block(0.5, 0.0, "blue")], tool=tool(0.3, 0.3))
    assert list(around.blocks) == ["blue block"], "what was seen in the hand is the held block"
    around.release(tool(0.4, -0.2))
    assert around.held is None
    assert around.blocks["red block"].pose[:3, 3] == pytest.approx((0.4, -0.2, 0.025))


def test_a_lost_block_is_nowhere(around):
    around.hold(block(0.5, 0.0), tool(0.5, 0.0), 0.05)
    around.lose()
    around.release(tool(0.4, -0.2))
    assert around.held is None and not around.blocks


def test_a_block_that_is_not_found_again_stays_known_until_it_is_gone(around):
    first, second = block(0.5, 0.0), block(0.5, 0.2, "blue")
    see(around, [first, second])
    see(around, [block(0.515, 0.01)])  # the red one, by a worse picture; the blue one is hidden
    assert {it.colour: it.pose[0, 3] for it in around.blocks.values()} == {
        "red": 0.515, "blue": 0.5,
    }  # fmt: skip
    see(around, [], gone=[second])
    assert [it.colour for it in around.blocks.values()] == ["red"]


def test_a_part_of_a_box_is_no_block(around):
    # The bench of the fixture is 4 cm high, its middle at (1.0, 2.5, 0.58) of the base link.
    in_bench, on_bench = block(1.1, 2.5), block(1.1, 2.4)
    in_bench.pose[2, 3], on_bench.pose[2, 3] = 0.59, 0.625
    assert see(around, [in_bench, on_bench]) == (on_bench,)
    assert list(around.blocks.values()) == [on_bench]


def test_what_is_out_of_reach_is_left_out_of_the_scene():
    far = SceneObject("a far wall", Box((0.1, 4.0, 2.0)), from_angles((3.0, 0.0, 1.0), (0, 0, 0)))
    near = SceneObject("a near wall", Box((0.1, 4.0, 2.0)), from_angles((0.9, 1.5, 1.0), (0, 0, 0)))
    drum = SceneObject("a drum", Cylinder(0.3, 1.0), from_angles((0.0, 1.5, 0.0), (0, 0, 0)))
    around = Surroundings([far], [near, drum], reach=0.8)
    # Up to 0.8 + 0.5 m: the faces of the walls are at 2.95 and 0.85 m, the drum's at 1.2 m.
    names = [item.name for item in around.scene(np.eye(4), np.eye(4)).objects]
    assert names == ["a near wall", "a drum"]
    moved = from_angles((-2.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # the base stands at x = 2 m
    names = [item.name for item in around.scene(moved, np.eye(4)).objects]
    assert names == ["a far wall", "a near wall"]


def test_objects_of_the_map_are_wider_by_the_doubt_about_the_pose(around):
    far = SceneObject("wall", Box((0.1, 4.0, 2.0)), from_angles((1.05, 0.0, 1.0), (0, 0, 0)))
    post = SceneObject("post", Cylinder(0.05, 1.0), from_angles((0.0, 0.0, 0.5), (0, 0, 0)))
    near = Surroundings([], [far, post])
    see(near, [block(0.5, 0.0)])
    wall, post, red = near.scene(np.eye(4), np.eye(4), None, (0.03, 0.04)).objects
    # Two deviations: of 3 cm and, 1 m away, of 4 cm; the hypotenuse is 5 cm.
    assert wall.shape.size == pytest.approx((0.1 + 0.2, 4.0 + 0.2, 2.0))
    assert post.shape.radius == pytest.approx(0.05 + 0.06) and post.shape.length == 1.0
    assert red.shape.size == (0.05, 0.05, 0.05)
    [wall, *_] = near.scene(np.eye(4), np.eye(4), None, (9.0, 9.0)).objects
    assert wall.shape.size[0] == pytest.approx(0.1 + 0.2), "at most 10 cm on each side"


def test_the_reach_of_an_arm_is_the_length_of_its_links():
    # Of the Panda: 0.333 + 0.316 + 2 x 0.0825 + 0.384 (0.393 with its offset) + 0.088 + 0.107 +
    # 0.105 m; each joint counts with the straight distance to the one before.
    robot = read_robot(find_robot("panda_table", Path()))
    joints = (0.333, 0.316, 0.0825, np.hypot(0.0825, 0.384), 0.088, 0.107, 0.105)
    assert reach_of(robot) == pytest.approx(sum(joints), abs=1e-3)
    assert reach_of(read_robot(find_robot("scout", Path()))) == 0.0
