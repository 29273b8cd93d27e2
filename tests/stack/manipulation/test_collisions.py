"""Distances and contacts, with numbers from the shapes' own geometry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions, Nearest
from stack.manipulation.kinematics import ArmKinematics
from stack.manipulation.scene import (
    Box,
    Capsule,
    Cylinder,
    Scene,
    SceneObject,
    ScenePoints,
    Sphere,
)
from tests.benchmarks.arm_planning import scene_of
from tests.stack.manipulation.panda import HOME, LIMITS, panda, posed

TIP = ArmKinematics(panda()).forward(HOME)[:3, 3]
"""Between the finger tips, which point down and end at its height: (0.307, 0, 0.485)."""


def at(x, y, z):
    return from_angles((x, y, z), (0, 0, 0))


def below(shape, half):
    """A body 5 cm below the tool, wide enough for both fingers."""
    return SceneObject("body", shape, at(TIP[0], TIP[1], TIP[2] - 0.05 - half))


def checks(*objects, clearance=0.0, **scene):
    return Collisions(panda(), Scene(objects, **scene), clearance)


SHAPES = [
    (Box((0.2, 0.3, 0.1)), 0.05),
    (Cylinder(0.2, 0.1), 0.05),
]


@pytest.mark.parametrize(("shape", "half"), SHAPES)
def test_distance_below_the_fingers(shape, half):
    """The finger's mesh ends 0.1122 m beyond the hand's frame, the tool is at 0.105 m."""
    found = checks(below(shape, half)).nearest(HOME)
    assert found.link.endswith("finger") and found.other == "body"
    assert found.distance == pytest.approx(0.05 - 0.0072, abs=1e-3)


@pytest.mark.parametrize("shape", [Sphere(0.05), Capsule(0.05, 0.2)])
def test_distance_beside_the_hand(shape):
    """A body at 0.4 m from the hand's axis: the hand is at most 0.11 m wide there."""
    body = SceneObject("body", shape, at(TIP[0], 0.4, TIP[2] + 0.07))
    assert 0.4 - 0.05 - 0.13 < checks(body).distance(HOME) < 0.4 - 0.05 - 0.09


def test_contacts_have_names():
    body = SceneObject("table", Box((0.2, 0.2, 0.1)), at(TIP[0], TIP[1], TIP[2] - 0.05))
    touched = checks(body).contact(HOME)
    assert touched.endswith("finger touches table")
    near = checks(below(Box((0.2, 0.3, 0.1)), 0.05), clearance=0.06).contact(HOME)
    assert near.endswith("finger is 42.8 mm from body")
    assert checks(below(Box((0.2, 0.3, 0.1)), 0.05)).contact(HOME) == ""


def test_the_arm_touches_itself():
    folded = np.array([0.0, -1.7, 0.0, -3.0, 0.0, 0.6, 0.0])
    assert checks().contact(folded) == "panda_link1 touches panda_hand"
    assert checks().contact(HOME) == ""


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_a_pose_collides_where_the_distance_is_below_the_clearance(seed):
    """The quick test with the broad phase, beside the distances of all pairs."""
    generator = np.random.default_rng(seed)
    scene = scene_of(generator)
    positions = generator.uniform(LIMITS.lower, LIMITS.upper)
    quick = Collisions(panda(), scene, 0.03)
    if Collisions(panda(), Scene(), 0.03).collides(positions):  # with itself
        assert quick.collides(positions)
    else:
        distance = quick.distance(positions)
        assert quick.collides(positions) == (distance < 0.03) or abs(distance - 0.03) < 1e-4


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10_000))
def test_a_free_motion_is_free_between_its_checks(seed):
    generator = np.random.default_rng(seed)
    quick = Collisions(panda(), scene_of(generator), 0.01)
    start, end = generator.uniform(LIMITS.lower, LIMITS.upper, (2, 7))
    end = start + 0.3 * (end - start)
    if quick.is_free(start, end) and not quick.collides(start):
        touching = quick.with_clearance(0.0)
        for part in np.linspace(0.0, 1.0, 23):
            assert touching.distance(start + part * (end - start)) > 0.0


def test_points_are_occupied_cells():
    """A patch of points 5 cm below the tool, in cells of 2 cm."""
    x, y = np.meshgrid(np.arange(-0.1, 0.1, 0.01), np.arange(-0.15, 0.15, 0.01))
    points = np.column_stack(
        (TIP[0] + x.ravel(), TIP[1] + y.ravel(), np.full(x.size, TIP[2] - 0.05))
    )
    found = checks(points=(ScenePoints("depth", points),)).nearest(HOME)
    assert found.other == "depth"
    assert found.distance == pytest.approx(0.05 - 0.0072, abs=0.02)
    assert checks(points=(ScenePoints("depth", points[:0]),)).distance(HOME) == np.inf


def test_a_moving_object_is_where_its_velocity_takes_it():
    body = SceneObject(
        "cart", Box((0.1, 0.1, 0.1)), at(TIP[0], 1.0, TIP[2]), np.array([0.0, -0.5, 0.0])
    )
    found = checks(body)
    assert not found.collides(HOME, 0.0)
    assert found.contact(HOME, 2.0).endswith("touches cart")
    assert not found.collides(HOME, 0.0)


def test_what_is_held_moves_with_the_tool():
    block = SceneObject("block", Box((0.04, 0.04, 0.3)), at(TIP[0], TIP[1], TIP[2] - 0.1))
    floor = SceneObject("floor", Box((0.6, 2, 0.1)), at(0.5, 0, TIP[2] - 0.35))
    scene = Scene((block, floor)).holding("block", ArmKinematics(panda()).forward(HOME), 0.04)
    assert Collisions(panda(), scene).nearest(HOME) == Nearest(
        pytest.approx(0.05, abs=1e-6), "block", "floor"
    )
    lowered = posed(0, 0.3, 0, 0, 0, 0.3, 0)
    assert "block touches floor" in Collisions(panda(), scene).contact(lowered)
    moved = ArmKinematics(panda()).forward(lowered)
    placed = scene.released(moved)
    expected = moved @ np.linalg.inv(ArmKinematics(panda()).forward(HOME)) @ block.pose
    assert placed.objects[-1].pose == pytest.approx(expected)
    assert placed.held is None


def test_wanted_contacts():
    body = SceneObject("block", Box((0.2, 0.2, 0.02)), at(TIP[0], TIP[1], TIP[2] - 0.01))
    scene = Scene((body,))
    assert Collisions(panda(), scene).collides(HOME)
    fingers = (("panda_leftfinger", "block"), ("panda_rightfinger", "block"))
    assert not Collisions(panda(), scene.touching(*fingers)).collides(HOME)
