"""Arms in robot files: what is found in the URDF, and what is refused where."""

from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.errors import InputError

PANDA = read_robot(find_robot("panda_table", Path()))
URDF = "package://pybullet_data/franka_panda/panda.urdf"


@pytest.fixture
def read(tmp_path):
    def read(arm="{}", more="", urdf=URDF):
        file = tmp_path / "robot.yaml"
        file.write_text(f"robot: mine\nurdf: {urdf}\narm: {arm}\n{more}")
        return read_robot(file)

    return read


def errors(read, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        read(*args, **kwargs)
    return [f"{item.mark.line} {item.code} {item.sentence}" for item in caught.value.findings]


def urdf_of(folder, *joints, links=()):
    """A URDF of joints `(name, kind, parent, child, rest)` between links of 1 kg."""
    names = dict.fromkeys((*links, *(end for joint in joints for end in joint[2:4])))
    body = '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    text = "".join(f'<link name="{name}"><inertial>{body}</inertial></link>' for name in names)
    for name, kind, parent, child, rest in joints:
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f"{rest}</joint>"
        )
    (folder / "r.urdf").write_text(f'<robot name="r">{text}</robot>')
    return "r.urdf"


LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="2" effort="10"/>'


def finger(axis, upper=0.03):
    return f'<axis xyz="{axis}"/><limit lower="0" upper="{upper}" velocity="0.1" effort="20"/>'


def test_the_chain_the_gripper_and_the_tool_are_found_in_the_urdf(read):
    robot = read()
    arm = robot.arm
    assert arm.joints == tuple(f"panda_joint{number}" for number in range(1, 8))
    assert (arm.base_link, arm.tool_link) == ("panda_link0", "panda_grasptarget")
    assert arm.gripper.joints == ("panda_finger_joint1", "panda_finger_joint2")
    # Two fingers with 4 cm each, 20 N and 0.2 m/s in the URDF.
    assert (arm.gripper.width_max, arm.gripper.force_max) == (0.08, 20.0)
    assert (arm.gripper.speed, arm.gripper.finger_links) == (
        0.2, ("panda_leftfinger", "panda_rightfinger"),
    )  # fmt: skip
    limits = arm.limits
    assert (limits.lower[3], limits.upper[3]) == (-3.1416, 0.0)
    assert limits.velocity.tolist() == [2.175] * 4 + [2.61] * 3
    assert limits.acceleration == pytest.approx(2.0 * limits.velocity)  # in half a second
    assert limits.jerk == pytest.approx(10.0 * limits.acceleration)  # in a tenth
    assert arm.postures["home"] == pytest.approx((limits.lower + limits.upper) / 2)


def test_a_robot_without_wheels_stands_and_its_outline_is_measured(read):
    robot = read(more="mount: {height: 60 cm}\n")
    assert not robot.drivetrain.moves and robot.drivetrain.driven_joints == ()
    # The farthest vertex of the mesh of the first link is 0.158 m from its axis.
    assert robot.footprint.circumscribed_radius == pytest.approx(0.158, abs=0.001)
    # The first link of the arm is 14 cm high (its mesh), on a column of 60 cm.
    assert robot.height == pytest.approx(0.74, abs=0.01)
    assert robot.links[0].origin[2, 3] == 0.6
    given = read(more="footprint: {radius: 30 cm}\nheight: 1.2 m\n")
    assert given.footprint.circumscribed_radius == pytest.approx(0.3, abs=0.01)
    assert given.height == 1.2


def test_the_shipped_robot_has_a_camera_in_its_hand():
    assert PANDA.depth_cameras["hand"].link == "panda_hand"
    assert PANDA.camera.link == "" and PANDA.warnings == ()
    assert set(PANDA.arm.postures) == {"home", "folded", "upright"}


def test_what_is_given_takes_precedence(read):
    arm = read(
        "{tool: panda_hand, acceleration: 5, jerk: 50, gripper: {force: 30 N},"
        " postures: {home: [0, 0, 0, -1, 0, 1, 0], up: [0, 0, 0, -0.1, 0, 1, 0]}}"
    ).arm
    assert arm.tool_link == "panda_hand"
    assert set(arm.limits.acceleration.tolist()) == {5.0}
    assert set(arm.limits.jerk.tolist()) == {50.0}
    assert arm.gripper.force_max == 30.0
    assert arm.postures["home"].tolist() == [0, 0, 0, -1, 0, 1, 0]
    assert set(arm.postures) == {"home", "up"}


@pytest.mark.parametrize(
    ("arm", "told"),
    [
        ("{tool: panda_hnd}", "3 E304 arm: tool: the URDF has no link 'panda_hnd'"),
        ("{tool: panda_link0}", "3 E304 arm: the URDF has no arm: no movable joint leads from"),
        ("{postures: {up: [0, 0, 0, 1, 0, 1, 0]}}",
         "3 E304 postures.up: panda_joint4 is 1, beyond its limits -3.1416 to 0"),
        ("{postures: {up: [0, 0]}}", "3 E301 postures.up: expected [panda_joint1, panda_joint2"),
        ("{acceleration: -1}", "3 E301 acceleration: "),
        ("{colour: red}", "3 E301 "),
    ],
)  # fmt: skip
def test_a_wrong_arm_is_refused_where_it_is_written(read, arm, told):
    [found] = errors(read, arm)
    assert found.startswith(told)


def test_a_package_that_is_not_installed_is_named(read):
    found = errors(read, urdf="package://no_such_package/r.urdf")
    assert found[0] == (
        "2 E302 urdf: package://no_such_package/r.urdf: the package 'no_such_package' is not found"
    )


def test_a_camera_on_a_link_that_is_not_there_is_refused(read):
    more = "depth_cameras: {eye: {link: panda_hnd, position: [0, 0, 0]}}\n"
    assert errors(read, more=more) == ["4 E301 eye: link: the URDF has no link 'panda_hnd'"]
    more = "depth_cameras: {eye: {link: panda_hand, position: [0, 0, 0], scan: {}}}\n"
    assert errors(read, more=more) == ["4 E301 eye: a camera on a link that moves has no scan"]


def test_an_arm_without_a_gripper_ends_behind_its_last_joint(read, tmp_path):
    urdf = urdf_of(
        tmp_path, ("a", "revolute", "base", "one", LIMIT), ("b", "prismatic", "one", "two", LIMIT),
        ("c", "fixed", "two", "flange", ""),
    )  # fmt: skip
    arm = read(urdf=urdf).arm
    assert arm.joints == ("a", "b") and arm.gripper is None
    assert arm.tool_link == "two"
    [found] = errors(read, "{gripper: {}}", urdf=urdf)
    assert found.startswith("3 E304 arm: the URDF has no two prismatic joints that move in opp")


def test_a_joint_without_limits_is_refused_at_its_line(read, tmp_path):
    urdf = urdf_of(tmp_path, ("a", "revolute", "base", "one", '<axis xyz="0 0 1"/>'))
    [found] = errors(read, urdf=urdf)
    assert found.startswith("1 E304 arm: the URDF's joint 'a' needs lower < upper, velocity and")


def test_two_grippers_need_the_name_of_a_tool(read, tmp_path):
    joints = []
    for side in "lr":
        hand = f"hand_{side}"
        joints += [
            (f"arm_{side}", "revolute", "base", hand, LIMIT),
            (f"f1_{side}", "prismatic", hand, f"f1_{side}", finger("0 1 0")),
            (f"f2_{side}", "prismatic", hand, f"f2_{side}", finger("0 -1 0", 0.02)),
        ]
    urdf = urdf_of(tmp_path, *joints)
    [found] = errors(read, urdf=urdf)
    assert found == "3 E304 arm: the URDF has several grippers, on hand_l, hand_r"
    arm = read("{tool: hand_r}", urdf=urdf).arm
    assert (arm.joints, arm.gripper.joints) == (("arm_r",), ("f1_r", "f2_r"))
    assert arm.gripper.width_max == pytest.approx(0.04)  # twice the smaller travel


def test_the_physics_keeps_the_joints_of_the_arm_and_no_others(tmp_path):
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    try:
        (tmp_path / "m.urdf").write_text(PANDA.model)
        body = pybullet.loadURDF(str(tmp_path / "m.urdf"), physicsClientId=client)
        infos = [
            pybullet.getJointInfo(body, number, physicsClientId=client)
            for number in range(pybullet.getNumJoints(body, physicsClientId=client))
        ]
    finally:
        pybullet.disconnect(client)
    assert {info[1].decode() for info in infos} == set(PANDA.arm.all_joints)
    assert np.all([info[8] < info[9] for info in infos])
