"""Files of other programs: what each is, and what to do with it.

A kind is recognised by the beginning of the file, and by the ending of its name only where the
content says nothing: endings such as `.map` and `.world` have several meanings.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

BEGINNING = 1 << 16
"""Bytes of a file that are looked at."""


@dataclass(frozen=True, slots=True)
class ForeignKind:
    """A kind of file of another program.

    Attributes:
        name: with its article: "a behaviour tree of BehaviorTree.CPP".
        advice: what to do with such a file; one sentence in the imperative.
        sign: what such a file contains near its beginning, as a regular expression. It is compiled
            when it is needed: that takes too long at every start.
        endings: of names, for content that says nothing; empty if the content always does.
        read_as: the kinds of file, as in messages, as which treepilot reads it.
    """

    name: str
    advice: str
    sign: bytes = b""
    endings: tuple[str, ...] = ()
    read_as: tuple[str, ...] = ()


def _kind(
    name: str, advice: str, sign: bytes = b"", endings: str = "", read_as: str = ""
) -> ForeignKind:
    kinds = tuple(filter(None, read_as.split(", ")))
    return ForeignKind(name, advice, sign, tuple(endings.split()), kinds)


_XML = (
    rb"\A(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*\?>\s*)?(?:<!--(?:(?!-->)(?s:.))*-->\s*)*"
    rb"(?:<!DOCTYPE[^>]*>\s*)?"
)
"""What may precede the root element. A comment ends at its first -->, however many follow: the time
grows with the length alone."""
_UNPACK = "unpack it and give one of its files"
_LOG = "replay it: `robot: {use: replayed, log: FILE}`, or `treepilot run MISSION --replay FILE`"
_MESH = "name it as a `<mesh>` of a URDF or a Gazebo world"
_MAP_OF_PICTURE = "name it under `image:` of a map.yaml, and that file under `map:` of a mission"
_NO_MAP = "save the map as map.yaml with a picture (`ros2 run nav2_map_server map_saver_cli`)"
_DRAW = "draw its walls in a world file (docs/worlds.md), or export a map.yaml with a picture"
_WAYPOINTS = "write its points as `places` of a mission, in metres from the map's origin"
_ROBOT = "export it as URDF, and describe it in a robot.yaml (docs/robots.md)"
_GAZEBO = "export it for Gazebo (.sdf), or draw its walls in a world file (docs/worlds.md)"

BINARY = _kind("a binary file", "give a text file", rb"\A(?s:.){0,4096}?\0")

FOREIGN: tuple[ForeignKind, ...] = (
    _kind("a Git LFS pointer", "run `git lfs pull` to get the file itself",
          rb"\Aversion https://git-lfs\.github\.com/spec"),
    _kind("a web page", "download the raw file", rb"(?i)\A\s*<(?:!DOCTYPE )?html"),
    # Archives
    _kind("a zip archive", _UNPACK, rb"\APK\x03\x04"),
    _kind("a gzip archive", _UNPACK, rb"\A\x1f\x8b", read_as="log"),
    _kind("an archive", _UNPACK,
          rb"\A(?:BZh|\xfd7zXZ\0|7z\xbc\xaf|\x28\xb5\x2f\xfd)|\A(?s:.){257}ustar"),
    # Recordings
    _kind("a ROS bag (MCAP) or a recording of treepilot", _LOG, rb"\A\x89MCAP0\r\n"),
    _kind("a ROS bag (SQLite)", _LOG, rb"\ASQLite format 3\0"),
    _kind("a bag of ROS 1", _LOG, rb"\A#ROSBAG V"),
    _kind("a list of the files of a ROS bag", "give its folder: " + _LOG,
          rb"^rosbag2_bagfile_information\s*:"),
    _kind("a CARMEN log", _LOG,
          rb"^(?:FLASER|ROBOTLASER1|RLASER|RAWLASER1|PARAM robot_\w+|ODOM) ", read_as="log"),
    _kind("an event log of a run", "show it with `treepilot trace` or `treepilot watch RUN`",
          rb'\A\{"fields":\{', ".jsonl"),
    # Maps of other programs
    _kind("a pose graph of slam_toolbox", _NO_MAP,
          rb"\A.{0,16}serialization::archive", ".posegraph"),
    _kind("a map of Cartographer (pbstream)",
          "export it: `ros2 run cartographer_ros cartographer_pbstream_to_ros_map`",
          rb"\A(?:\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b|\x7b\x1d\x1f\x7b\x5b\xf5\x01\xdb)", ".pbstream"),
    _kind("a map of the MovingAI benchmarks", _DRAW, rb"\Atype \w+\s+height \d+"),
    _kind("a scenario of the MovingAI benchmarks", "write its goals as `places` of a mission",
          rb"\Aversion \d+(?:\.\d+)?\s+\d+\t\S+\.map\t"),
    _kind("a point cloud (PCD)", _NO_MAP, rb"\A(?:#[^\n]*\n)*# ?\.PCD|\AVERSION \.?\d"),
    _kind("a point cloud or mesh (PLY)", _NO_MAP, rb"\Aply\r?\n"),
    _kind("an octomap", _NO_MAP, rb"\A# Octomap OcTree"),
    _kind("a building map of RMF's traffic editor",
          _DRAW, rb"^(?:crowd_sim|lifts|levels)\s*:(?:.*\n)*?\s+(?:vertices|walls|lanes)\s*:",
          ".building.yaml"),
    _kind("a tile map of Tiled", _DRAW,
          _XML + rb"<map\b[^>]*\borientation=|\"tiledversion\"\s*:", ".tmx .tmj"),
    _kind("a picture (PNG)", _MAP_OF_PICTURE, rb"\A\x89PNG\r\n"),
    _kind("a picture (JPEG)", _MAP_OF_PICTURE, rb"\A\xff\xd8\xff"),
    _kind("a picture (PGM)", _MAP_OF_PICTURE, rb"\AP[25]\s"),
    _kind("a picture", _MAP_OF_PICTURE,
          rb"\A(?:P[1346]\s|BM.{12}|GIF8|II\*\0|MM\0\*|RIFF.{4}WEBP)"),
    _kind("a drawing (SVG)", _DRAW, _XML + rb"<svg\b"),
    _kind("a drawing (DXF)", _DRAW, rb"\A\s*0\s+SECTION\b", ".dxf .dwg"),
    # Worlds of other simulators
    _kind("a Gazebo world", "name it under `world:` of a mission, as a .sdf or .world file",
          _XML + rb"<(?:sdf|gazebo)\b(?s:.)*?<world\b", read_as="Gazebo world file"),
    _kind("a model of Gazebo (SDF)",
          "include it in a Gazebo world; for a robot, write a robot.yaml (docs/robots.md)",
          _XML + rb"<(?:sdf|gazebo)\b"),
    _kind("a description of a Gazebo model", "give the world or the URDF that uses it",
          _XML + rb"<model>"),
    _kind("a world of Webots", _GAZEBO, rb"\A#VRML_SIM [^\n]*(?<!PROTO)$"),
    _kind("a PROTO of Webots", _ROBOT, rb"\A#VRML_SIM "),
    _kind("a USD scene", _GAZEBO, rb"\A(?:#usda |PXR-USDC)", ".usd .usda .usdc .usdz"),
    _kind("a model of MuJoCo", _ROBOT, _XML + rb"<mujoco\b"),
    _kind("a world of Stage",
          "name its bitmap in a map.yaml (`image`, `resolution`, `origin`), that under `world:`",
          rb"^(?:define\s+\w+\s+\w+\s*\(?|floorplan\s*\(|include\s+\"[^\"]+\.inc\")"),
    _kind("a configuration of Stage or Player", "give the map of its world as a map.yaml",
          rb"^driver\s*\(?"),
    _kind("a scene of CoppeliaSim", _GAZEBO, rb"\A(?:VREP|REP)", ".ttt .ttm"),
    # Robots
    _kind("an xacro file",
          "expand it (`xacro FILE > robot.urdf`), and name that under `urdf:` of a robot file",
          _XML + rb"<robot\b[^>]*\bxmlns:xacro",
          read_as="URDF, xacro"),
    _kind("a semantic description of MoveIt (SRDF)", "give the URDF",
          _XML + rb"<robot\b(?s:.)*?<group\b",
          ".srdf", read_as="URDF"),
    _kind("a URDF", "name it under `urdf:` of a robot file (docs/robots.md)", _XML + rb"<robot\b",
          read_as="URDF"),
    _kind("a mesh (COLLADA)", _MESH, _XML + rb"<COLLADA\b"),
    _kind("a mesh (STL)", _MESH, rb"\Asolid .*\n\s*facet", ".stl"),
    _kind("a mesh", _MESH, endings=".obj .dae .glb .gltf .fbx"),
    # ROS and behaviour trees
    _kind("a behaviour tree of BehaviorTree.CPP",
          "write the tree under `run:` of a mission (docs/language.md)",
          _XML + rb"<(?:root|BehaviorTree|TreeNodesModel)\b"),
    _kind("a launch file of ROS",
          "name the parameters that it loads under `nav2_params:`, its world under `world:`",
          _XML + rb"<launch\b|^\s*def generate_launch_description\b|^launch\s*:$",
          ".launch .launch.py"),
    _kind("a Python program", "list a file with behaviours under `plugins:` of a mission",
          rb"^(?:import \w+|from [\w.]+ import )|\A#!.*python", ".py"),
    _kind("a configuration of RViz", "treepilot shows a run in its dashboard and in rerun",
          rb"^(?:Visualization Manager|Panels)\s*:", ".rviz"),
    _kind("a package description of ROS", "give a file of the package", _XML + rb"<package\b"),
    # Plans and tracks
    _kind("a plan of QGroundControl", _WAYPOINTS, rb'"fileType"\s*:\s*"Plan"'),
    _kind("a list of waypoints of MAVLink", _WAYPOINTS, rb"\AQGC WPL \d+"),
    _kind("a track (GPX)", _WAYPOINTS, _XML + rb"<gpx\b"),
    _kind("a drawing for Google Earth (KML)", _WAYPOINTS, _XML + rb"<kml\b"),
    _kind("a route graph (GeoJSON)", "name it in a mission: `planner: {use: route, graph: FILE}`",
          rb'"type"\s*:\s*"(?:FeatureCollection|Feature)"', read_as="route graph"),
    # Others
    _kind("a model of a neural network (ONNX)", "name it under `object_detector:` of a mission",
          endings=".onnx"),
    _kind("a document (PDF)", "give a text file", rb"\A%PDF-"),
    _kind("a notebook of Jupyter", "give a mission file", rb'\A\s*\{\s*"(?:cells|nbformat)"'),
    _kind("a text in UTF-16", "save it as UTF-8", rb"\A(?:\xff\xfe|\xfe\xff)"),
    _kind("an XML file", "give a file that treepilot reads (docs/worlds.md, docs/robots.md)",
          _XML + rb"<[A-Za-z][\w:.-]*[\s/>]", read_as="Gazebo world file, URDF, xacro"),
    BINARY,
)  # fmt: skip
"""In the order of recognition: a file is of the first kind that fits."""

_OWN_KEY = re.compile(
    rb"^(?:mission|run|world|robot|trees|image|planner|controller)[ \t]*:", re.MULTILINE
)

FOLDERS = (
    ("map.yaml", "the folder of a saved map", "name it under `map:` of a mission"),
    ("robot.yaml", "the folder of a robot", "name it under `robot:` of a mission"),
    ("events.jsonl", "the folder of a run", "show it with `treepilot watch RUN`"),
    ("metadata.yaml", "the folder of a ROS bag", _LOG),
    ("model.config", "the folder of a Gazebo model", "include it in a Gazebo world"),
    ("package.xml", "a package of ROS", "give one of its files"),
)
"""File in a folder, what the folder is, and what to do with it."""


def recognised(beginning: bytes, name: str) -> ForeignKind | None:
    """Return the kind of a file by its first bytes, else by its name.

    None for treepilot's own files, whatever their names end in, and for unknown ones.
    """
    if _OWN_KEY.search(beginning):
        return None
    for kind in FOREIGN:
        if kind.sign and re.search(kind.sign, beginning, re.MULTILINE):
            return kind
    lower = name.lower()
    return next((kind for kind in FOREIGN if lower.endswith(kind.endings or ("\0",))), None)


def recognised_folder(path: Path) -> tuple[str, str] | None:
    """Return what a folder is, and what to do with it; None if nothing is known of it."""
    found = (item[1:] for item in FOLDERS if (path / item[0]).is_file())
    return next(found, None)
