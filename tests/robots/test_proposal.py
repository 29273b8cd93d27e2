"""A robot.yaml proposed for a URDF: it has no findings, and the numbers of the URDF."""

from math import atan, pi, tan
from pathlib import Path

import numpy as np
import pybullet_data
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots.load import HERE, read_robot, robot_names
from robots.proposal.robot_file import propose_robot
from robots.urdf.reading import Attachment, UrdfSource
from stack.errors import InputError, Mark

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'
SAME = settings(
    deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def wheel(name, at, radius, *, rpy="0 0 0", axis="0 1 0", parent="base", shape="sphere"):
    return (
        f'<link name="{name}_l">{INERTIAL}<collision><geometry><{shape} radius="{radius}" '
        f'length="0.02"/></geometry></collision></link><joint name="{name}" type="continuous">'
        f'<parent link="{parent}"/><child link="{name}_l"/><axis xyz="{axis}"/>'
        f'<origin xyz="{" ".join(map(str, at))}" rpy="{rpy}"/></joint>'
    )


def part(name, at, rpy="0 0 0", inside="", parent="base"):
    return (
        f'<link name="{name}">{inside}</link><joint name="{name}_j" type="fixed">'
        f'<parent link="{parent}"/><child link="{name}"/>'
        f'<origin xyz="{" ".join(map(str, at))}" rpy="{rpy}"/></joint>'
    )


def robot(*parts, box=(0.3, 0.2, 0.1), at=(0.0, 0.0, 0.1)):
    size, place = (" ".join(map(str, three)) for three in (box, at))
    return (
        f'<robot name="My Cart"><link name="base">{INERTIAL}<collision><origin xyz="{place}"/>'
        f'<geometry><box size="{size}"/></geometry></collision></link>{"".join(parts)}</robot>'
    )


@pytest.fixture
def propose(tmp_path):
    def write(urdf):
        (tmp_path / "r.urdf").write_text(urdf)
        found = propose_robot(UrdfSource(tmp_path / "r.urdf"), "", "r.urdf")
        (tmp_path / "robot.yaml").write_text(found.text)
        return read_robot(tmp_path / "robot.yaml")

    return write


@given(
    st.tuples(*[st.floats(-1, 1)] * 3), st.floats(0.1, 1.0), st.floats(0.02, 0.2),
    st.sampled_from(["0 1 0", "0 -1 0"]),
)  # fmt: skip
@SAME
def test_two_wheels_are_a_differential_drive(propose, at, apart, radius, axis):
    x, y, z = at
    found = propose(robot(
        wheel("l", (x, y + apart / 2, z + radius), radius, axis=axis),
        wheel("r", (x, y - apart / 2, z + radius), radius),
        at=(x + 0.05, y, z + radius + 0.05),
    ))  # fmt: skip
    assert found.warnings == ()
    assert (found.name, found.drivetrain.kind) == ("my_cart", "differential")
    assert found.wheels.separation == pytest.approx(apart, rel=1e-3)
    assert found.wheels.radius == pytest.approx(radius, abs=1e-4)
    # The box reaches from 0.1 m behind the axle to 0.2 m before it.
    assert found.footprint.points[:, 0].max() == pytest.approx(max(0.2, radius), abs=6e-3)
    assert found.footprint.points[:, 0].min() == pytest.approx(min(-0.1, -radius), abs=6e-3)


@given(st.floats(0.1, 0.6), st.floats(0.2, 0.8), st.floats(0.04, 0.1))
@SAME
def test_four_wheels_are_a_skid_steered_drive(propose, base, track, radius):
    """The ratio of four point contacts is 1 + (wheelbase / track)² (docs/robots.md)."""
    corners = {"fl": (1, 1), "fr": (1, -1), "rl": (-1, 1), "rr": (-1, -1)}
    found = propose(robot(*(
        wheel(
            name, (x * base / 2, y * track / 2, radius), radius, shape="cylinder",
            rpy=f"{-pi / 2} 0 0", axis="0 0 1",
        )
        for name, (x, y) in corners.items()
    ), at=(0, 0, 0.2)))  # fmt: skip
    assert found.warnings == ()
    assert (found.wheels.left, found.wheels.right) == (("fl", "rl"), ("fr", "rr"))
    assert found.wheels.track == pytest.approx(track, rel=1e-3)
    ratio = min(4.0, 1 + (base / track) ** 2)
    assert found.skid.icr_ratio == pytest.approx(ratio, rel=1e-2)
    assert found.drivetrain.driven_joints == ("fl", "fr")


@given(st.floats(0.1, 0.3), st.integers(3, 5), st.floats(-pi, pi))
@SAME
def test_wheels_around_the_base_are_omnidirectional(propose, reach, count, first):
    angles = [first + 2 * pi * n / count for n in range(count)]
    found = propose(robot(*(
        wheel(f"w{n}", (reach * np.cos(a), reach * np.sin(a), 0.05), 0.05, rpy=f"0 0 {a + pi / 2}")
        for n, a in enumerate(angles)
    )))  # fmt: skip
    assert found.warnings == ()
    assert found.drivetrain.kind == "omni"
    for mount, angle in zip(found.wheels.mounts, angles, strict=True):
        assert (mount.x, mount.y) == pytest.approx(
            (reach * np.cos(angle), reach * np.sin(angle)), abs=1e-3
        )
        assert np.cos(mount.heading - angle - pi / 2) == pytest.approx(1.0, abs=1e-4)


def test_two_steered_wheels_are_a_car(propose):
    steering = "".join(
        f'<link name="{side}_knuckle">{INERTIAL}</link><joint name="{side}_steer" type="revolute">'
        f'<parent link="base"/><child link="{side}_knuckle"/><origin xyz="0.4 {y} 0.08"/>'
        '<axis xyz="0 0 1"/><limit lower="-0.7" upper="0.7" effort="9" velocity="9"/></joint>'
        + wheel(f"{side}_front", (0, 0, 0), 0.08, parent=f"{side}_knuckle")
        for side, y in (("left", 0.15), ("right", -0.15))
    )
    rear = wheel("rl", (0, 0.15, 0.08), 0.08) + wheel("rr", (0, -0.15, 0.08), 0.08)
    found = propose(robot(steering, rear, at=(0.2, 0, 0.2)))
    assert found.warnings == ()
    assert found.wheels.steering == ("left_steer", "right_steer")
    assert (found.wheels.wheelbase, found.wheels.track) == (0.4, 0.3)
    # The inner wheel at 0.7 rad: R = L / tan 0.7 + b / 2, of which 98 % is used.
    radius = 0.4 / tan(0.7) + 0.15
    assert found.wheels.steering_angle == pytest.approx(0.98 * atan(0.4 / radius), rel=1e-2)
    assert found.components["planner"] == {"use": "hybrid_astar"}


def test_casters_are_not_taken_for_driven_wheels(propose):
    swivel = (
        f'<link name="fork">{INERTIAL}</link><joint name="swivel" type="continuous">'
        '<parent link="base"/><child link="fork"/><origin xyz="-0.2 0 0.06"/>'
        '<axis xyz="0 0 1"/></joint>'
    )
    found = propose(robot(
        wheel("l", (0, 0.15, 0.05), 0.05), wheel("r", (0, -0.15, 0.05), 0.05),
        swivel, wheel("caster", (-0.02, 0, -0.03), 0.03, parent="fork"),
        wheel("small", (0.2, 0, 0.02), 0.02),
    ))  # fmt: skip
    assert found.drivetrain.driven_joints == ("l", "r")


SCAN = (
    '<gazebo reference="top"><sensor type="gpu_lidar"><update_rate>62</update_rate><ray><scan>'
    "<horizontal><samples>640</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle>"
    "</horizontal></scan><range><min>0.12</min><max>20</max></range></ray></sensor></gazebo>"
)


def test_sensors_are_where_their_links_are(propose):
    wheels = wheel("l", (0, 0.15, 0.05), 0.05), wheel("r", (0, -0.15, 0.05), 0.05)
    found = propose(robot(
        *wheels, part("mast", (0.1, 0, 0.3)),
        part("top", (0, 0.02, 0.1), f"0 0 {pi / 2}", parent="mast"),
        part("camera_link", (0.14, 0, 0.2), "0 0.2 0"), part("imu_link", (0, 0, 0.1)), SCAN,
    ))  # fmt: skip
    lidar = found.lidar
    assert (lidar.mount.x, lidar.mount.y, lidar.height) == (0.1, 0.02, 0.4)
    assert lidar.mount.heading == pytest.approx(pi / 2)
    assert (lidar.beams, lidar.range_min, lidar.range_max, lidar.rate) == (640, 0.12, 20, 62)
    assert lidar.field_of_view == pytest.approx(3.0, abs=2e-3)
    assert found.camera.model.position == (0.14, 0.0, 0.2)
    assert found.camera.model.pitch == pytest.approx(0.2, abs=2e-3)
    assert found.imu is not None
    mount, scan = part("laser_mount", (0, 0, 0)), part("base_scan", (0.05, 0, 0.2))
    named = propose(robot(*wheels, mount, scan))
    assert (named.lidar.mount.x, named.lidar.height) == (0.05, 0.2)


def test_two_lidars_of_gazebo_on_one_link_are_proposed_where_their_poses_are(propose):
    wheels = wheel("l", (0, 0.15, 0.05), 0.05), wheel("r", (0, -0.15, 0.05), 0.05)
    scans = "".join(
        SCAN.replace('type="gpu', f'name="{name}" type="gpu').replace(
            "<update_rate>", f"<pose>{x} 0 0.1 0 0 {yaw}</pose><update_rate>"
        )
        for name, x, yaw in (("ahead", 0.1, 0), ("behind", -0.1, pi))
    )
    found = propose(robot(*wheels, part("top", (0, 0, 0.1)), scans)).real_lidars
    assert list(found) == ["lidar", "behind"]
    assert [lidar.mount.x for lidar in found.values()] == [0.1, -0.1]
    assert abs(found["behind"].mount.heading) == pytest.approx(pi, abs=1e-3)


@given(st.floats(-3.0, 3.0), st.floats(0.3, 5.0), st.floats(-3.0, 3.0), st.sampled_from([0.0, pi]))
@SAME
def test_a_lidar_looks_where_its_sector_is_also_upside_down(propose, first, view, yaw, roll):
    """The angles of the sensor are in its link's frame; a beam at angle a looks along R (cos a,
    sin a, 0), with R = Rz(yaw) Rx(roll): at yaw + a, or upside down at yaw - a.
    """
    angles = f"<min_angle>{first}</min_angle><max_angle>{first + view}</max_angle>"
    scan = SCAN.replace("<min_angle>-1.5</min_angle><max_angle>1.5</max_angle>", angles)
    lidar = propose(robot(
        wheel("l", (0, 0.15, 0.05), 0.05), wheel("r", (0, -0.15, 0.05), 0.05),
        part("top", (0, 0, 0.3), f"{roll} 0 {yaw}"), scan,
    )).lidar  # fmt: skip
    assert lidar.upside_down == (roll > 0.0)
    middle = first + view / 2
    looks = yaw - middle if lidar.upside_down else yaw + middle
    assert np.cos(lidar.mount.heading - looks) == pytest.approx(1.0, abs=1e-3)
    assert lidar.field_of_view == pytest.approx(view, abs=2e-3)


@pytest.mark.parametrize("name", [name for name in robot_names() if name != "panda_table"])
def test_the_shipped_robots_are_proposed_again(name, tmp_path):
    shipped = read_robot(HERE / name / "robot.yaml")
    found = propose_robot(UrdfSource(shipped.urdf), "again", str(shipped.urdf))
    (tmp_path / "robot.yaml").write_text(found.text)
    again = read_robot(tmp_path / "robot.yaml")
    assert again.drivetrain.driven_joints == shipped.drivetrain.driven_joints
    assert again.wheels.radius == shipped.wheels.radius
    assert again.warnings == ()


@pytest.mark.parametrize(
    ("parts", "told"),
    [((), "the floor are none"), ((wheel("l", (0, 0.1, 0.05), 0.05),), "the floor are 'l'")],
)
def test_a_urdf_without_a_drive_is_refused(propose, parts, told):
    with pytest.raises(InputError, match=told):
        propose(robot(*parts))


DATA = Path(pybullet_data.getDataPath())


@pytest.mark.parametrize(
    ("file", "joints", "tool", "fingers"),
    [
        ("franka_panda/panda.urdf", 7, "panda_grasptarget", 2),
        ("kuka_iiwa/model.urdf", 7, "lbr_iiwa_link_7", 0),
        ("xarm/xarm6_robot.urdf", 6, "link6", 0),
        ("xarm/xarm6_with_gripper.urdf", 6, "link6", 0),  # its fingers turn: no parallel gripper
    ],
)
def test_an_arm_on_a_fixed_base_is_proposed(file, joints, tool, fingers, tmp_path):
    found = propose_robot(UrdfSource(DATA / file), "", str(DATA / file))
    assert (found.drive, found.joints) == ("none", joints)
    (tmp_path / "robot.yaml").write_text(found.text)
    robot = read_robot(tmp_path / "robot.yaml")
    assert not robot.drivetrain.moves and robot.lidar is None
    arm = robot.arm
    assert (len(arm.joints), arm.tool_link) == (joints, tool)
    assert len(arm.all_joints) == joints + fingers
    middle = (arm.limits.lower + arm.limits.upper) / 2.0
    assert arm.postures["home"] == pytest.approx(middle, abs=6e-4)


def test_an_arm_on_a_base_with_wheels_is_proposed(tmp_path):
    shipped = read_robot(HERE / "fetcher" / "robot.yaml")
    arm = Attachment(
        UrdfSource(DATA / "franka_panda" / "panda.urdf"), "base", (0.12, 0.0, 0.36), (0, 0, 0),
        Mark("robot.yaml"),
    )  # fmt: skip
    urdf = (
        f"{{file: {shipped.urdf}, attach: [{{file: package://pybullet_data/franka_panda/panda.urdf,"
        " to: base, position: [0.12, 0, 0.36]}]}"
    )
    found = propose_robot(UrdfSource(shipped.urdf, attached=(arm,)), "again", urdf)
    assert (found.drive, found.joints) == ("differential", 7)
    (tmp_path / "robot.yaml").write_text(found.text)
    robot = read_robot(tmp_path / "robot.yaml")
    assert robot.drivetrain.driven_joints == shipped.drivetrain.driven_joints
    assert robot.arm.joints == shipped.arm.joints
    assert robot.warnings == ()  # the outline contains the arm at `home`


def test_a_urdf_whose_arm_lacks_a_limit_is_refused(tmp_path):
    text = (DATA / "kuka_iiwa" / "model.urdf").read_text()
    cut = text.replace(' velocity="10"', "", 1)
    assert cut != text
    folder = DATA / "kuka_iiwa" / "meshes"
    (tmp_path / "r.urdf").write_text(cut.replace('filename="meshes', f'filename="file://{folder}'))
    with pytest.raises(InputError, match=r"lbr_iiwa_joint_1' needs lower < upper, velocity"):
        propose_robot(UrdfSource(tmp_path / "r.urdf"), "", "r.urdf")
