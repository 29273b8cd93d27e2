"""A mission that is prepared twice in one process reads every file as it is now."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from missions.execution import resources
from missions.execution.prepare import RunOptions, diagnose, prepare
from missions.execution.resources import find_mission, load_robot
from robots.load import find_robot
from stack.types import FREE, OCCUPIED, OccupancyGrid
from tests.stack.mapping.written_maps import write_ros_map
from tests.stack.planning.routes.test_geojson import collection, edge, node

MISSION = """mission: all files
robot: mine/robot.yaml
world: ./hall.yaml
start: [1.5, 2.5, 0]
map: map.yaml
include: [trees.yaml]
plugins: [wave.py]
parameters: [careful.yaml]
navigation:
  planner: {use: route, graph: lanes.geojson}
  costmap: {layers: [static, obstacle, {use: keepout, mask: zone.yaml}]}
run:
  sequence:
    - wave: {}
    - use: greet
"""
WORLD = """world: hall
format: 1
start: [1.5, 2.5, 0]
walls:
  - {points: [[0, 0], [8, 0], [8, 5], [0, 5]], closed: true}
"""
GAZEBO = """<sdf version="1.9"><world name="w"><model name="crate"><static>1</static>
<link name="l"><collision name="c"><geometry><mesh><uri>crate.stl</uri></mesh></geometry>
</collision></link></model><model name="box"><static>1</static><pose>5 5 0 0 0 0</pose>
<link name="l"><collision name="c"><geometry><box><size>1 1 1</size></box></geometry>
</collision></link></model></world></sdf>
"""
PLUGIN = """from py_trees.common import Status

from behaviours.base import RobotBehaviour


class Wave(RobotBehaviour):
    '''Wave.'''

    def update(self) -> Status:
        return Status.SUCCESS
"""


@pytest.fixture
def mission(tmp_path):
    cells = np.full((50, 80), FREE, np.int8)
    cells[0] = OCCUPIED
    write_ros_map(OccupancyGrid(cells, 0.1), tmp_path / "map.yaml")
    write_ros_map(OccupancyGrid(cells, 0.1), tmp_path / "zone.yaml")
    shutil.copytree(find_robot("scout", tmp_path).parent, tmp_path / "mine")
    ends = [("west", (1.5, 2.5)), ("east", (6.5, 2.5))]
    lanes = collection(
        *(node(name, *at) for name, at in ends),
        edge("lane", "west", "east", [at for _, at in ends]),
    )
    for name, text in {
        "m.yaml": MISSION,
        "hall.yaml": WORLD,
        "trees.yaml": "trees: {greet: {do: {say: hello}}}\n",
        "careful.yaml": "controller: {use: pure_pursuit}\n",
        "lanes.geojson": json.dumps(lanes),
        "wave.py": PLUGIN,
    }.items():
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path / "m.yaml"


def found(file):
    return [str(item) for item in diagnose(find_mission(file)).findings]


@pytest.mark.parametrize(
    "name",
    [
        "m.yaml", "hall.yaml", "mine/robot.yaml", "mine/scout.urdf", "map.yaml", "map.pgm",
        "zone.yaml", "zone.pgm", "trees.yaml", "careful.yaml", "lanes.geojson", "wave.py",
    ],
)  # fmt: skip
def test_an_edited_file_is_read_again(mission, name):
    """The edit leaves size and time of the file as they were."""
    assert found(mission) == []
    edited = mission.parent / name
    before, state = edited.read_bytes(), edited.stat()
    for content, is_faulty in ((b"?" * len(before), True), (before, False)):
        edited.write_bytes(content)
        os.utime(edited, ns=(state.st_atime_ns, state.st_mtime_ns))
        assert bool(found(mission)) == is_faulty


def test_an_edited_mesh_of_a_gazebo_world_is_read_again(tmp_path):
    import trimesh

    mesh, mission = tmp_path / "crate.stl", tmp_path / "m.yaml"
    (tmp_path / "w.world").write_text(GAZEBO, "utf-8")
    mission.write_text(
        "mission: m\nrobot: scout\nworld: ./w.world\nstart: [2.5, 0, 0]\nrun: {say: a}", "utf-8"
    )
    sizes = []
    for size in (0.5, 1.0):
        trimesh.creation.box((size, size, 1.0)).export(mesh)
        os.utime(mesh, ns=(0, 0))
        world = prepare(mission, RunOptions()).world
        sizes.append(next(box.size[0] for box in world.boxes if "crate" in box.name))
    assert sizes == pytest.approx([0.5, 1.0], abs=0.04)


def test_robot_and_world_are_each_read_once(mission, monkeypatch):
    """The reader of the mission and the scene both need them, also if the mission has errors."""
    read = []
    for reader in (resources.read_robot, resources.read_any_world):

        def counted(file, *start, reader=reader):
            read.append(file.name)
            return reader(file, *start)

        monkeypatch.setattr(resources, reader.__name__, counted)
    for text, is_faulty in ((MISSION, False), (MISSION.replace("wave: {}", "weave: {}"), True)):
        mission.write_text(text.replace("start: [1.5,", "start: [1.6,"), "utf-8")
        assert bool(found(mission)) == is_faulty
        assert sorted(read) == ["hall.yaml", "robot.yaml"]
        read.clear()


def test_a_relative_path_follows_the_folder_of_the_process(mission, tmp_path, monkeypatch):
    other = tmp_path / "other"
    shutil.copytree(tmp_path / "mine", other / "mine")
    description = other / "mine" / "robot.yaml"
    text = description.read_text("utf-8")
    description.write_text(text.replace("linear_speed: 0.8", "linear_speed: 0.7"), "utf-8")
    speeds = []
    for folder in (tmp_path, other):
        monkeypatch.chdir(folder)
        speeds.append(load_robot("./mine/robot.yaml", Path()).limits.linear_speed)
    assert speeds == [0.8, 0.7]
