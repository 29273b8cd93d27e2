"""The URDF for the simulation: what it weighs, where its wheels are, which way they turn."""

from math import pi
from re import sub

import numpy as np
import pybullet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import read_robot
from robots.urdf.model import RobotModel, combined, inertial_of
from robots.urdf.physics import physics_urdf
from stack.documents import Findings
from stack.documents.xml_file import parse_xml
from stack.errors import InputError
from stack.sim.physics.pybullet_engine.engine import BulletEngine
from stack.sim.physics.pybullet_engine.robot import load_robot
from stack.sim.worlds.world import World
from stack.types import Pose2D

EMPTY = World("empty", (-5.0, -5.0, 5.0, 5.0))


def inertial(mass, moment=0.01, centre="0 0 0"):
    return (
        f'<inertial><origin xyz="{centre}" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" iyy="{1.2 * moment}" izz="{1.5 * moment}"/></inertial>'
    )


def link(name, inside=""):
    return f'<link name="{name}">{inside}</link>'


def joint(name, parent, child, origin="0 0 0", rpy="0 0 0", kind="fixed", axis="0 1 0"):
    limit = '<limit lower="-1" upper="1" effort="9" velocity="9"/>' if kind != "continuous" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def sphere(radius):
    return f'<collision><geometry><sphere radius="{radius}"/></geometry></collision>'


@pytest.fixture(scope="module")
def client():
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


parts = st.tuples(
    st.integers(0, 20),  # its parent among the parts before it
    st.sampled_from(["fixed", "fixed", "continuous", "revolute", "prismatic"]),
    st.sampled_from([0.0, 0.0, 0.2, 3.0]),  # its mass; without <inertial> where it is 0
    st.lists(st.floats(-0.4, 0.4), min_size=3, max_size=3),
    st.lists(st.floats(-pi, pi), min_size=3, max_size=3),
    st.booleans(),  # whether it is a ball
)


def tree_of(listed):
    """A URDF of a base and these parts; a part without mass moves nothing."""
    text = [link("p0", inertial(2.0))]
    for number, (parent, kind, mass, at, turn, is_ball) in enumerate(listed, 1):
        if mass == 0.0 and kind == "continuous":
            kind = "fixed"
        text.append(
            link(f"p{number}", (inertial(mass) if mass else "") + (sphere(0.03) if is_ball else ""))
        )
        origin, rpy = (" ".join(map(str, three)) for three in (at, turn))
        text.append(joint(f"j{number}", f"p{parent % number}", f"p{number}", origin, rpy, kind))
    return f'<robot name="r">{"".join(text)}</robot>'


@given(st.lists(parts, min_size=1, max_size=8))
@settings(deadline=None, max_examples=60)
def test_the_simulated_robot_weighs_what_its_urdf_says(client, listed):
    model = RobotModel(parse_xml(tree_of(listed).encode(), "r.urdf"))
    findings = Findings()
    robot = load_robot(pybullet, client, physics_urdf(model, np.zeros(3), {}, findings))
    assert not findings.errors
    ends = range(-1, pybullet.getNumJoints(robot, physicsClientId=client))
    masses = [pybullet.getDynamicsInfo(robot, n, physicsClientId=client)[0] for n in ends]
    assert sum(masses) == pytest.approx(2.0 + sum(mass for _, _, mass, *_ in listed), rel=1e-9)
    # All centres of mass together are where the URDF has them.
    whole = combined(
        [
            found.moved(model.poses[name])
            for name, element in model.links.items()
            if (found := inertial_of(element)) is not None
        ]
    )
    base, _ = pybullet.getBasePositionAndOrientation(robot, physicsClientId=client)
    centres = [np.array(base)] + [
        np.array(pybullet.getLinkState(robot, n, physicsClientId=client)[0]) for n in ends[1:]
    ]
    middle = sum(mass * at for mass, at in zip(masses, centres, strict=True)) / sum(masses)
    assert middle == pytest.approx(whole.centre, abs=1e-6)
    pybullet.removeBody(robot, physicsClientId=client)


def test_lumped_links_have_the_inertia_of_the_parallel_axis_theorem(client):
    """Two point-like masses of 1 kg, 0.6 m apart along x: m d²/2 = 0.18 kg m² about y and z."""
    text = link("a", inertial(1, 1e-9)) + link("b", inertial(1, 1e-9))
    text = f'<robot name="r">{text}{joint("j", "a", "b", "0.6 0 0")}</robot>'
    model = RobotModel(parse_xml(text.encode(), "r.urdf"))
    found = Findings()
    robot = load_robot(pybullet, client, physics_urdf(model, np.zeros(3), {}, found))
    info = pybullet.getDynamicsInfo(robot, -1, physicsClientId=client)
    assert sorted(info[2])[1:] == pytest.approx([0.18, 0.18], rel=1e-4)
    assert info[3] == pytest.approx([0.3, 0.0, 0.0])


ROBOT = """robot: r
footprint: {radius: 30 cm}
height: 0.4
urdf: r.urdf
wheels: {left: [l], right: [r], radius: 5 cm, separation: 0.3}
"""


def cart(
    at=(0.0, 0.0, 0.0), left=("0 0 0", "0 1 0"), right=("0 0 0", "0 1 0"), more="",
    caster='<sphere radius="0.02"/>', lift=0.0,
):  # fmt: skip
    """A cart whose base frame is at a place in its root's frame; wheels with rpy and axis."""
    x, y, z = at
    wheels = "".join(
        link(f"{name}_wheel", inertial(0.2, 2e-4) + sphere(0.05))
        + joint(
            name, "chassis", f"{name}_wheel", f"{x} {y + side} {z + 0.05}", rpy, "continuous", axis
        )
        for name, side, (rpy, axis) in (("l", 0.15, left), ("r", -0.15, right))
    )
    casters = "".join(
        link(f"caster{side}", f"<collision><geometry>{caster}</geometry></collision>")
        + joint(f"to{side}", "chassis", f"caster{side}", f"{x + side * 0.12} {y} {z + 0.02 + lift}")
        for side in (-1, 1)
    )
    body = inertial(3, 0.03, f"{x} {y} {z + 0.08}")
    box = (
        f'<collision><origin xyz="{x} {y} {z + 0.1}"/><geometry><box size="0.3 0.2 0.06"/>'
        "</geometry></collision>"
    )
    chassis = link("root") + link("chassis", body + box) + joint("foot", "root", "chassis")
    return f'<robot name="r">{chassis}{wheels}{casters}{more}</robot>'


@pytest.fixture
def read(tmp_path):
    def read_text(urdf, robot=ROBOT):
        (tmp_path / "r.urdf").write_text(urdf)
        (tmp_path / "robot.yaml").write_text(robot)
        return read_robot(tmp_path / "robot.yaml")

    return read_text


@pytest.fixture
def placed():
    opened = []

    def place(robot):
        opened.append(BulletEngine(EMPTY))
        return opened[-1], opened[-1].add_robot(robot, Pose2D(0.0, 0.0))

    yield place
    for physics in opened:
        physics.close()


@pytest.mark.parametrize("at", [(0, 0, 0), (-0.12, 0, 0), (0.3, 0.1, 0), (0, 0, -0.05), (1, -1, 1)])
def test_the_base_frame_is_where_the_wheels_say(read, placed, at):
    robot = read(cart(at))
    physics, body = placed(robot)
    assert robot.warnings == ()  # the footprint holds the shapes wherever the URDF's root is
    assert body.wheel_places == pytest.approx(np.array([[0.0, 0.15], [0.0, -0.15]]), abs=1e-7)
    physics.step(250)
    assert body.base_state().position == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)
    assert body.tilt < 5e-3


@pytest.mark.parametrize("caster", [
    '<cylinder radius="0.015" length="0.04"/>', '<box size="0.04 0.04 0.04"/>',
    '<capsule radius="0.01" length="0.02"/>',
])  # fmt: skip
def test_a_fixed_part_that_stands_on_the_floor_is_a_warning_unless_it_is_a_ball(read, caster):
    """The rims of two cylinders lift the wheels by 0.7 mm: these turn, and the robot stands."""
    found = [str(item) for item in read(cart(caster=caster)).warnings]
    assert all(f"'caster{side}'" in text for side, text in zip((-1, 1), found, strict=True))
    assert all("stands on the floor with a " in text and "W303" in text for text in found)
    assert read(cart(caster=caster, lift=0.01)).warnings == ()


UP, DOWN = (f"{pi / 2} 0 0", "0 0 -1"), (f"{-pi / 2} 0 0", "0 0 1")
ACROSS, BACKWARD = ("0 0 0", "0 1 0"), ("0 0 0", "0 -1 0")


@pytest.mark.parametrize(
    ("left", "right"),
    [(ACROSS, ACROSS), (BACKWARD, BACKWARD), (ACROSS, BACKWARD), (UP, DOWN),
     ((f"{pi / 2} 0 0", "0 0 1"), DOWN), ((f"0 0 {pi}", "0 2 0"), ACROSS)],
)  # fmt: skip
def test_wheels_drive_forward_whichever_way_their_axles_point(read, placed, left, right):
    physics, body = placed(read(cart(left=left, right=right)))
    body.set_wheel_speeds(4.0, 4.0)  # 4 rad/s at 5 cm: 0.2 m/s
    physics.step(500)
    pose = body.truth().pose
    assert pose.x == pytest.approx(0.2, abs=0.02)
    assert abs(pose.heading) < 0.02


def test_joints_that_the_drive_does_not_name_are_fixed_unless_they_roll(read):
    arm = link("arm", inertial(0.5)) + joint("lift", "chassis", "arm", kind="revolute")
    spinner = link("spinner") + joint("spin", "chassis", "spinner", kind="continuous")
    roller = link("roller", inertial(0.1)) + joint("roll", "chassis", "roller", kind="continuous")
    text = read(cart(more=arm + spinner + roller)).model
    assert [name for name in ("arm", "spinner", "roller") if f'<link name="{name}"' in text] == [
        "roller"
    ]


def test_other_elements_may_name_joints_and_links_again(read):
    again = (
        '<ros2_control name="c" type="system"><joint name="l"><command_interface name="velocity"/>'
        '</joint></ros2_control><transmission name="t"><joint name="r"/></transmission>'
        '<gazebo reference="chassis"><joint name="l"/><link name="chassis"/>'
        '<mass value="x"/></gazebo>'
    )
    assert read(cart(more=again)).warnings == ()


def no_inertial(text, name):
    start = text.index("<inertial>", text.index(f'<link name="{name}">'))
    end = text.index("</inertial>", start) + len("</inertial>")
    return text[:start] + text[end:]


CART = cart()
ERRORS = [
    (no_inertial(CART, "l_wheel"), "the link 'l_wheel' moves but has no mass"),
    (no_inertial(CART, "chassis"), "the link 'root' is the base but has no mass"),
    (sub(r'ixx="0.0002" iyy="[^"]*" izz="[^"]*"', 'ixx="0" iyy="0" izz="0"', CART),
     "the inertia of the link 'l_wheel' is not possible: its principal moments are 0, 0, 0"),
    (CART.replace('<child link="l_wheel"/>', '<child link="wheel"/>'),
     "the child of the joint 'l', 'wheel', is not a link"),
    (CART.replace('<parent link="chassis"/><child link="l_wheel"/>', '<parent link="chassis"/>'),
     "the joint 'l' has no <child link=…>"),
    (CART.replace('name="r" type', 'name="l" type'), "two joints are named 'l'"),
    (CART.replace('<link name="r_wheel">', '<link name="l_wheel">'),
     "two links are named 'l_wheel'"),
    (CART.replace("</robot>", link("alone") + "</robot>"),
     "neither 'root' nor 'alone' is the child"),
    (CART.replace('<child link="l_wheel"/>', '<child link="chassis"/>'),
     "the link 'chassis' is the child of two joints, 'foot' and 'l'"),
    (CART.replace("</robot>", link("a") + link("b") + joint("ab", "a", "b") + joint("ba", "b", "a")
                  + "</robot>"), "the joints above the link 'a' form a loop"),
    (CART.replace('name="foot" type="fixed"', 'name="foot" type="floating"'),
     "the joint 'foot' is of type 'floating', expected"),
    (cart(left=("0 0 0", "1 0 0")), "the URDF's wheel joint 'l' turns about [1, 0, 0]"),
    (cart(left=("0 0 0.3", "0 1 0")), "the axle must be [0, 1, 0]"),
    (cart(left=("0 0 0", "0 0 0")), "the axis of the joint 'l' is 0 0 0"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "sentence"), ERRORS, ids=[error[1][-30:] for error in ERRORS])
def test_a_urdf_that_cannot_be_simulated_is_an_error(read, text, sentence):
    assert text != CART
    with pytest.raises(InputError) as caught:
        read(text)
    assert any(sentence in item.sentence for item in caught.value.findings), caught.value.findings
    assert {item.code for item in caught.value.findings} == {"E302"}


def test_an_inertia_that_no_rigid_body_has_is_corrected_with_a_warning(read, client):
    """0.01 + 0.01 < 0.05: 0.03 is missing, and 0.04 + 0.04 = 0.08 suffices."""
    text = CART.replace('ixx="0.03" iyy="0.036" izz="0.045"', 'ixx="0.01" iyy="0.01" izz="0.05"')
    robot = read(text)
    (warning,) = robot.warnings
    assert (warning.code, warning.hint) == ("W302", "the simulation adds 0.03 to each")
    body = load_robot(pybullet, client, robot.model)
    moments = sorted(pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[2])
    assert moments == pytest.approx([0.04, 0.04, 0.08], rel=1e-4)


SKID = """robot: r
footprint: [[0.3, 0.25], [-0.3, 0.25], [-0.3, -0.25], [0.3, -0.25]]
height: 0.4
urdf: r.urdf
wheels:
  drive: skid_steered
  left: [fl, rl]
  right: [fr, rr]
  radius: 0.08
  track: 0.4
  effective_track: 0.6
skid: {slip: 0}
"""


def four_wheels(x=0.0):
    wheels = "".join(
        link(
            f"{name}_wheel",
            inertial(1.5, 2e-3)
            + '<collision><geometry><cylinder radius="0.08" length="0.04"/></geometry></collision>',
        )
        + joint(name, "base", f"{name}_wheel", f"{x + ahead} {side} 0.08", rpy, "continuous", axis)
        for name, ahead, side in (
            ("fl", 0.15, 0.2), ("rl", -0.15, 0.2), ("fr", 0.15, -0.2), ("rr", -0.15, -0.2)
        )
        for rpy, axis in [(f"{-pi / 2} 0 0", "0 0 1")]
    )  # fmt: skip
    body = (
        f'<collision><origin xyz="{x} 0 0.2"/><geometry><box size="0.5 0.3 0.1"/></geometry>'
        "</collision>"
    )
    return (
        f'<robot name="r">{link("base", inertial(20, 0.5, f"{x} 0 0.15") + body)}{wheels}</robot>'
    )


def test_the_axle_is_moved_towards_the_middle_whatever_else_is_on_one_side(read, placed):
    """An arm of five links, 1 m to the left of the base, does not move the wheels outwards."""
    arm = "".join(link(f"a{n}") + joint(f"aj{n}", "base", f"a{n}", "0 1 0.3") for n in range(5))
    text = four_wheels().replace("</robot>", f"{arm}</robot>")
    _, body = placed(read(text, SKID))
    assert body.wheel_places == pytest.approx(np.array([[0.0, 0.14], [0.0, -0.14]]), abs=1e-6)


@pytest.mark.parametrize("x", [0.0, 0.2])
def test_four_skidding_wheels_are_carried_on_one_axle(read, placed, x):
    robot = read(four_wheels(x), SKID)
    assert robot.warnings == ()
    physics, body = placed(robot)
    # Spheres of 8 cm reach no further to the side than the wheels: 0.2 + 0.02 - 0.08 m.
    assert body.wheel_places == pytest.approx(np.array([[0.0, 0.14], [0.0, -0.14]]), abs=1e-6)
    ends = range(-1, pybullet.getNumJoints(body.body, physicsClientId=body.client))
    masses = [pybullet.getDynamicsInfo(body.body, n, physicsClientId=body.client) for n in ends]
    assert sum(mass[0] for mass in masses) == pytest.approx(26.0)  # 20 + 4 * 1.5 kg
    body.set_wheel_speeds(3.0, 3.0)  # 3 rad/s at 8 cm: 0.24 m/s
    physics.step(500)
    assert body.truth().pose.x == pytest.approx(0.24, abs=0.03)
    assert abs(body.truth().pose.heading) < 0.02 and body.tilt < 0.01
