"""robot.yaml and its URDF are compared: what contradicts, and what is probably unintended."""

from math import pi, tan

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot, robot_names
from stack.errors import InputError
from stack.types import Twist

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'


TOP_SENSOR = '<gazebo reference="top"><sensor type="ray"/></gazebo>'


def ball(radius):
    return f'<collision><geometry><sphere radius="{radius}"/></geometry></collision>'


def urdf(
    *, apart=0.3, radius=0.05, at=(0.0, 0.0, 0.0), lift=0.0, shape="sphere", more="", centre=0.1
):
    """A box on two wheels; `at`: the middle of the axle on the floor, in the root's frame."""
    x, y, z = at
    placed = INERTIAL.replace("<mass", f'<origin xyz="{x} {y} {z + centre}"/><mass')
    text = [
        f'<robot name="r"><link name="base">{placed}<collision>'
        f'<origin xyz="{x} {y} {z + 0.1}"/><geometry><box size="0.3 0.2 0.1"/></geometry>'
        "</collision></link>"
    ]
    for name, side, up in (("l", 1, 0.0), ("r", -1, lift)):
        round_shape = f'<{shape} radius="{radius}" length="0.02"/>'
        text.append(
            f'<link name="{name}_wheel">{INERTIAL}<collision><geometry>{round_shape}</geometry>'
            f'</collision></link><joint name="{name}" type="continuous"><parent link="base"/>'
            f'<child link="{name}_wheel"/><axis xyz="0 1 0"/>'
            f'<origin xyz="{x} {y + side * apart / 2} {z + radius + up}"/></joint>'
        )
    return "".join([*text, more, "</robot>"])


ROBOT = """robot: r
footprint: {radius: 20 cm}
height: 0.2
urdf: r.urdf
wheels: {left: [l], right: [r], radius: 5 cm, separation: 0.3}
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text, robot=ROBOT):
        (tmp_path / "r.urdf").write_text(text)
        (tmp_path / "robot.yaml").write_text(robot)
        return read_robot(tmp_path / "robot.yaml")

    return read_text


def errors(read, *args):
    with pytest.raises(InputError) as caught:
        read(*args)
    return [
        f"{item.mark.line}:{item.mark.column} {item.code} {item.sentence}; {item.hint}"
        for item in caught.value.findings
    ]


def test_the_shipped_robots_agree_with_their_urdfs(tmp_path):
    for name in robot_names():
        assert read_robot(find_robot(name, tmp_path)).warnings == ()


@given(st.floats(0.1, 1.0), st.floats(0.1, 1.0))
@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_another_separation_is_an_error_with_both_numbers(read, described, modelled):
    robot = ROBOT.replace("separation: 0.3", f"separation: {described}").replace("20 cm", "1 m")
    if abs(described - modelled) <= max(0.005, 0.05 * described):
        assert read(urdf(apart=modelled), robot).warnings == ()
    else:
        (found,) = errors(read, urdf(apart=modelled), robot)
        expected = f"E302 wheels: the separation is {described:g} m, but {modelled:.4g} m in the"
        assert expected in found


def test_a_finding_stands_at_the_key_that_it_is_about(read):
    (found,) = errors(read, urdf(apart=0.24))
    assert found.startswith("5:59 E302 wheels: the separation is 0.3 m, but 0.24 m in the URDF;")
    (found,) = errors(read, urdf(), ROBOT.replace("left: [l], right: [r]", "left: [r], right: [l]"))
    assert "the separation is 0.3 m, but -0.3 m in the URDF; left wheels are at y > 0" in found


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_another_wheel_radius_is_an_error(read, shape):
    found = errors(read, urdf(radius=0.08, shape=shape))
    expected = f"5:41 E302 wheels: radius is 0.05 m, but the URDF's wheel 'l_wheel' is a {shape} of"
    assert found[0].startswith(f"{expected} radius 0.08 m; write `radius: 0.08`"), found
    assert len(found) == 2  # one for each wheel


def test_wheels_that_cannot_stand_or_roll_are_errors(read):
    (found,) = errors(read, urdf(lift=0.02))
    assert "the URDF's driven wheels are not at one height: 'r' is 0.020 m above 'l'" in found
    low = (
        f'<link name="foot">{INERTIAL}<collision><geometry><sphere radius="0.03"/></geometry>'
        '</collision></link><joint name="f" type="fixed"><parent link="base"/>'
        '<child link="foot"/><origin xyz="0.1 0 0.02"/></joint>'
    )
    (found,) = errors(read, urdf(more=low))
    assert "the URDF's link 'foot' reaches 0.010 m below the floor" in found
    bare = urdf().replace('<collision><geometry><sphere radius="0.05" length="0.02"/>', "<x><y>")
    bare = bare.replace("<x><y></geometry></collision>", "")
    assert "the URDF's wheel 'l_wheel' has no <collision>: it cannot roll" in errors(read, bare)[0]


@given(st.tuples(*[st.floats(-2, 2)] * 3))
@settings(
    deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_the_root_of_the_urdf_may_be_anywhere(read, at):
    assert read(urdf(at=at)).warnings == ()


def test_shapes_beyond_the_footprint_and_the_height_are_warnings(read):
    robot = read(urdf(), ROBOT.replace("20 cm", "12 cm").replace("0.2\n", "0.1\n"))
    outside, above = robot.warnings
    assert [(item.code, item.mark.line) for item in robot.warnings] == [("W303", 2), ("W303", 3)]
    # A wheel reaches 0.15 + 0.05 m; the circle of the footprint is a polygon round it.
    assert outside.sentence == "footprint: the URDF's link 'l_wheel' reaches 0.078 m beyond it"
    assert above.sentence == "height: the URDF's link 'base' reaches 0.050 m above it"
    shifted = urdf(at=(-0.12, 0, 0)).replace(
        '<origin xyz="-0.12 0 0.1"/>', '<origin xyz="0 0 0.1"/>'
    )
    (warning,) = read(shifted).warnings  # a box about the base frame, with the axle behind it
    assert "'base' reaches 0.085 m beyond it" in warning.sentence
    assert warning.hint.endswith("which is at [-0.12, 0, 0] in the URDF's frame 'base'")


LASER = (
    '<link name="laser_frame"/><joint name="lj" type="fixed"><parent link="base"/>'
    '<child link="laser_frame"/><origin xyz="0.1 0 0.18"/></joint>'
)
LIDAR = "lidar: {position: [10 cm, 0], height: 18 cm}\n"


@pytest.mark.parametrize(
    ("more", "lidar", "away"),
    [
        (LASER, LIDAR, None),
        (LASER, LIDAR.replace("10 cm", "0"), "0.100 m away"),
        (LASER, LIDAR.replace("18 cm", "30 cm"), "0.120 m away"),
        (LASER.replace("laser_frame", "top"), LIDAR.replace("10 cm", "0"), None),  # no lidar
        (LASER.replace("laser_frame", "top") + TOP_SENSOR, LIDAR.replace("10 cm", "0"),
         "0.100 m away"),
        (LASER + LASER.replace("lj", "lk").replace("laser_frame", "laser_mount"), LIDAR, None),
    ],
)  # fmt: skip
def test_a_lidar_away_from_its_link_is_a_warning(read, more, lidar, away):
    robot = read(urdf(more=more), ROBOT + lidar)
    if away is None:
        assert robot.warnings == ()
    else:
        (warning,) = robot.warnings
        assert (warning.code, warning.mark.line) == ("W303", 6)
        assert away in warning.sentence


ON_BASE = (
    '<gazebo reference="base"><sensor name="laser" type="ray"><pose {more}>0.1 0 0.18 {angles}'
    "</pose></sensor></gazebo>"
)


@pytest.mark.parametrize(
    ("angles", "more", "lidar", "told"),
    [
        ("0 0 0", "", LIDAR, ""),
        ("0 0 0", "", LIDAR.replace("10 cm", "0"), "is at [0.1, 0, 0.18] m in the base frame, 0.1"),
        (f"{pi} 0 0", "", LIDAR, "is upside down"),
        ("180 0 0", 'degrees="true"', LIDAR, "is upside down"),
    ],
)
def test_a_sensor_of_gazebo_has_a_pose_on_its_link(read, angles, more, lidar, told):
    text = urdf(more=ON_BASE.format(angles=angles, more=more))
    found = [warning.sentence for warning in read(text, ROBOT + lidar).warnings]
    assert len(found) == bool(told) and all(told in sentence for sentence in found)


def test_a_pose_of_a_sensor_that_is_no_pose_is_an_error(read):
    (line,) = errors(read, urdf(more=ON_BASE.format(angles="0 up", more="")), ROBOT + LIDAR)
    assert "<pose>: expected 6 numbers, got" in line


TURNED = LASER.replace("<origin ", f'<origin rpy="{pi} 0 0" ')
ROLLED = LIDAR.replace("}", ", roll: 180 deg}")


@pytest.mark.parametrize(
    ("more", "lidar", "told"),
    [
        (LASER, LIDAR, None), (TURNED, ROLLED, None), (LASER, ROLLED, "upright"),
        (TURNED, LIDAR, "upside down"), (TURNED.replace(f"{pi}", "1.57"), LIDAR, None),  # tilted
    ],
)  # fmt: skip
def test_a_lidar_upside_down_in_one_file_alone_is_a_warning(read, more, lidar, told):
    found = [warning.sentence for warning in read(urdf(more=more), ROBOT + lidar).warnings]
    assert found == ([f"lidar: roll: the URDF's sensor on 'laser_frame' is {told}"] if told else [])


OMNI = """robot: r
footprint: {radius: 20 cm}
height: 0.2
urdf: r.urdf
wheels:
  drive: omni
  radius: 5 cm
  mounts:
    - {joint: a, at: [10 cm, 0, 90 deg]}
    - {joint: b, at: [-5 cm, 8.66 cm, 210 deg]}
    - {joint: c, at: [-5 cm, -8.66 cm, -30 deg]}
limits: {lateral_speed: 0.5}
"""


def omni(first=(0.1, 0.0, pi / 2), axis="0 1 0"):
    text = f'<robot name="r"><link name="base">{INERTIAL}</link>'
    places = (first, (-0.05, 0.0866, 7 * pi / 6), (-0.05, -0.0866, -pi / 6))
    for name, (x, y, yaw) in zip("abc", places, strict=True):
        text += (
            f'<link name="{name}l">{INERTIAL}{ball(0.05)}</link><joint name="{name}" '
            f'type="continuous"><parent link="base"/><child link="{name}l"/><axis xyz="{axis}"/>'
            f'<origin xyz="{x} {y} 0.05" rpy="0 0 {yaw}"/></joint>'
        )
    return text + "</robot>"


def test_mounts_of_omnidirectional_wheels_are_compared(read):
    assert read(omni(), OMNI).warnings == ()
    assert read(omni(axis="0 -1 0"), OMNI).model == read(omni(), OMNI).model
    found = errors(read, omni(first=(0.16, 0.0, pi / 2)), OMNI)
    # The base frame is where the mounts have it on average: 2 cm further forward.
    assert any("the x of the wheel 'a' is 0.1 m, but 0.14 m in the URDF" in line for line in found)
    (found,) = errors(read, omni(first=(0.1, 0.0, 0.3)), OMNI)
    assert "wheel joint 'a' turns about" in found and "the axle must be [-1, 0, 0]" in found


CAR = """robot: r
footprint: [[0.6, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.6, -0.3]]
height: 0.4
urdf: r.urdf
wheels:
  drive: ackermann
  steering: [sl, sr]
  rear: [rl, rr]
  radius: 8 cm
  wheelbase: 40 cm
  track: 30 cm
  steering_angle: 30 deg
  steering_speed: 2.0
"""


def car(*, base=0.4, track=0.3, front=0.3, upright="0 0 1"):
    text = f'<robot name="r"><link name="base">{INERTIAL}</link>'
    for name, x, y in (
        ("rl", 0.0, track / 2), ("rr", 0.0, -track / 2),
        ("sl", base, front / 2), ("sr", base, -front / 2),
    ):  # fmt: skip
        steers = name[0] == "s"
        kind, axis = ("revolute", upright) if steers else ("continuous", "0 1 0")
        limit = '<limit lower="-0.8" upper="0.9" effort="9" velocity="9"/>' if steers else ""
        text += (
            f'<link name="{name}l">{INERTIAL}{ball(0.08)}</link><joint name="{name}" type="{kind}">'
            f'<parent link="base"/><child link="{name}l"/><axis xyz="{axis}"/>'
            f'<origin xyz="{x} {y} 0.08"/>{limit}</joint>'
        )
    return text + "</robot>"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"base": 0.5}, "the wheelbase is 0.4 m, but 0.5 m in the URDF"),
        ({"base": -0.4}, "the wheelbase is 0.4 m, but -0.4 m in the URDF"),
        ({"track": 0.4}, "the track of the rear wheels is 0.3 m, but 0.4 m in the URDF"),
        ({"front": -0.2}, "the distance of the steering joints is 0.2 m, but -0.2 m in the URDF"),
        ({"front": 1.5}, "the centre of rotation is 0.69 m from the middle, between the steering"),
        ({"upright": "0 1 0"}, "steering joint 'sl' turns about [0, 1, 0]"),
    ],
)
def test_a_car_is_compared(read, changes, sentence):
    assert read(car(), CAR).warnings == ()
    found = errors(read, car(**changes), CAR)
    assert any(sentence in line for line in found), found


@pytest.mark.parametrize("front", [0.2, 0.26, 0.4])
def test_the_axles_of_a_car_meet_in_one_point_whatever_its_front_track(read, front):
    """The steering angles need the distance of the URDF's steering joints, not `track`."""
    robot = read(car(front=front), CAR)
    drive = robot.drivetrain
    command = drive.to_wheels(drive.state_at(Twist(0.5, 0.5), drive.at_rest))  # radius 1 m
    left, right = command.steering
    assert 0.4 / tan(left) + front / 2 == pytest.approx(1.0)
    assert 0.4 / tan(right) - front / 2 == pytest.approx(1.0)
    rolled = [0.5 * (1 - 0.15), 0.5 * (1 + 0.15)]
    assert drive.from_wheels(rolled, (0.0, 0.0), command.steering).heading == pytest.approx(0.5)


def test_a_steering_axis_that_points_down_is_reversed_with_its_limits(read):
    text = read(car(upright="0 0 -1"), CAR).model
    assert text.count('<axis xyz="0.0 0.0 1.0"/>') == 2
    assert 'lower="-0.9" upper="0.8"' in text


def test_a_stop_that_tips_the_robot_over_is_a_warning(read):
    """Three bodies of 1 kg, one 0.9 m up: the centre is (0.9 + 2 * 0.05) / 3 = 0.333 m high.

    It is 0.2 m behind the front of the footprint: g * 0.2 / 0.333 = 5.9 m/s².
    """
    square = "footprint: [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]"
    robot = ROBOT.replace("footprint: {radius: 20 cm}", square)

    def tips(limits):
        found = read(urdf(centre=0.9), f"{robot}limits: {{{limits}}}\n").warnings
        return [item.sentence for item in found if "tips" in item.sentence]

    assert tips("stop_deceleration: 5.8") == []
    (sentence,) = tips("stop_deceleration: 6")
    assert "centre of mass is 0.33 m high and 0.20 m behind the front" in sentence
    assert sentence.endswith("bears 5.9 m/s²")
    assert len(tips("linear_deceleration: 6")) == 1  # a stop is never softer
