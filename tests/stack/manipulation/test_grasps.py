"""Grasps of blocks on a table."""

from itertools import pairwise

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions
from stack.manipulation.grasps import APPROACH, LIFT, PAD, SHALLOW, candidates, grasps
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Box, Scene, SceneObject, Sphere
from stack.types import FailureCode
from tests.stack.manipulation.panda import HOME, panda

PLANNER = ArmPlanner(panda())
FINGERS = (("panda_leftfinger", "block"), ("panda_rightfinger", "block"))
TABLE = SceneObject("table", Box((1.0, 1.5, 0.05)), from_angles((0.6, 0.0, -0.025), (0, 0, 0)))


def block(size, x=0.5, y=0.1, yaw=0.3, name="block"):
    return SceneObject(name, Box(size), from_angles((x, y, size[2] / 2.0), (0, 0, yaw)))


def found(*objects):
    return grasps(PLANNER, "block", Scene((TABLE, *objects)), HOME, np.random.default_rng(0))


def test_poses_of_the_tool():
    """Ten for the five faces, each with the fingers either way round."""
    item = block((0.04, 0.05, 0.12))
    poses = list(candidates(item))
    assert len(poses) == 20
    for candidate in poses:
        assert np.linalg.det(candidate.tool[:3, :3]) == pytest.approx(1.0)
    above = [candidate for candidate in poses if candidate.name.startswith("from above")]
    assert len(above) == 4
    for candidate in above:
        assert candidate.tool[:3, 2] == pytest.approx([0, 0, -1])
        assert candidate.tool[:3, 3] == pytest.approx([0.5, 0.1, 0.12 - 0.03])
    widths = {candidate.name: candidate.width for candidate in above}
    assert widths == {"from above, fingers along x": 0.04, "from above, fingers along y": 0.05}


def test_a_cube_on_a_table():
    first = found(block((0.04, 0.04, 0.04)))[0]
    assert first.name.startswith("from above") and first.width == 0.04
    forward = PLANNER.kinematics.forward
    before, at, above = (forward(q) for q in (first.pre_grasp, first.approach[-1], first.lift[-1]))
    assert at == pytest.approx(first.tool, abs=1e-4)
    assert before[2, 3] - at[2, 3] == pytest.approx(APPROACH, abs=1e-4)
    assert above[2, 3] - at[2, 3] == pytest.approx(LIFT, abs=1e-4)
    assert first.approach[0] == pytest.approx(first.pre_grasp)
    assert first.lift[0] == pytest.approx(first.approach[-1])


def test_a_block_is_picked_and_placed():
    """Each motion begins where the one before ends; the block ends where it was wanted, 2 mm up."""
    scene, draw = Scene((TABLE, block((0.04, 0.04, 0.08)))), np.random.default_rng(0)
    grasp = grasps(PLANNER, "block", scene, HOME, draw)[0]
    turn = from_angles((0, 0, 0), (0, 0, 0.5))
    goal = turn @ scene.objects[1].pose
    goal[2, 3] += 0.002
    tool = goal @ np.linalg.inv(grasp.holding.held.pose)
    above = tool.copy()
    above[2, 3] += LIFT
    carry = PLANNER.plan_to_pose(grasp.lift[-1], above, grasp.holding, draw)
    lower = PLANNER.straight(carry[-1], tool, grasp.holding)
    placed = grasp.holding.released(PLANNER.kinematics.forward(lower[-1]))
    back = PLANNER.straight(lower[-1], above, placed.touching(*FINGERS))
    motions = [
        PLANNER.trajectory(path, surroundings)
        for path, surroundings in (
            (PLANNER.plan(HOME, [grasp.pre_grasp], scene, draw), scene),
            (grasp.approach, grasp.approaching),
            (grasp.lift, grasp.lifting),
            (carry, grasp.holding),
            (lower, grasp.holding),
            (back, placed.touching(*FINGERS)),
        )
    ]
    for first, second in pairwise(motions):
        assert second.positions[0] == pytest.approx(first.positions[-1])
    assert placed.objects[-1].pose == pytest.approx(goal, abs=1e-4)


def test_the_fingers_lie_along_the_block_and_touch_nothing_else():
    """A block that fits one way only, with a neighbour 1 cm beside it along the other axis."""
    item = block((0.04, 0.12, 0.04), yaw=0.0)
    neighbour = block((0.04, 0.04, 0.1), y=0.19, yaw=0.0, name="neighbour")
    options = found(item, neighbour)
    assert {grasp.name for grasp in options} <= {
        "from above, fingers along x",
        "from -y, fingers along x",
        "from +y, fingers along x",
    }
    assert [grasp.cost for grasp in options] == sorted(grasp.cost for grasp in options)
    scene = Scene((TABLE, neighbour))
    for grasp in options:
        assert all(not Collisions(panda(), scene).collides(q) for q in grasp.approach)


def test_a_neighbour_takes_the_room_of_the_fingers():
    """A cube with neighbours 1 cm beside it along x: only fingers along y remain from above."""
    sides = [block((0.04, 0.04, 0.06), x=0.5 + way, yaw=0.0, name=f"side {way}")
             for way in (-0.05, 0.05)]  # fmt: skip
    options = found(block((0.04, 0.04, 0.04), yaw=0.0), *sides)
    assert options
    assert {grasp.name for grasp in options} == {"from above, fingers along y"}


def test_what_cannot_be_grasped():
    with pytest.raises(NavigationError, match=r"no grasp of block: 20 wider .* \(80 mm\)"):
        found(block((0.1, 0.1, 0.1)))
    with pytest.raises(NavigationError, match="out of reach"):
        found(block((0.04, 0.04, 0.04), x=1.1))
    lid = SceneObject("lid", Box((0.4, 0.4, 0.02)), from_angles((0.5, 0.1, 0.08), (0, 0, 0)))
    with pytest.raises(NavigationError, match=r"blocked \(panda_\w+ touches lid\)") as caught:
        found(block((0.04, 0.04, 0.04)), lid)
    assert caught.value.failure.code == FailureCode.NO_MOTION_PLAN


def test_what_is_no_block():
    ball = SceneObject("block", Sphere(0.02), from_angles((0.5, 0, 0.02), (0, 0, 0)))
    with pytest.raises(NavigationError, match="block is not a box"):
        found(ball)
    with pytest.raises(NavigationError, match="no object 'block'") as caught:
        found()
    assert caught.value.failure.code == FailureCode.OBJECT_NOT_FOUND


def test_a_cube_between_higher_blocks_is_grasped_near_its_top_with_little_opened_fingers():
    """The hand is some 4 cm above the tool: in the middle of 5 cm it would touch blocks of 8 cm.

    Open fingers reach 1 cm farther than those that are opened for a cube of 5 cm.
    """
    high = (0.04, 0.04, 0.08)
    beside = [block(high, y=y, yaw=0.0, name=f"beside {y}") for y in (0.045, 0.155)]
    before = block(high, x=0.582, yaw=0.0, name="before")
    first = found(block((0.05, 0.05, 0.05), yaw=0.0), *beside, before)[0]
    assert first.name == "from above, fingers along x"
    assert first.tool[2, 3] == pytest.approx(0.05 - SHALLOW)
    assert first.opening == pytest.approx(0.06)
    alone = found(block((0.05, 0.05, 0.05), yaw=0.0))[0]
    assert alone.tool[2, 3] == pytest.approx(0.025) and alone.opening == pytest.approx(0.08)


def test_a_long_block_at_a_high_one_is_grasped_at_its_free_end():
    """Over its middle the hand, 20 cm long along the fingers, would touch the block of 8 cm."""
    flat = block((0.08, 0.03, 0.04), yaw=0.0)
    high = block((0.04, 0.04, 0.08), x=0.53, y=0.165, yaw=0.0, name="high")
    first = found(flat, high)[0]
    assert first.name == "from above, fingers along y"
    assert first.tool[0, 3] == pytest.approx(0.5 - (0.04 - PAD))
    assert found(flat)[0].tool[0, 3] == pytest.approx(0.5)


def test_a_neighbour_higher_than_the_block_is_passed_by_a_tilted_hand():
    """The block opens the fingers along its width only, and the hand, 20 cm wide, is lower at a
    grasp than the neighbour 3 cm beside that side. A tilted grasp keeps the fingers at the faces.
    """
    item = block((0.08, 0.03, 0.04), yaw=0.0)
    neighbour = block((0.04, 0.04, 0.08), y=0.1 + 0.015 + 0.03 + 0.02, yaw=0.0, name="neighbour")
    options = found(item, neighbour)
    assert {grasp.name for grasp in options} == {"from above, fingers along y, tilted"}
    for grasp in options:
        assert grasp.tool[:3, 1] == pytest.approx([0, np.sign(grasp.tool[1, 1]), 0])
        tilt = np.degrees(np.arccos(-grasp.tool[2, 2]))
        assert min(abs(tilt - 25.0), abs(tilt - 50.0)) < 1e-6
        checks = Collisions(panda(), Scene((TABLE, neighbour), width=grasp.opening))
        assert not any(map(checks.collides, grasp.approach))
