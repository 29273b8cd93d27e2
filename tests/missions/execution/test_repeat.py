"""A run folder holds all that the run was made of: it repeats elsewhere, bit for bit."""

import json
import shutil
import zipfile
from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.records import inputs
from missions.execution.records.inputs import read_inputs
from missions.execution.repeat import repeat_run
from missions.execution.running import run_mission
from missions.inspection.exchange.packing import pack, unpack
from missions.inspection.run_folders import find_runs
from stack.errors import InputError

ROOT = Path(__file__).parents[3]

MISSION = """\
mission: a little way
format: 1
robot: ../robots/mine/robot.yaml
world: ../worlds/room.yaml
plugins: [../own]
include: [trees/way.yaml]
parameters: [fast.yaml]
navigation: {planner: {use: route, graph: ../graphs/ways.geojson}}
blackboard:
  runs: {type: int, initial: 0, keep: true}
run:
  sequence:
    - set: {runs: $runs + 1}
    - wave: {}
    - use: way
    - say: "run ${runs}"
"""
WAY = """\
trees:
  way:
    do: {navigate_to_pose: {goal: [1.8, 1.2, 0]}, timeout: 30 s}
"""
BEHAVIOUR = '''\
"""A wave."""

from treepilot import Behaviour, Status


class Wave(Behaviour):
    """Waves."""

    def update(self):
        return Status.SUCCESS
'''
GRAPH = {
    "type": "FeatureCollection",
    "features": [
        *(
            {
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [x, y]},
                "properties": {"id": number},
            }
            for number, x, y in ((1, 1.0, 1.0), (2, 1.8, 1.2))
        ),
        {
            "type": "Feature",
            "geometry": {"type": "MultiLineString", "coordinates": [[[1.0, 1.0], [1.8, 1.2]]]},
            "properties": {"id": 3, "startid": 1, "endid": 2},
        },
    ],
}
CORNERS = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.02, 0.02)]
FACES = "124 143 578 586 156 162 348 387 137 175 268 284"
CUBE = "".join(
    [f"v {x} {y} {z}\n" for x, y, z in CORNERS] + [f"f {a} {b} {c}\n" for a, b, c in FACES.split()]
)


@pytest.fixture
def project(tmp_path):
    """A user's project: everything that a mission can name is a file of its own."""
    base = tmp_path / "project"
    shutil.copytree(ROOT / "robots" / "scout", base / "robots" / "mine")
    urdf = base / "robots" / "mine" / "scout.urdf"
    plate = (
        '<visual><origin xyz="0 0 0.3"/><geometry><mesh filename="../../meshes/plate.obj"/>'
        "</geometry></visual></link>"
    )
    urdf.write_text(urdf.read_text().replace("</link>", plate, 1))
    for name, text in {
        "missions/walk.yaml": MISSION, "missions/trees/way.yaml": WAY, "own/wave.py": BEHAVIOUR,
        "missions/fast.yaml": "controller: {cruise_speed: 0.55}\n",
        "graphs/ways.geojson": json.dumps(GRAPH), "meshes/plate.obj": CUBE,
        "worlds/room.yaml": (ROOT / "missions/worlds/small_room.yaml").read_text(),
    }.items():  # fmt: skip
        file = base / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return base


def run(project, tmp_path, **options):
    out = tmp_path / "runs" / "walk"
    return out, run_mission(project / "missions/walk.yaml", RunOptions(seed=5, out=out, **options))


@pytest.mark.slow
def test_a_packed_run_repeats_where_nothing_else_is(project, tmp_path):
    out, first = run(project, tmp_path)
    assert first.status == "success", first.reason
    assert {file.path for file in read_inputs(out).files} == {
        str(file.relative_to(project))
        for file in project.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts and file.suffix != ".md"
    }
    pack(out, tmp_path / "walk.zip")
    shutil.rmtree(project)
    shutil.rmtree(out.parent)
    elsewhere = unpack(tmp_path / "walk.zip", tmp_path / "other machine" / "runs")
    again = repeat_run(elsewhere)
    assert again.is_same, again.difference
    assert again.report.log_sha256 == first.log_sha256
    assert [entry.name for entry in find_runs(elsewhere.parent)] == ["walk"]


@pytest.mark.slow
def test_a_repetition_says_what_is_another(project, tmp_path):
    out, _ = run(project, tmp_path, arguments=None)
    room = out / "inputs/worlds/room.yaml"
    room.write_text(room.read_text().replace("[4.1, 3.4, 25 deg]", "[2.6, 1.3, 25 deg]"))
    listed = json.loads((out / "inputs.json").read_text())
    listed["versions"]["numpy"] = "1.0.0"
    (out / "inputs.json").write_text(json.dumps(listed))
    again = repeat_run(out)
    assert not again.is_same
    assert again.difference
    assert any(reason.startswith("numpy was 1.0.0, is ") for reason in again.reasons)
    assert "inputs/worlds/room.yaml has been changed" in again.reasons


@pytest.mark.slow
def test_options_and_kept_values_are_those_of_the_run(project, tmp_path):
    run(project, tmp_path)
    shutil.rmtree(tmp_path / "runs" / "walk")  # its kept value stays beside it
    out, second = run(
        project, tmp_path, world=str(project / "worlds/room.yaml"),
        parameters={"controller.cruise_speed": "0.4"},
    )  # fmt: skip
    assert second.blackboard["runs"] == "2"
    shutil.rmtree(project)
    again = repeat_run(out)
    assert again.is_same, again.difference
    assert again.report.blackboard["runs"] == "2"


@pytest.mark.slow
@pytest.mark.parametrize("largest", [50_000_000, 100_000])
def test_a_played_recording_repeats(project, tmp_path, monkeypatch, largest):
    """Copied if it is small; found in its place if it is not; an error if that is another one."""
    monkeypatch.setattr(inputs, "LARGEST", largest)
    recorded, _ = run(project, tmp_path, record=("sensors",))
    log = (recorded / "sensors.mcap").rename(tmp_path / "sensors.mcap")
    assert log.stat().st_size > 100_000
    shutil.rmtree(recorded)
    out, first = run(project, tmp_path, replay=log, forget_kept=True)
    again = repeat_run(out)
    assert again.is_same, again.difference
    assert again.report.log_sha256 == first.log_sha256
    if largest < 1_000_000:
        shutil.rmtree(out / "repeats")
        next((out / "inputs").rglob("sensors.mcap")).unlink()
        log.write_bytes(log.read_bytes()[:-1000])
        with pytest.raises(InputError, match="was too large to be copied: it is gone or"):
            repeat_run(out)


@pytest.mark.slow
def test_a_shipped_mission_repeats_from_its_copy(tmp_path):
    out = tmp_path / "run"
    first = run_mission("01_drive_to_a_point", RunOptions(seed=3, out=out))
    assert read_inputs(out).mission.is_file()
    again = repeat_run(out)
    assert again.is_same, again.difference
    assert again.report.log_sha256 == first.log_sha256


@pytest.mark.slow
def test_files_of_an_installed_package_are_named_and_not_copied(tmp_path):
    """The meshes of the arm are 9.5 MB of pybullet_data."""
    mission = tmp_path / "arm.yaml"
    mission.write_text("mission: arm\nrobot: panda_eye\nworld: marker_board\nrun: {home_arm: {}}\n")
    out = tmp_path / "run"
    first = run_mission(mission, RunOptions(seed=3, out=out))
    assert first.status == "success", first.reason
    packaged = [file for file in read_inputs(out).files if file.package]
    assert {file.package for file in packaged} == {"pybullet_data"}
    assert "packages/pybullet_data/franka_panda/panda.urdf" in {file.path for file in packaged}
    assert all(file.sha256 and not (out / "inputs" / file.path).exists() for file in packaged)
    assert sum(file.stat().st_size for file in (out / "inputs").rglob("*.*")) < 100_000
    pack(out, tmp_path / "arm.zip")
    mission.unlink()
    again = repeat_run(unpack(tmp_path / "arm.zip", tmp_path / "elsewhere"))
    assert again.is_same, again.difference


def test_a_run_without_inputs_is_refused(tmp_path):
    with pytest.raises(InputError, match="does not say what it was made of"):
        read_inputs(tmp_path)


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"format": 2}', '{"format": 1, "options": 3}',
     '{"format": 1, "options": {}, "files": [{}], "mission": "m", "versions": {}}',
     '{"format": 1, "options": {}, "files": [], "mission": "../../m", '
     '"versions": {}}',
     '{"format": 1, "options": {}, "files": [{"path": "../x", "sha256": "", "source": ""}], '
     '"mission": "m", "versions": {}}'],
)  # fmt: skip
def test_a_damaged_list_is_refused(content, tmp_path):
    (tmp_path / "inputs.json").write_text(content)
    with pytest.raises(InputError, match=r"inputs\.json"):
        read_inputs(tmp_path)


def packed(tmp_path, names):
    file = tmp_path / "run.zip"
    with zipfile.ZipFile(file, "w") as archive:
        for name in names:
            archive.writestr(name, "x")
    return file


@pytest.mark.parametrize(
    "names",
    [["run/events.jsonl"], ["run/events.jsonl", "run/mission.yaml", "run/../../x"],
     ["/run/events.jsonl", "/run/mission.yaml"], ["events.jsonl", "mission.yaml"], [],
     ["a/events.jsonl", "b/mission.yaml"], ["../events.jsonl", "../mission.yaml"],
     ["run/events.jsonl", "run/mission.yaml", "run/..\\x"]],
)  # fmt: skip
def test_what_is_no_packed_run_is_refused_and_leaves_nothing(names, tmp_path):
    with pytest.raises(InputError, match="is not a packed run"):
        unpack(packed(tmp_path, names), tmp_path / "runs")
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [tmp_path / "run.zip"]


def test_a_damaged_packed_run_is_refused(tmp_path):
    file = packed(tmp_path, ["run/events.jsonl", "run/mission.yaml"])
    file.write_bytes(file.read_bytes()[:60])
    with pytest.raises(InputError, match="is not a packed run"):
        unpack(file, tmp_path / "runs")


def test_a_recording_that_can_be_drawn_again_is_not_packed(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("events.jsonl", "mission.yaml", "mission.rrd"):
        (folder / name).touch()
    pack(folder, tmp_path / "run.zip")
    unpacked = unpack(tmp_path / "run.zip", tmp_path / "elsewhere")
    assert {file.name for file in unpacked.iterdir()} == {"events.jsonl", "mission.yaml"}


def test_packing_does_not_replace_a_file(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("events.jsonl", "mission.yaml"):
        (folder / name).touch()
    (tmp_path / "x.zip").write_text("mine")
    with pytest.raises(InputError, match="exists"):
        pack(folder, tmp_path / "x.zip")
    assert pack(folder, tmp_path / "y.zip") > 0
    assert unpack(tmp_path / "y.zip", tmp_path) == folder  # it is there: not touched
