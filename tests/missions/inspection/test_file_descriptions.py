"""`treepilot describe` of files and folders of any kind that treepilot reads."""

from pathlib import Path

import pytest

from missions.execution.resources import mission_files
from missions.inspection.listing import description_of, installed
from robots.load import robot_names
from stack.errors import InputError

ROOT = Path(__file__).parents[3]
TREES = """
places: {gate: [1.0, 2.0]}
trees:
  greet: {doc: Says hello., do: {say: hello}}
"""
MISSION = """
mission: rounds
doc: Drive to the corner.
robot: ./carrier
world: ./hall.yaml
arguments:
  dwell: {type: duration, default: 3 s, doc: rest at the corner}
  rounds: {type: int, default: 2}
places: {corner: [1.0, 0.5, 90 deg]}
events:
  - low: {when: battery.charge < 0.2, do: {say: low}, then: abort}
trees:
  there: {doc: One round., do: {navigate_to_pose: $corner}}
run: {sequence: [{use: there}, {wait: $dwell}]}
"""
WORLD = """
world: hall
doc: A hall.
bounds: [-2, -1, 4, 3]
walls: [{points: [[-2, -1], [4, -1]]}, {points: [[4, -1], [4, 3]]}]
boxes: [{at: [3, 2], size: [0.5, 0.5, 1.0]}]
places: {home: [0, 0, 0]}
"""


@pytest.fixture
def folder(tmp_path):
    """A robot, a world, a mission and a file of trees."""
    carrier = tmp_path / "carrier"
    carrier.mkdir()
    shipped = ROOT / "robots" / "scout"
    text = (shipped / "robot.yaml").read_text("utf-8")
    (carrier / "robot.yaml").write_text(text.replace("robot: scout", "robot: carrier"))
    for file in shipped.glob("*.urdf"):
        (carrier / file.name).write_text(file.read_text("utf-8"))
    (tmp_path / "hall.yaml").write_text(WORLD)
    (tmp_path / "rounds.yaml").write_text(MISSION)
    (tmp_path / "common.yaml").write_text(TREES)
    return tmp_path


@pytest.fixture(scope="module")
def known():
    return installed()


@pytest.mark.parametrize("name", ["carrier", "carrier/", "carrier/robot.yaml"])
def test_a_robot_is_described_by_its_file_or_its_folder(folder, known, name):
    text = description_of(f"{folder}/{name}", known)
    assert text.splitlines()[:2] == [
        "carrier: radius 0.22 m, differential, 0.8 m/s, 1.8 rad/s",
        "size: 0.45 m long, 0.45 m wide, 0.38 m high",
    ]
    for part in ("lidar:", "front_left:", "camera:", "limits:", "battery:"):
        assert part in text.splitlines()


def test_a_world_is_described_by_its_file(folder, known):
    assert description_of(f"{folder}/hall.yaml", known).splitlines() == [
        "hall: A hall.",
        "  size      6 x 4 m, from (-2, -1)",
        "  has       2 walls, 1 box",
        "  start     [0, 0, 0 deg]",
        "places:",
        "  home         [0, 0, 0 deg]",
    ]


def test_a_mission_is_described_by_its_file(folder, known):
    text = description_of(f"{folder}/rounds.yaml", known)
    assert text.splitlines() == [
        "rounds: Drive to the corner.",
        "  robot     carrier: radius 0.22 m, differential, 0.8 m/s, 1.8 rad/s",
        "  world     hall",
        "  map       from_world",
        "  start     [0, 0, 0 deg]",
        "  pose      estimated by mcl",
        "  events    low (abort)",
        "arguments:",
        "  dwell   = 3  duration  rest at the corner",
        "  rounds  = 2  int",
        "trees:",
        "  there  One round.",
        "places:",
        "  corner       [1, 0.5, 90 deg]",
        f"its tree: treepilot show {folder}/rounds.yaml",
    ]


def test_a_file_of_trees_is_described(folder, known, monkeypatch):
    """A relative name without a slash is that of a file by its suffix."""
    monkeypatch.chdir(folder)
    assert description_of("common.yaml", known).splitlines() == [
        "common.yaml: trees and places for missions that include it",
        "trees:",
        "  greet  Says hello.",
        "places:",
        "  gate",
    ]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("hal.yaml", "no such file; did you mean 'hall.yaml'?"),
        (".", "neither robot.yaml nor map.yaml"),
        ("notes.txt", "not a robot, world, map, mission or file of trees"),
        ("faulty.yaml", "there is no robot 'carier'"),
    ],
)
def test_other_files_are_refused_and_not_answered_with_names(folder, known, name, sentence):
    (folder / "notes.txt").write_text("hello")
    (folder / "faulty.yaml").write_text(MISSION.replace("./carrier", "carier"))
    with pytest.raises(InputError) as refused:
        description_of(f"{folder}/{name}", known)
    assert sentence in str(refused.value) and "pure_pursuit" not in str(refused.value)


def test_shipped_robots_and_missions_are_described_by_name_and_by_file_alike(known):
    for name in robot_names():
        assert description_of(name, known) == description_of(f"{ROOT}/robots/{name}", known)
    assert description_of("02_office_patrol", known) == description_of(
        str(next(file for file in mission_files() if file.stem == "02_office_patrol")), known
    )
