"""The wheels of robot files: three kinds of drive, where mistakes are reported, and the URDFs."""

from dataclasses import replace
from itertools import combinations
from math import atan, degrees, hypot, pi, radians, tan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.omnidirectional import OmniWheels
from stack.errors import InputError
from stack.sim.physics.pybullet_engine.engine import BulletEngine
from stack.sim.worlds.world import World
from stack.types import Pose2D

JOINTS = [
    *((name, "continuous", "") for name in ("a", "b", "c", "d", "e")),
    ("s", "revolute", '<limit lower="-0.8" upper="0.8"/>'),
    ("t", "revolute", '<limit lower="-0.8" upper="0.8"/>'),
    ("short", "revolute", '<limit lower="-0.5" upper="0.8"/>'),
    ("still", "fixed", ""),
]
INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'


def urdf_of(places, radius):
    """A URDF with the joints of JOINTS: at x, y, yaw where that is given, else at the origin."""
    parts = [f'<robot name="r"><link name="base">{INERTIAL}</link>']
    for name, kind, limit in JOINTS:
        x, y, yaw = places.get(name, (0.0, 0.0, 0.0))
        axis = "0 0 1" if kind == "revolute" else "0 1 0"
        parts.append(
            f'<link name="{name}_link">{INERTIAL}<collision><geometry><sphere radius="{radius}"/>'
            f'</geometry></collision></link><joint name="{name}" type="{kind}">{limit}'
            f'<parent link="base"/><child link="{name}_link"/><axis xyz="{axis}"/>'
            f'<origin xyz="{x} {y} {radius}" rpy="0 0 {yaw}"/></joint>'
        )
    return "".join([*parts, "</robot>"])


ON_SIDES = {"a": (0.0, 0.15, 0.0), "b": (0.0, -0.15, 0.0)}
ON_CORNERS = {**ON_SIDES, "s": (0.4, 0.15, 0.0), "t": (0.4, -0.15, 0.0), "short": (0.4, -0.15, 0.0)}
AROUND = {"a": (0.1, 0.0, pi / 2), "b": (-0.05, 0.09, 7 * pi / 6), "c": (-0.05, -0.09, -pi / 6)}
URDFS = {
    "differential": urdf_of(ON_SIDES, 0.05), "skid_steered": urdf_of(ON_SIDES, 0.1),
    "omni": urdf_of(AROUND, 0.05), "ackermann": urdf_of(ON_CORNERS, 0.08),
}  # fmt: skip
HEAD = "robot: r\nfootprint: {radius: 20 cm}\nheight: 0.4\nurdf: r.urdf\n"
OMNI = f"""{HEAD}wheels:
  drive: omni
  radius: 5 cm
  mounts:
    - {{joint: a, at: [10 cm, 0, 90 deg]}}
    - {{joint: b, at: [-5 cm, 9 cm, 210 deg]}}
    - {{joint: c, at: [-5 cm, -9 cm, -30 deg]}}
limits: {{lateral_speed: 0.5}}
"""
CAR = f"""{HEAD}wheels:
  drive: ackermann
  steering: [s, t]
  rear: [a, b]
  radius: 8 cm
  wheelbase: 40 cm
  track: 30 cm
  steering_angle: 30 deg
  steering_speed: 2.0
"""
SKID = f"""{HEAD}wheels:
  drive: skid_steered
  left: [a]
  right: [b]
  radius: 10 cm
  track: 40 cm
  effective_track: 60 cm
skid: {{icr_ratio: 1.4}}
"""
SIDES = f"{HEAD}wheels: {{left: [a], right: [b], radius: 5 cm, separation: 0.3}}\n"


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        kind = next((kind for kind in URDFS if f"drive: {kind}" in text), "differential")
        (tmp_path / "r.urdf").write_text(URDFS[kind])
        (tmp_path / "robot.yaml").write_text(text)
        return read_robot(tmp_path / "robot.yaml")

    return read_text


def test_the_default_drive_is_differential(read):
    robot = read(SIDES)
    assert (robot.drivetrain.kind, robot.turning_radius) == ("differential", 0.0)
    assert read(SIDES.replace("{left", "{drive: differential, left")).wheels == robot.wheels


def test_a_skid_steered_robot(read):
    robot = read(SKID)
    assert (robot.drivetrain.kind, robot.drivetrain.skids) == ("skid_steered", True)
    assert (robot.drivetrain.track, robot.drivetrain.effective_track) == (0.4, 0.6)
    assert (robot.skid.icr_ratio, robot.skid.slip) == (1.4, 1.0)


def test_an_omnidirectional_robot(read):
    robot = read(OMNI)
    assert (robot.drivetrain.kind, robot.turning_radius) == ("omni", 0.0)
    assert robot.wheels.joints == ("a", "b", "c")
    assert robot.wheels.mounts[1] == Pose2D(-0.05, 0.09, radians(210))


def test_a_car(read):
    robot = read(CAR)
    assert robot.drivetrain.kind == "ackermann"
    assert robot.wheels.rear == ("a", "b")
    assert robot.turning_radius == pytest.approx(0.4 / tan(pi / 6))


@pytest.mark.parametrize(
    ("text", "old", "new", "expected"),
    [
        (SIDES, "{left", "{drive: omnii, left", "5:17 E301 drive: 'omnii' is not one of"),
        (SIDES, "separation: 0.3", "wheelbase: 0.3", "5:1 E301 `wheels` needs the key 'sepa"),
        (SIDES, "0.3}", "0.3, track: 0.3}",
         "5:64 E301 wheels: 'track' is for drive: skid_steered or ackermann"),
        (SIDES, "0.3}", "0.3, trak: 0.3}", "5:64 E301 `wheels` has no key 'trak'"),
        (SIDES, "0.3}", "0.3}\nskid: {}", "6:1 E301 skid: these wheels do not skid in turns"),
        (SKID, "  track: 40 cm\n", "", "5:1 E301 `wheels` needs the key 'track'"),
        (OMNI, "  radius", "  left: [a]\n  radius", "7:3 E301 wheels: 'left' is for drive: diff"),
        (OMNI, "  radius: 5 cm\n", "", "5:1 E301 `wheels` needs the key 'radius'"),
        (OMNI, "joint: a, ", "", "9:7 E301 a wheel under `mounts` needs the key 'joint'"),
        (OMNI, "[10 cm, 0, 90 deg]", "[10 cm, 0]", "9:22 E301 at: expected [x, y, heading], got a"),
        (OMNI, "joint: a", "joint: still", "9:15 E302 wheels: the URDF's joint 'still' is fixed"),
        (OMNI, "joint: a", "joint: aa", "9:15 E302 wheels: the URDF has no joint 'aa'"),
        (OMNI, "0.5}", "0}", "12:25 E301 limits: an omnidirectional robot needs a lateral_speed a"),
        (OMNI, "limits: {lateral_speed: 0.5}", "", "1:1 E301 limits: an omnidirectional robot nee"),
        (SIDES, "0.3}", "0.3}\nlimits: {lateral_speed: 0.4}",
         "6:25 E301 lateral_speed: these wheels cannot drive sideways, got 0.4"),
        (CAR, "0.4\nurdf", "0.4\nlimits: {lateral_speed: 0.4}\nurdf",
         "4:25 E301 lateral_speed: these wheels cannot drive sideways, got 0.4"),
        (CAR, "  wheelbase: 40 cm\n", "", "5:1 E301 `wheels` needs the key 'wheelbase'"),
        (CAR, "[a, b]", "[a]", "8:9 E301 rear: expected [left, right], got 1 joints"),
        (CAR, "[a, b]", "[a, s]", "8:13 E302 wheels: the URDF's joint 's' is revolute"),
        (CAR, "[s, t]", "[s, c]", "7:17 E302 wheels: the URDF's joint 'c' is continuous"),
        (CAR, "[s, t]", "[s, short]", "7:17 E302 wheels: the URDF's joint 'short' turns from -0.5"),
        (CAR, "30 deg", "90 deg", "12:19 E301 steering_angle: 1.5708 rad must be at most 1.4"),
        (CAR, "30 deg", "75 deg", "5:1 E301 wheels: with a steering_angle of 75 deg the centre"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_where_it_stands(read, text, old, new, expected):
    assert text.replace(old, new) != text
    with pytest.raises(InputError) as caught:
        read(text.replace(old, new))
    found = [
        f"{item.mark.line}:{item.mark.column} {item.code} {item.sentence}"
        for item in caught.value.findings
    ]
    assert any(finding.startswith(expected) for finding in found), found


PARALLEL = "[10 cm, 0, 90 deg]", "[-5 cm, 9 cm, 90 deg]", "[-5 cm, -9 cm, 90 deg]"
CONCURRENT = "[10 cm, 0, 0]", "[-5 cm, 9 cm, -60.945396 deg]", "[-5 cm, -9 cm, 60.945396 deg]"


@pytest.mark.parametrize("places", [PARALLEL, CONCURRENT], ids=["parallel", "through the middle"])
def test_wheels_that_cannot_make_all_velocities_are_refused(read, places):
    rows = "".join(
        f"    - {{joint: {joint}, at: {at}}}\n" for joint, at in zip("abc", places, strict=True)
    )
    start, end = OMNI.index("    - {"), OMNI.index("limits")
    text = OMNI[:start] + rows + OMNI[end:]
    with pytest.raises(InputError, match="cannot drive forward, sideways and turn independently"):
        read(text)
    two = text.replace(rows, "".join(rows.splitlines(keepends=True)[:2]))
    with pytest.raises(InputError, match="at least 3 wheels are required, got 2"):
        read(two)


@given(
    st.lists(
        st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-pi, pi)),
        min_size=3, max_size=4,
    )
)  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_the_jacobian_is_every_wheel_s_own_velocity(mounts):
    wheels = OmniWheels(tuple("abcd"[: len(mounts)]), tuple(Pose2D(*m) for m in mounts), 0.05)
    twist = np.array([0.3, -0.2, 0.7])
    for row, (x, y, heading) in zip(wheels.jacobian, mounts, strict=True):
        velocity = np.array([twist[0] - twist[2] * y, twist[1] + twist[2] * x])  # v + w x r
        assert row @ twist == pytest.approx(velocity @ [np.cos(heading), np.sin(heading)])


@pytest.fixture
def placed():
    """Where the URDF has the tyres of a shipped robot; and its description."""
    opened = []

    def place(name):
        robot = read_robot(find_robot(name, Path()))
        world = World("empty", (-2.0, -2.0, 2.0, 2.0))
        opened.append(BulletEngine(world))
        return robot, opened[-1].add_robot(robot, Pose2D(0.0, 0.0)).wheel_places

    yield place
    for physics in opened:
        physics.close()


def test_the_urdf_s_sides_are_the_odometry_s(placed):
    robot, places = placed("scout")
    half = robot.wheels.separation / 2
    assert places == pytest.approx(np.array([[0.0, half], [0.0, -half]]), abs=2e-3)


def test_the_urdf_s_omnidirectional_wheels_are_the_odometry_s(placed):
    robot, places = placed("glide")
    mounts = [[mount.x, mount.y] for mount in robot.wheels.mounts]
    assert places == pytest.approx(np.array(mounts), abs=1e-4)
    for one, other in combinations(robot.wheels.mounts, 2):
        assert hypot(one.x - other.x, one.y - other.y) == pytest.approx(0.15 * 3**0.5, abs=1e-4)


def test_the_urdf_s_car_is_the_odometry_s(placed):
    robot, places = placed("buggy")
    wheels = robot.wheels
    assert isinstance(wheels, SteeredWheels)
    half, base = wheels.track / 2, wheels.wheelbase
    expected = [[0.0, half], [0.0, -half], [base, half], [base, -half]]
    assert places == pytest.approx(np.array(expected), abs=1e-4)
    assert robot.turning_radius == pytest.approx(0.704, abs=1e-3)
    inner = degrees(atan(base / (robot.turning_radius - half)))
    assert inner == pytest.approx(38.96, abs=0.01)


def test_an_axle_across_its_link_is_refused():
    from stack.errors import BodyError

    robot = read_robot(find_robot("glide", Path()))
    askew = robot.model.replace('<axis xyz="0.0 1.0 0.0"/>', '<axis xyz="0.6 0.8 0"/>')
    assert askew != robot.model
    engine = BulletEngine(World("empty", (-2.0, -2.0, 2.0, 2.0)))
    with pytest.raises(
        BodyError, match=r"axle of the wheel joint 'left_wheel' is .* use the axis 0 1"
    ):
        engine.add_robot(replace(robot, model=askew), Pose2D(0.0, 0.0))
    engine.close()
