"""Links of a URDF: their frames, in which other programs place what they show, and shapes."""

from types import SimpleNamespace

import numpy as np
import pytest

from stack.errors import InputError
from stack.telemetry.foxglove.urdf_links import LinkFrame, Links, LinkShape, links_of, rotation_of
from tests.stack.telemetry.foxglove_reader import turn


def about(axis, angle):
    """Rotation about the x, y or z axis."""
    c, s = np.cos(angle), np.sin(angle)
    first, second = ((1, 2), (2, 0), (0, 1))[axis]
    found = np.eye(3)
    found[[first, second], [first, second]] = c
    found[first, second], found[second, first] = -s, s
    return found


@pytest.mark.parametrize(
    "angles", [(0, 0, 0), (0.3, 0, 0), (0, -1.2, 0), (0, 0, 2.5), (0.4, -0.7, 2.9), (-3, 1.5, 1)]
)
def test_roll_pitch_and_yaw_turn_about_fixed_axes(angles):
    """The URDF's definition: first roll about x, then pitch about y, then yaw about z."""
    x, y, z, w = rotation_of(angles)
    roll, pitch, yaw = angles
    expected = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    assert turn(SimpleNamespace(x=x, y=y, z=z, w=w)) == pytest.approx(expected, abs=1e-12)


def robot(links, joints):
    return (
        "<robot name='r'>"
        + "".join(f"<link name='{name}'/>" for name in links)
        + "".join(
            f"<joint name='{parent}_{child}' type='fixed'><parent link='{parent}'/>"
            f"<child link='{child}'/>{origin}</joint>"
            for parent, child, origin in joints
        )
        + "</robot>"
    )


@pytest.mark.parametrize(
    ("links", "joints", "expected"),
    [
        ("ab", [("a", "b", "")], [("base", "a"), ("a", "b")]),
        (["base", "arm"], [("base", "arm", "")], [("base", "arm")]),  # the root is our base
        (
            ["foot", "base"],
            [("foot", "base", "")],
            [("base", "foot"), ("foot", "base_link")],  # REP 120's base_footprint, renamed
        ),
        (["a", "map"], [("a", "map", "")], [("base", "a"), ("a", "map_link")]),
    ],
)
def test_every_link_hangs_below_the_base_and_no_name_is_taken_twice(links, joints, expected):
    found = links_of(robot(links, joints)).frames
    assert [(frame.parent, frame.name) for frame in found] == expected
    assert len({frame.name for frame in found}) == len(found)


def test_an_origin_places_a_link():
    origin = "<origin xyz='0.1 -0.2  0.3'/>"
    assert links_of(robot("ab", [("a", "b", origin)])).frames[1] == LinkFrame(
        "a", "b", (0.1, -0.2, 0.3)
    )
    assert links_of("") == Links()


def test_shapes_have_their_link_their_size_and_their_colour():
    """A cylinder on its side, a box with a colour that is defined for the robot, and a mesh."""
    urdf = """<robot name='r'><material name='red'><color rgba='1 0 0 0.5'/></material>
      <link name='base'>
        <visual><origin xyz='0 0 0.1' rpy='1.5707963267948966 0 0'/>
          <geometry><cylinder radius='0.2' length='0.5'/></geometry></visual>
        <visual><geometry><mesh filename='a.dae'/></geometry></visual>
        <collision><geometry><box size='9 9 9'/></geometry></collision></link>
      <link name='odom'><visual><geometry><box size='1 2 3'/></geometry>
        <material name='red'/></visual></link>
      <joint name='j' type='fixed'><parent link='base'/><child link='odom'/></joint></robot>"""
    cylinder, box = links_of(urdf).shapes
    assert (cylinder.frame, cylinder.kind, cylinder.size) == ("base", "cylinder", (0.4, 0.4, 0.5))
    assert cylinder.position == (0.0, 0.0, 0.1)
    assert cylinder.rotation == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5))
    assert box == LinkShape(
        "odom_link", "box", (1.0, 2.0, 3.0), (0.0,) * 3, (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    )


@pytest.mark.parametrize(
    "urdf",
    [
        "<robot>",
        "no XML",
        robot("a", [("a", "b", "")]),
        robot("ab", [("a", "b", "<origin xyz='1 2'/>")]),
    ],
)
def test_a_damaged_urdf_is_an_error_of_the_input(urdf):
    with pytest.raises(InputError, match="URDF of the recording is damaged"):
        links_of(urdf)
