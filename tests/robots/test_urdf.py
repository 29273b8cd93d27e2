"""URDFs whose numbers or files the physics cannot use: findings with their line."""

import os

import pytest

from robots.load import HERE, read_robot, robot_names
from robots.urdf.reading import UrdfSource, read_urdf
from stack.errors import InputError

TEXT = """<robot name="r">
 <link name="base">
  <inertial>
   <origin xyz="0 0 0.1"/>
   <mass value="11"/>
   <inertia ixx="0.1" iyy="0.1" izz="0.2" ixy="0" ixz="0" iyz="0"/>
  </inertial>
  <collision><geometry><mesh filename="base.stl" scale="1 1 1"/></geometry></collision>
  <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
 </link>
</robot>
"""


EMPTY_STL = bytes(84)
"""A binary STL file of no triangle."""


def findings(path):
    with pytest.raises(InputError) as caught:
        read_urdf(UrdfSource(path))
    return [str(finding).replace(str(path), "") for finding in caught.value.findings]


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "r.urdf"
    (tmp_path / "base.stl").write_bytes(EMPTY_STL)

    def write(old="", new=""):
        assert old in TEXT
        path.write_text(TEXT.replace(old, new))
        return path

    return write


def test_an_ordinary_urdf_is_read(urdf):
    assert read_urdf(UrdfSource(urdf()))[0].name == "r"
    for name in robot_names():
        read_urdf(UrdfSource(read_robot(HERE / name / "robot.yaml").urdf))


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
        ("1 1 1", "1 nan 1", ":8:24 error[E302] <mesh>: scale: expected -100 to 100"),
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
        assert r"\x9b2J" in [element.name for element in read_urdf(UrdfSource(path))[0].within()]
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


def mesh(filename, tag="visual"):
    return (
        f'<link name="m"><{tag}><geometry><mesh filename="{filename}"/></geometry></{tag}></link>'
    )


def warnings_of(source):
    return [str(finding) for finding in read_urdf(source)[1]]


ROBOT_OF_MESH = '<robot name="r">\n{0}\n</robot>'


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    """src/car/urdf/r.urdf and meshes in several places."""
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    for folder in ("src/car/urdf", "src/parts", "other/deep/named_otherwise", "install/share/far"):
        (tmp_path / folder / "meshes").mkdir(parents=True)
        (tmp_path / folder / "meshes" / "a.stl").write_bytes(EMPTY_STL)
    (tmp_path / "src/car/meshes").mkdir()
    (tmp_path / "src/car/meshes/a.stl").write_bytes(EMPTY_STL)
    (tmp_path / "src/car/package.xml").write_text("<package><name>car_description</name></package>")
    named = tmp_path / "other/deep/named_otherwise/package.xml"
    named.write_text("<package><name>named</name></package>")

    def write(filename, tag="visual"):
        path = tmp_path / "src/car/urdf/r.urdf"
        path.write_text(ROBOT_OF_MESH.format(mesh(filename, tag)))
        return UrdfSource(path)

    return write


@pytest.mark.parametrize(
    ("filename", "folder"),
    [
        ("meshes/a.stl", "src/car/urdf"),
        ("../meshes/a.stl", "src/car"),
        ("package://car/meshes/a.stl", "src/car"),  # by the name of the folder
        ("package://car_description/meshes/a.stl", "src/car"),  # by its package.xml
        ("package://parts/meshes/a.stl", "src/parts"),  # beside it in the workspace
        ("file://TMP/src/parts/meshes/a.stl", "src/parts"),
        ("TMP/src/parts/meshes/a.stl", "src/parts"),
    ],
)
def test_meshes_are_found(workspace, tmp_path, filename, folder):
    source = workspace(filename.replace("TMP", str(tmp_path)), "collision")
    root, warnings = read_urdf(source)
    (shape,) = (element for element in root.within() if element.tag == "mesh")
    assert shape.attributes["filename"] == f"{tmp_path}/{folder}/meshes/a.stl"
    assert warnings == []


def test_packages_elsewhere_are_found_by_the_search_path(workspace, tmp_path, monkeypatch):
    source = workspace("package://named/meshes/a.stl")
    (warning,) = warnings_of(source)
    assert "r.urdf:2:" in warning and "warning[W302] <visual> of the link 'm'" in warning
    assert "the package 'named' is not found; the link is drawn without it" in warning
    assert warnings_of(UrdfSource(source.path, (tmp_path / "other",))) == []
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path}/other/deep/named_otherwise")
    assert warnings_of(source) == []
    source = workspace("package://far/meshes/a.stl")
    assert len(warnings_of(source)) == 1
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/install")
    assert warnings_of(source) == []


UNUSABLE = [
    ("none.stl", "there is no file"),
    ("package://nowhere/none.stl", "the package 'nowhere' is not found"),
    ("text.stl", "text.stl is not a binary STL file"),
    ("a.glb", "a.glb: the simulation reads .stl, .obj, .dae"),
    ("/dev/zero", "not a regular file but a device"),
]


@pytest.mark.parametrize(("filename", "sentence"), UNUSABLE)
def test_a_mesh_that_cannot_be_used_is_an_error_only_where_things_collide(
    workspace, filename, sentence
):
    source = workspace(filename)
    (source.path.parent / "text.stl").write_text("solid box\nendsolid box\n")
    (source.path.parent / "a.glb").write_bytes(b"glTF")
    root, warnings = read_urdf(source)
    assert sentence in warnings[0].sentence
    assert not any(element.tag == "mesh" for element in root.within())
    (line,) = findings(workspace(filename, "collision").path)
    assert ":2:" in line and "error[E302] <collision> of the link 'm'" in line and sentence in line


@pytest.mark.parametrize("ending", [".STL", ".stl", ".Obj", ".dae"])
def test_the_ending_of_a_mesh_may_be_in_capitals(workspace, ending):
    source = workspace(f"b{ending}", "collision")
    (source.path.parent / f"b{ending}").write_bytes(EMPTY_STL)
    assert warnings_of(source) == []


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("0 0 0.1", "0 0", "<origin>: xyz: expected 3 numbers, got '0 0'"),
        ('value="11"', 'value="11 12"', "<mass>: value: expected 1 number, got '11 12'"),
        ('value="11"', "", "<mass> needs the attribute 'value'"),
        ('<box size="0.1 0.2 0.3"/>', "", "expected one shape of box, sphere, cylinder"),
        ('<box size="0.1 0.2 0.3"/>', "<cone/>", "expected one shape of box, sphere, cylinder"),
        ('<box size="0.1 0.2 0.3"/>', "<sphere/>", "<sphere> needs the attribute 'radius'"),
    ],
)
def test_what_pybullet_would_refuse_is_a_finding(urdf, old, new, expected):
    (line,) = findings(urdf(old, new))
    assert expected in line
