"""An arm of another make: on a rover, with an endless joint, a slide, and no gripper."""

import numpy as np
import pytest

from stack.drivetrain.arm_description import ArmDescription, JointLimits
from stack.errors import NavigationError
from stack.geometry.rotations import from_angles
from stack.manipulation.collisions import Collisions
from stack.manipulation.grasps import grasps
from stack.manipulation.model import ArmModel
from stack.manipulation.planner import ArmPlanner
from stack.manipulation.scene import Box, Scene, SceneObject

URDF = """
<robot name="rover">
  <link name="chassis">
    <collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision>
    <collision><origin xyz="0.2 0 0.5"/>
      <geometry><cylinder radius="0.06" length="1"/></geometry></collision>
  </link>
  <link name="wheel">
    <collision><geometry><cylinder radius="0.1" length="0.05"/></geometry></collision>
  </link>
  <joint name="axle" type="continuous">
    <parent link="chassis"/><child link="wheel"/><origin xyz="0 0.25 0"/><axis xyz="0 1 0"/>
  </joint>
  <link name="mount"/>
  <joint name="bolts" type="fixed">
    <parent link="chassis"/><child link="mount"/><origin xyz="0.2 0 0.1" rpy="0 0 1.5707963267949"/>
  </joint>
  <link name="column">
    <collision><origin xyz="0 0 0.2"/>
      <geometry><cylinder radius="0.03" length="0.4"/></geometry></collision>
  </link>
  <joint name="turn" type="continuous">
    <parent link="mount"/><child link="column"/><axis xyz="0 0 1"/>
    <limit effort="10" velocity="1"/>
  </joint>
  <link name="boom">
    <collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="column"/><child link="boom"/><origin xyz="0.05 0 0.1"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.3" effort="50" velocity="0.2"/>
  </joint>
  <link name="tip"/>
  <joint name="end" type="fixed">
    <parent link="boom"/><child link="tip"/><origin xyz="0.42 0 0"/>
  </joint>
</robot>
"""

ONES = np.ones(2)
ARM = ArmDescription(
    joints=("turn", "slide"),
    base_link="mount",
    tool_link="tip",
    limits=JointLimits(
        np.array([-6.0, 0.0]), np.array([6.0, 0.3]), ONES, 2 * ONES, 20 * ONES, 10 * ONES
    ),
    postures={"home": np.zeros(2)},
)
MODEL = ArmModel(URDF, ARM)
PLANNER = ArmPlanner(MODEL)


def test_the_tool_in_the_frame_of_the_mount():
    """0.05 + 0.42 m out, turned by 0.5 rad, 0.1 + 0.2 m up."""
    pose = PLANNER.kinematics.forward(np.array([0.5, 0.2]))
    assert pose == pytest.approx(
        from_angles((0.47 * np.cos(0.5), 0.47 * np.sin(0.5), 0.3), (0, 0, 0.5)), abs=1e-9
    )
    jacobian = PLANNER.kinematics.jacobian(np.array([0.5, 0.2]))
    assert jacobian[:, 1] == pytest.approx([0, 0, 1, 0, 0, 0], abs=1e-9)
    assert jacobian[:, 0] == pytest.approx(
        [-0.47 * np.sin(0.5), 0.47 * np.cos(0.5), 0, 0, 0, 1], abs=1e-9
    )


def test_what_always_overlaps_is_no_contact():
    """The boom begins 5 cm from the axis, inside the tube of the chassis; box and wheel are out."""
    pairs = [tuple(map(MODEL.link_of, pair)) for pair in MODEL.self_pairs]
    assert sorted(pairs) == [("chassis", "boom"), ("wheel", "boom")]
    assert Collisions(MODEL, Scene()).contact(np.array([0.0, 0.2])) == ""


def test_reach():
    """0.05 m to the slide, 0.3 m of travel, and the sphere around the boom or the tip: 0.42 m."""
    assert MODEL.reach[1] == 1.0
    assert 0.42 + 0.05 < MODEL.reach[0] < 0.42 + 0.05 + 0.1 + 0.3 + 0.02


def test_inverse_kinematics_with_fewer_joints_than_six():
    target = PLANNER.kinematics.forward(np.array([2.5, 0.1]))
    found = PLANNER.kinematics.ik(target, np.zeros(2), np.random.default_rng(0))
    assert found == pytest.approx([2.5, 0.1], abs=1e-3)


def test_objects_stand_in_the_frame_of_the_mount():
    """The boom points along x of the mount, which is y of the chassis."""
    post = SceneObject("post", Box((0.05, 0.05, 2.0)), from_angles((0.4, 0, 0), (0, 0, 0)))
    checks = Collisions(MODEL, Scene((post,)))
    assert checks.contact(np.array([0.0, 0.1])) == "boom touches post"
    assert checks.contact(np.array([np.pi, 0.1])) == ""
    assert checks.distance(np.array([np.pi, 0.1])) == pytest.approx(0.4 - 0.025 - 0.03, abs=1e-6)


def test_the_arm_turns_the_other_way_round_a_post():
    post = SceneObject("post", Box((0.05, 0.05, 2.0)), from_angles((0.4, 0, 0), (0, 0, 0)))
    scene, start, goal = Scene((post,)), np.array([-1.0, 0.1]), np.array([1.0, 0.1])
    around = goal - [2 * np.pi, 0.0]
    path = PLANNER.plan(start, [goal, around], scene, np.random.default_rng(0))
    assert path[-1] == pytest.approx(around)
    assert PLANNER.trajectory(path, scene).positions[-1] == pytest.approx(around)


def test_without_a_gripper_nothing_is_grasped():
    block = SceneObject("block", Box((0.04, 0.04, 0.04)), from_angles((0.4, 0, 0), (0, 0, 0)))
    with pytest.raises(NavigationError, match="the arm has no gripper"):
        grasps(PLANNER, "block", Scene((block,)), np.zeros(2), np.random.default_rng(0))
