"""Robot files: what they mean, where mistakes are reported, and that the robots stand."""

from math import pi, tan
from pathlib import Path
from xml.etree import ElementTree

import pytest

from robots.load import find_robot, read_robot, robot_names
from stack.errors import InputError

URDF = """\
<robot name="r"><link name="base">INERTIAL</link><link name="w">INERTIAL SHAPE</link>
<link name="x">INERTIAL SHAPE</link><link name="v"/>
<joint name="left_wheel" type="continuous"><parent link="base"/><child link="w"/>
<origin xyz="0 0.15 0.05"/><axis xyz="0 1 0"/></joint>
<joint name="other_wheel" type="continuous"><parent link="base"/><child link="x"/>
<origin xyz="0 -0.15 0.05"/><axis xyz="0 1 0"/></joint>
<joint name="right_wheel" type="fixed"><parent link="base"/><child link="v"/></joint></robot>
"""
INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
SHAPE = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
URDF = URDF.replace("INERTIAL", INERTIAL).replace("SHAPE", SHAPE)
ROBOT = """\
robot: r
footprint: {radius: 20 cm}
height: 0.4
urdf: r.urdf
wheels: {left: [left_wheel], right: [other_wheel], radius: 5 cm, separation: 0.3}
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        (tmp_path / "r.urdf").write_text(URDF)
        (tmp_path / "robot.yaml").write_text(text)
        return read_robot(tmp_path / "robot.yaml")

    return read_text


def test_the_smallest_robot_has_the_defaults(read):
    robot = read(ROBOT)
    assert robot.limits.linear_speed == 0.8
    assert robot.lidar is None and robot.camera is None and robot.imu is None
    assert robot.footprint.inscribed_radius == pytest.approx(0.2)


def test_the_camera_s_focal_length_follows_from_its_field_of_view(read):
    robot = read(f"{ROBOT}camera: {{position: [0.1, 0, 35 cm], width: 320, field_of_view: 70 deg}}")
    # Half the width is seen under half the angle: f = 160 px / tan 35 deg = 228.50 px.
    assert robot.camera.model.focal_length == pytest.approx(160 / tan(35 * pi / 180))
    assert robot.camera.model.focal_length == pytest.approx(228.50, abs=0.01)


def test_a_clockwise_footprint_is_turned_round(read):
    text = ROBOT.replace("{radius: 20 cm}", "[[-0.2, -0.1], [-0.2, 0.1], [0.3, 0.1], [0.3, -0.1]]")
    points = read(text).footprint.points
    assert points[0].tolist() == [0.3, -0.1]
    assert points[1].tolist() == [0.3, 0.1]


def test_an_outline_may_end_with_the_corner_that_it_began_with(read):
    corners = "[[0.3, -0.1], [0.3, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.3, -0.1]]"
    footprint = read(ROBOT.replace("{radius: 20 cm}", corners)).footprint
    assert footprint.points.shape == (4, 2)
    assert footprint.inscribed_radius == pytest.approx(0.1)  # not NaN, by an edge without length


def test_navigation_is_kept_raw_by_kind(read):
    robot = read(f"{ROBOT}navigation: {{planner: astar, controller: {{use: mppi, samples: 500}}}}")
    assert robot.components == {
        "planner": {"use": "astar"},
        "controller": {"use": "mppi", "samples": 500},
    }


OUTSIDE = "[[1, 1], [2, 1], [2, 2]]"
WRONG = [
    ("height: 0.4", "heigth: 0.4", "1:1 E301 a robot file needs the key 'height'"),
    ("radius: 20 cm", "radius: 20 kg", "2:21 E301 radius: '20 kg' is in kg, expected a length"),
    ("{radius: 20 cm}", "[[1, 1], [2, 1]]", "2:12 E303 footprint: a polygon has at least 3"),
    ("{radius: 20 cm}", OUTSIDE, "2:12 E303 footprint: the base frame's origin [0, 0] is not"),
    ("{radius: 20 cm}", "[[0, 0], [1, 0], [2, 0]]", "2:12 E303 footprint: these 3 corners encl"),
    ("{radius: 20 cm}", "round", "2:12 E303 footprint: expected {radius: 22 cm} or corners, got"),
    ("r.urdf", "q.urdf", "4:7 E302 urdf: 'q.urdf': there is no such URDF; did you mean"),
    ("r.urdf", "robot.yaml", "1:1 E302 not XML: syntax error"),
    ("right: [other_wheel]", "right: [r_wheel]", "5:38 E302 wheels: the URDF has no joint 'r_"),
    ("right: [other_wheel]", "right: [right_wheel]", "5:38 E302 wheels: the URDF's joint 'right_"),
    ("right: [other_wheel]", "right: []", "5:37 E301 wheels: right has no joint; add one, e.g. r"),
    ("robot: r", "robot: r\nlimits: {linear_sped: 1}", "2:10 E301 `limits` has no key 'linear_sp"),
    ("robot: r", "robot: r\nlidar: {beams: 2}", "2:16 E301 beams: 2 must be at least 3"),
    ("robot: r", "robot: r\nlidar: {range_max: 1 cm}", "2:1 E301 range_min: 0.08 must be below 0"),
    ("robot: r", "robot: r\ndepth_cameras: {front: {}}",
     "2:17 E301 `depth_cameras.front` needs the key 'position'"),
    ("robot: r", "robot: r\ncamera: {}", "2:1 E301 `camera` needs the key 'position'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), WRONG)
def test_a_mistake_is_reported_where_it_stands(read, old, new, expected):
    with pytest.raises(InputError) as caught:
        read(ROBOT.replace(old, new))
    found = [
        f"{item.mark.line}:{item.mark.column} {item.code} {item.sentence}; {item.hint}"
        for item in caught.value.findings
    ]
    assert found[0].startswith(expected)


def test_robots_are_found_by_name_and_by_path(tmp_path):
    mission = tmp_path / "mission.yaml"
    mission.write_text("mission: x")
    assert find_robot("scout", mission).parts[-2:] == ("scout", "robot.yaml")
    assert find_robot("./mine/robot.yaml", mission) == tmp_path / "mine" / "robot.yaml"
    (tmp_path / "mine").mkdir()
    assert find_robot("./mine", tmp_path) == tmp_path / "mine" / "robot.yaml"
    with pytest.raises(InputError, match=r"no robot 'skout'; did you mean 'scout'\?"):
        find_robot("skout", mission)


MASSES = {
    "scout": 12.0, "scout_depth": 12.0, "scout_rover": 12.0, "jackal": 17.0, "glide": 8.5,
    "buggy": 16.0, "scout_wheels": 12.0, "fetcher": 68.8,
}  # fmt: skip


WHEELED = [name for name in robot_names() if read_robot(find_robot(name, Path())).drivetrain.moves]


def steering_joints(robot):
    return getattr(robot.wheels, "steering", ())


@pytest.mark.parametrize("name", WHEELED)
def test_a_robot_stands_still_and_upright_for_a_second(name):
    import pybullet

    robot = read_robot(find_robot(name, Path()))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        pybullet.createMultiBody(0, floor, physicsClientId=client)
        body = pybullet.loadURDF(str(robot.urdf), physicsClientId=client)
        joints = {
            pybullet.getJointInfo(body, n, physicsClientId=client)[1].decode(): n
            for n in range(pybullet.getNumJoints(body, physicsClientId=client))
        }
        for joint in (*robot.drivetrain.driven_joints, *steering_joints(robot)):
            pybullet.setJointMotorControl2(
                body, joints[joint], pybullet.VELOCITY_CONTROL, targetVelocity=0, force=20,
                physicsClientId=client,
            )  # fmt: skip
        pybullet.setTimeStep(0.002, physicsClientId=client)
        before, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        for _ in range(500):
            pybullet.stepSimulation(physicsClientId=client)
        after, turned = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        roll, pitch, _ = pybullet.getEulerFromQuaternion(turned)
        wheels = {
            joint: pybullet.getLinkState(body, joints[joint], physicsClientId=client)[4]
            for joint in robot.drivetrain.driven_joints
        }
    finally:
        pybullet.disconnect(client)
    assert abs(after[2] - before[2]) < 1e-3
    assert max(abs(after[0] - before[0]), abs(after[1] - before[1])) < 1e-3
    assert abs(roll) < 0.005 and abs(pitch) < 0.005
    for joint, position in wheels.items():
        assert position[2] == pytest.approx(robot.wheels.radius, abs=1e-3), joint


def tops_and_widths(urdf):
    """Height of the top and width (y) of the base's upright collision shapes, metres."""
    base = ElementTree.parse(urdf).getroot().find("link")
    for shape in base.iter("collision"):
        height = float(shape.find("origin").get("xyz").split()[2])
        cylinder, box = shape.find("geometry/cylinder"), shape.find("geometry/box")
        if cylinder is not None:
            yield height + float(cylinder.get("length")) / 2, 2 * float(cylinder.get("radius"))
        else:
            _, width, tall = map(float, box.get("size").split())
            yield height + tall / 2, width


@pytest.mark.parametrize("name", WHEELED)
def test_a_robot_s_shapes_stay_inside_its_footprint_and_under_its_lidar(name):
    import pybullet

    robot = read_robot(find_robot(name, Path()))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(str(robot.urdf), physicsClientId=client)
        boxes = [
            pybullet.getAABB(body, link, physicsClientId=client)
            for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client))
        ]
        mass = sum(
            pybullet.getDynamicsInfo(body, link, physicsClientId=client)[0]
            for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client))
        )
    finally:
        pybullet.disconnect(client)
    reach_x, reach_y = abs(robot.footprint.points).max(axis=0)
    # Where the lidar sees, and above, a body has only its head and what is thinner than that.
    for top, width in tops_and_widths(robot.urdf):
        assert robot.lidar is None or top < robot.lidar.height or width <= 0.09
    # Bullet's boxes have a margin of a few millimetres.
    for low, high in boxes:
        assert max(-low[0], high[0]) <= reach_x + 6e-3
        assert max(-low[1], high[1]) <= reach_y + 6e-3
    assert mass == pytest.approx(MASSES[name], abs=1e-6)
