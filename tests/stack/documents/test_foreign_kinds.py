"""Files of other programs are recognised by what they contain, and named once, wherever given."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.execution.resources import MISSIONS, load_map, load_robot
from missions.inspection.check import check_files
from missions.inspection.file_descriptions import file_description
from missions.nav2.reading import read_nav2
from robots.logs.opening import open_log
from stack.documents.foreign_kinds import FOREIGN, recognised
from stack.documents.xml_file import read_xml
from stack.errors import Finding, InputError
from stack.planning.routes.geojson import read_route_graph
from stack.sim.import_world import read_any_world


def zipped() -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("mission.yaml", "mission: a")
    return content.getvalue()


XML = '<?xml version="1.0"?>\n<!-- made by\n hand -->\n'
SAMPLES: dict[str, tuple[str | bytes, str]] = {
    "tree.xml": (XML + '<root BTCPP_format="4"><BehaviorTree ID="A"/></root>', "BehaviorTree.CPP"),
    "field.plan": (json.dumps({"fileType": "Plan", "mission": {"items": []}}), "QGroundControl"),
    "field.waypoints": ("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3\t8.5\t10\t1\n", "MAVLink"),
    "office.posegraph": (b"\x16\0\0\0\0\0\0\0serialization::archive\x12\0\4", "slam_toolbox"),
    "office.pbstream": (b"\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b\x10\0\0\0", "Cartographer"),
    "office.building.yaml": (
        "coordinate_system: reference_image\ncrowd_sim: {}\nlevels:\n  L1:\n    vertices: []\n",
        "RMF",
    ),
    "office.wbt": ("#VRML_SIM R2023b utf8\nWorldInfo {\n}\n", "world of Webots"),
    "arm.proto": ("#VRML_SIM R2023b utf8 PROTO\nPROTO Arm []\n", "PROTO of Webots"),
    "office.usda": ('#usda 1.0\n(\n  upAxis = "Z"\n)\n', "USD"),
    "office.usd": (b"PXR-USDC\0\x09\0\0\0\0\0\0", "USD"),
    "scan.pcd": ("# .PCD v0.7 - Point Cloud Data\nVERSION 0.7\nFIELDS x y z\n", "PCD"),
    "scan.ply": ("ply\nformat ascii 1.0\nelement vertex 8\n", "PLY"),
    "cave.world": ('include "pioneer.inc"\nwindow\n(\n  size [ 600 600 ]\n)\n', "world of Stage"),
    "simple.cfg": ('driver\n(\n  name "stage"\n  provides ["simulation:0"]\n)\n', "Player"),
    "arena.map": ("type octile\nheight 49\nwidth 49\nmap\n@@..\n", "MovingAI"),
    "arena.scen": ("version 1\n0\tarena.map\t49\t49\t1\t11\t1\t12\t1\n", "scenario"),
    "nav.launch": ("<launch>\n  <node pkg='amcl' type='amcl' name='amcl'/>\n</launch>\n", "launch"),
    "nav.launch.py": ("import os\n\ndef generate_launch_description():\n    return 1\n", "launch"),
    "nav.launch.yaml": ("launch:\n- node:\n    pkg: a\n", "launch"),
    "my_tree.py": ("import py_trees\n\nroot = 1\n", "Python"),
    "nav.rviz": ("Panels:\n  - Class: rviz/Displays\nVisualization Manager:\n  A: 1\n", "RViz"),
    "rover.urdf": (XML + '<robot name="rover"><link name="base"/></robot>', "a URDF"),
    "rover.xacro": (
        '<robot name="rover" xmlns:xacro="http://wiki.ros.org/xacro"></robot>', "xacro"
    ),
    "model.sdf": ('<sdf version="1.9"><model name="rover"/></sdf>', "model of Gazebo"),
    "house.xml": ('<sdf version="1.9"><world name="house"/></sdf>', "Gazebo world"),
    "run.bag": (b"#ROSBAG V2.0\nE\0\0\0\x0c\0\0\0bag", "bag of ROS 1"),
    "run.db3": (b"SQLite format 3\0\x10\0\1\1", "SQLite"),
    "run.mcap": (b"\x89MCAP0\r\n\1\0\0\0", "MCAP"),
    "metadata.yaml": ("rosbag2_bagfile_information:\n  version: 5\n", "ROS bag"),
    "fr079.log": ("PARAM robot_front_laser_max 80\nODOM 0 0 0 0 0 0 0 0 a 0\n", "CARMEN"),
    "house.tmx": ('<map version="1.5" orientation="orthogonal"></map>', "Tiled"),
    "house.tmj": ('{"height": 3, "tiledversion": "1.9"}', "Tiled"),
    "house.png": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "PNG"),
    "house.jpg": (b"\xff\xd8\xff\xe0\0\x10JFIF", "JPEG"),
    "house.pgm": (b"P5\n4 4\n255\n" + bytes(16), "PGM"),
    "house.svg": ('<svg xmlns="http://www.w3.org/2000/svg"/>', "SVG"),
    "house.dxf": ("  0\nSECTION\n  2\nHEADER\n", "DXF"),
    "pointer.yaml": (
        "version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 3\n", "LFS"
    ),
    "mission.yaml.gz": (gzip.compress(b"mission: a"), "gzip"),
    "mission.zip": (zipped(), "zip"),
    "page.yaml": ("<!DOCTYPE html>\n<html><body>404</body></html>", "web page"),
    "word.yaml": ("mission: a".encode("utf-16"), "UTF-16"),
    "random.bin": (bytes(range(1, 9)) + bytes(64), "binary"),
    "graph.geojson": ('{"type": "FeatureCollection", "features": []}', "GeoJSON"),
    "track.gpx": ('<gpx version="1.1"></gpx>', "GPX"),
    "robot.xml": ('<mujoco model="a"/>', "MuJoCo"),
    "package.xml": ('<package format="3"><name>a</name></package>', "package"),
    "wheel.dae": ('<COLLADA version="1.4.1"/>', "COLLADA"),
    "other.xml": ("<settings/>", "XML"),
}  # fmt: skip
"""Name -> content, and a word of what it is."""

READERS = {
    "mission": lambda path: check_files([str(path)]),
    "world file": read_any_world,
    "robot file": lambda path: load_robot(str(path), Path()),
    "map file": lambda path: load_map(str(path), Path()),
    "Nav2 parameter file": read_nav2,
    "route graph": read_route_graph,
    "Gazebo world file": lambda path: [read_xml(path, "Gazebo world file")],
    "log": lambda path: [open_log(path)],
    "robot, world, map, mission or file of trees": lambda path: [file_description(str(path))],
}
DESCRIBED = "robot, world, map, mission or file of trees"
LOGS = ("fr079.log", "mission.yaml.gz", "pointer.yaml", "run.bag", "run.db3", "run.mcap")
PICTURES = ("house.png", "house.jpg", "house.pgm")
RIGHT = {
    ("route graph", "graph.geojson"), ("Gazebo world file", "house.xml"),
    ("Gazebo world file", "other.xml"),
    *(("log", name) for name in LOGS),
    *((what, name) for what in ("mission", "world file", "map file", DESCRIBED)
      for name in PICTURES),
}  # fmt: skip
"""Files that this reader reads, or refuses with more to say."""


def finding_of(reader: str, path: Path) -> Finding:
    try:
        findings = [line.finding for line in READERS[reader](path)]
    except InputError as error:
        findings = list(error.findings)
    assert len(findings) == 1
    assert findings[0] is not None
    return findings[0]


def written(folder: Path, name: str) -> Path:
    content = SAMPLES[name][0]
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.parametrize("reader", READERS)
def test_a_file_of_another_program_is_named_with_what_to_do(
    tmp_path: Path, reader: str, name: str
) -> None:
    path = written(tmp_path, name)
    if (reader, name) in RIGHT:
        return
    found = finding_of(reader, path)
    assert found.code == ("E501" if reader == "log" else "E007")
    assert found.sentence.startswith("this is a")
    assert SAMPLES[name][1] in found.sentence
    assert found.hint
    assert found.mark.file == str(path)


@pytest.mark.parametrize("name", [name for name in SAMPLES if not name.endswith((".yaml", ".xml"))])
def test_the_content_counts_whatever_the_name_ends_in(tmp_path: Path, name: str) -> None:
    content, word = SAMPLES[name]
    raw = content.encode() if isinstance(content, str) else content
    kind = recognised(raw, "mission.yaml")
    assert kind is not None
    assert word in kind.name


@pytest.mark.parametrize("ending", sorted({e for kind in FOREIGN for e in kind.endings}))
def test_a_mission_is_one_whatever_its_name_ends_in(ending: str) -> None:
    text = (MISSIONS / "02_office_patrol.yaml").read_bytes()
    assert recognised(text, f"patrol{ending}") is None


def test_no_file_of_treepilot_is_another_programs() -> None:
    files = [file for file in MISSIONS.rglob("*") if file.suffix in (".yaml", ".geojson")]
    files += [*(MISSIONS.parent / "robots").glob("*/*.yaml")]
    odd = {file.name: kind.name for file in files
           if (kind := recognised(file.read_bytes(), file.name)) is not None}  # fmt: skip
    assert {name for name in odd if not name.endswith(".geojson")} == set()
    assert len(files) > 40


@pytest.mark.parametrize("end", [b"<robot/>", b"<other/>", b""])
def test_many_comments_before_the_root_are_read_at_once(end: bytes) -> None:
    # With a comment that may contain others, 60 of them took 2^60 steps.
    text = b'<?xml version="1.0" ?>\n' + 60 * b"<!-- a -->\n" + end
    found = recognised(text, "r")
    assert (found is None) == (not end)


@pytest.mark.parametrize("reader", [reader for reader in READERS if reader != "log"])
@pytest.mark.parametrize("content", [b"", b" \n\n"])
def test_an_empty_file_is_said_to_be_empty(tmp_path: Path, reader: str, content: bytes) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(content)
    assert finding_of(reader, path).code == "E005"


@pytest.mark.parametrize(
    ("inside", "word"),
    [("map.yaml", "saved map"), ("robot.yaml", "robot"), ("metadata.yaml", "bag"), ("a", "folder")],
)
def test_a_folder_is_said_to_be_one(tmp_path: Path, inside: str, word: str) -> None:
    (tmp_path / inside).write_text("a: 1\n")
    found = finding_of("mission", tmp_path)
    assert found.sentence.startswith("this is ")
    assert word in found.sentence


def test_a_large_recording_is_recognised_before_its_size(tmp_path: Path) -> None:
    path = tmp_path / "long.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + bytes(1_100_000))
    assert "bag of ROS 1" in finding_of("mission", path).sentence


@given(st.binary(max_size=200), st.sampled_from(["a.yaml", "a.world", "a.map", "a"]))
def test_any_bytes_are_of_a_kind_or_none(content: bytes, name: str) -> None:
    kind = recognised(content, name)
    assert kind is None or kind in FOREIGN
