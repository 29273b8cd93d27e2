"""Places for the block in the hand: the first one above which the arm can lower it."""

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions
from stack.manipulation.places import place
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Box, Scene, SceneObject
from tests.stack.manipulation.panda import HOME, panda

PLANNER = ArmPlanner(panda())
ABOVE, WIDTH = 0.1, 0.056
DOWN = (np.pi, 0.0, 0.0)
TABLE = SceneObject("table", Box((1.0, 1.5, 0.05)), from_angles((0.6, 0.0, -0.025), (0, 0, 0)))
HELD = SceneObject("block", Box((0.04, 0.04, 0.04)), np.eye(4))


def tool(x, y):
    return from_angles((x, y, 0.026), DOWN)


def box(name, x, y, size):
    return SceneObject(name, Box(size), from_angles((x, y, size[2] / 2.0), (0, 0, 0)))


def chosen(tools, *objects):
    scene = Scene((TABLE, *objects), held=HELD, width=0.04)
    return place(PLANNER, tools, ABOVE, WIDTH, scene, HOME, np.random.default_rng(0)), scene


def test_the_first_one_where_nothing_stands_is_taken():
    """The first one is on a block, the second in a gap of 2 mm less than the fingers need."""
    lid = box("lid", 0.5, 0.1, (0.05, 0.05, 0.05))
    sides = [box(f"side {y}", 0.5, y, (0.3, 0.04, 0.06)) for y in (-0.25, -0.146)]
    tools = [tool(0.5, 0.1), tool(0.5, -0.198), tool(0.45, 0.3), tool(0.6, 0.3)]
    plan, scene = chosen(tools, lid, *sides)
    assert plan.tool is tools[2]
    end = PLANNER.kinematics.forward(plan.way.positions[-1])
    assert end[:3, 3] == pytest.approx((0.45, 0.3, 0.026 + ABOVE), abs=1e-4)
    assert plan.way.positions[0] == pytest.approx(HOME)
    checks = Collisions(panda(), scene)
    assert not any(map(checks.collides, plan.way.positions))
    PLANNER.straight(plan.way.positions[-1], plan.tool, scene)  # raises if it is not free


def test_without_a_place_the_reasons_are_counted():
    lid = box("lid", 0.5, 0.1, (0.05, 0.05, 0.05))
    with pytest.raises(NavigationError) as caught:
        chosen([tool(0.5, 0.1), tool(0.51, 0.1), tool(1.3, 0.0)], lid)
    assert str(caught.value) == (
        "NO_MOTION_PLAN: no place for the block: 2 blocked (block touches lid); 1 out of reach"
    )


def test_the_only_pose_that_was_asked_for_has_its_own_reason():
    with pytest.raises(NavigationError, match=r"UNREACHABLE: the arm cannot reach \(1.300"):
        chosen([tool(1.3, 0.0)])
