"""URDFs whose numbers or files the physics cannot use: findings with their line."""

import os

import pytest

from robots.load import HERE, read_robot, robot_names
from robots.urdf import read_urdf
from stack.errors import InputError

TEXT = """<robot name="r">
 <link name="base">
  <inertial>
   <origin xyz="0 0 0.1"/>
   <mass value="11"/>
   <inertia ixx="0.1" iyy="0.1" izz="0.2" ixy="0" ixz="0" iyz="0"/>
  </inertial>
  <visual><geometry><mesh filename="base.stl" scale="1 1 1"/></geometry></visual>
  <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
 </link>
</robot>
"""


def findings(path):
    with pytest.raises(InputError) as caught:
        read_urdf(path)
    return [str(finding).replace(str(path), "") for finding in caught.value.findings]


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "r.urdf"

    def write(old="", new=""):
        assert old in TEXT
        path.write_text(TEXT.replace(old, new))
        return path

    return write


def test_an_ordinary_urdf_is_read(urdf):
    assert read_urdf(urdf()).name == "r"  # the mesh is left to the physics, which finds packages
    for name in robot_names():
        read_urdf(read_robot(HERE / name / "robot.yaml").urdf)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('value="11"', 'value="-1"', ":5:4 error[E302] <mass>: value: expected 0 to 100000, got"),
        ('value="11"', 'value="nan"', "got 'nan'"),
        ('value="11"', 'value="1e400"', "got '1e400'"),
        ('value="11"', 'value="heavy"', "got 'heavy'"),
        ('ixx="0.1"', 'ixx="-0.1"', ":6:4 error[E302] <inertia>: ixx: expected 0 to 1e+06, got"),
        ('ixz="0"', 'ixz="inf"', "<inertia>: ixz: expected -1e+06 to 1e+06, got 'inf'"),
        ("0 0 0.1", "0 0 1e9", ":4:4 error[E302] <origin>: xyz: expected -100 to 100, got"),
        ("0.1 0.2 0.3", "0.1 inf 0.3", ":9:24 error[E302] <box>: size: expected 1e-06 to 100"),
        ("0.1 0.2 0.3", "0 0.2 0.3", "got '0 0.2 0.3'"),
        ("1 1 1", "1 nan 1", ":8:21 error[E302] <mesh>: scale: expected -100 to 100"),
        ("base.stl", "/dev/zero", "<mesh>: zero cannot be read: not a regular file but a device"),
        ("base.stl", "pipe", "<mesh>: pipe cannot be read: not a regular file but a pipe"),
        ("base.stl", "large.stl", "large.stl has 500000000 bytes; a mesh has at most 50000000"),
        ("<link", "<!DOCTYPE x>\n<link", "error[E302] not XML"),
        ('<robot name="r">', '<!DOCTYPE r [<!ENTITY a "b">]><robot name="r">', "document types"),
        ("robot", "world", ":1:1 error[E302] not a URDF: expected the element <robot>"),
        ('name="base"', 'name="\x9b2J"', None),
    ],
)
def test_impossible_values_are_findings(urdf, tmp_path, old, new, expected):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(500_000_000)
    path = urdf(old, new)
    if expected is None:
        assert r"\x9b2J" in [element.name for element in read_urdf(path).within()]
    else:
        (line,) = findings(path)
        assert expected in line


def test_a_urdf_of_too_many_links_is_refused(urdf):
    path = urdf("</robot>", '<link name="l"/>' * 300 + "</robot>")
    assert "301 links; at most 200 are supported" in findings(path)[0]


def test_a_pipe_is_named_at_its_place_in_the_robot_file(tmp_path):
    os.mkfifo(tmp_path / "r.urdf")
    robot = (HERE / "scout" / "robot.yaml").read_text().replace("scout.urdf", "r.urdf")
    (tmp_path / "robot.yaml").write_text(robot)
    with pytest.raises(InputError) as caught:
        read_robot(tmp_path / "robot.yaml")
    (finding,) = caught.value.findings
    assert finding.code == "E302"
    assert finding.mark.file.endswith("robot.yaml")
    assert finding.sentence == "urdf: 'r.urdf': cannot be read: not a regular file but a pipe"
