"""Frames of a URDF's links, in which other programs place what they show."""

from types import SimpleNamespace

import numpy as np
import pytest

from stack.errors import InputError
from stack.telemetry.foxglove.urdf_frames import LinkFrame, link_frames, rotation_of
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
    found = list(link_frames(robot(links, joints)))
    assert [(frame.parent, frame.name) for frame in found] == expected
    assert len({frame.name for frame in found}) == len(found)


def test_an_origin_places_a_link():
    origin = "<origin xyz='0.1 -0.2  0.3'/>"
    assert list(link_frames(robot("ab", [("a", "b", origin)])))[1] == LinkFrame(
        "a", "b", (0.1, -0.2, 0.3)
    )
    assert list(link_frames("")) == []


@pytest.mark.parametrize(
    "urdf", ["<robot>", "no XML", robot("ab", [("a", "b", "<origin xyz='1 2'/>")])]
)
def test_a_damaged_urdf_is_an_error_of_the_input(urdf):
    with pytest.raises(InputError, match="URDF of the recording is damaged"):
        list(link_frames(urdf))
