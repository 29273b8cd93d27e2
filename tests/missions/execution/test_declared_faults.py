"""Faults of missions, worlds and options: checked, run, repeated."""

from math import pi
from pathlib import Path

import pytest

import missions
from missions.execution.fit.faults import fault_files
from missions.execution.prepare import RunOptions, diagnose, prepare
from missions.execution.repeat import repeat_run
from missions.execution.shared_world import prepare_together
from missions.inspection.diagnosis import findings_of
from missions.inspection.page.story import read_story
from missions.inspection.page.timeline import fault_spans, timeline
from stack.errors import InputError
from stack.telemetry.event_log import read_events

DRIVE = """\
mission: short
robot: scout
world: {world}
start: [1.0, 1.0, 0]
faults:
  - lidar_dropout: {{share: 30 %}}
    at: 500 ms
    for: 1 s
run:
  navigate_to_pose: {{goal: [2.5, 1.0, 0]}}
"""


@pytest.fixture
def mission(tmp_path):
    def write(text=DRIVE, world="small_room"):
        (tmp_path / "m.yaml").write_text(text.format(world=world))
        return tmp_path / "m.yaml"

    return write


def fault_events(folder):
    return [
        (event.time, event.fields["fault"]) for event in read_events(folder / "events.jsonl")
        if event.kind.startswith("fault")
    ]  # fmt: skip


def test_a_mission_with_a_fault_repeats(mission, tmp_path):
    report = missions.run(mission(), out=tmp_path / "run", record=())
    assert report.status == "success"
    assert fault_events(tmp_path / "run") == [(0.5, "lidar_dropout"), (1.5, "lidar_dropout")]
    story = read_story(tmp_path / "run")
    assert fault_spans(story) == {"lidar_dropout": [(0.5, 1.5, "bad", "fault")]}
    assert "fault lidar_dropout" in timeline(story)
    assert repeat_run(tmp_path / "run").is_same


def test_options_replace_faults_and_change_numbers(mission, tmp_path):
    file, own = mission(), tmp_path / "own.yaml"
    own.write_text("doc: mine\nfaults: [{push: {left: 10 cm}, at: 1 s}, gyro_bias]\n")
    parameters = {"fault.gyro_bias.bias": "10 deg/s", "fault.push.at": "2 s"}
    options = RunOptions(faults=str(own), parameters=parameters)
    push, gyro = prepare(file, options).faults
    assert push.time == 2.0 and gyro.parameters.bias == pytest.approx(0.1745, abs=1e-4)
    assert prepare(file, RunOptions(faults="none")).faults == ()
    assert [f.name for f in prepare(file, RunOptions(faults="push+push")).faults] == [
        "push", "push_2",
    ]  # fmt: skip
    with pytest.raises(InputError, match=r"no fault 'psh'.*did you mean 'push'"):
        prepare(file, RunOptions(faults="psh"))
    with pytest.raises(InputError, match=r"--faults none\+push: `none` stands alone"):
        prepare(file, RunOptions(faults="none+push"))
    with pytest.raises(InputError, match="this run has no fault 'push'"):
        prepare(file, RunOptions(parameters={"fault.push.left": "1"}))
    with pytest.raises(InputError, match="the fault lidar_dropout has no number 'shar'"):
        prepare(file, RunOptions(parameters={"fault.lidar_dropout.shar": "1"}))


@pytest.mark.parametrize(
    ("faults", "robot", "place", "sentence"),
    [
        ("[depth_holes]", "jackal", (3, 9), "jackal has no depth camera 'depth'"),
        ("[{sensor_loss: {sensor: radar}}]", "scout", (3, 9), "no sensor 'radar'; it has lidar"),
        ("[closed_door]", "scout", (3, 9), "the world small room has no doors"),
        ("[{kidnap: {to: [99, 2, 0]}}]", "scout", (3, 9), "(99, 2) is outside the world, which c"),
        ("[{dropped_box: {x: 1, y: -9}}]", "scout", (3, 9), "(1, -9) is outside the world, wh"),
        ("[{push: {}, at: {near: [9, 1]}}]", "scout", (3, 9), "(9, 1) is outside the world, whi"),
        ("[push, pusch]", "scout", (3, 16), "there is no fault 'pusch'"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, faults, robot, place, sentence):
    file = tmp_path / "m.yaml"
    file.write_text(
        f"mission: a\nrobot: {robot}\nfaults: {faults}\nworld: small_room\nrun: {{wait: 1 s}}\n"
    )
    (item,) = diagnose(file).findings
    assert sentence in item.sentence and (item.mark.line, item.mark.column) == place


def test_only_a_simulated_robot_has_faults(mission):
    with pytest.raises(InputError, match="the body scripted is not simulated"):
        prepare(mission(), RunOptions(body="scripted"))


def test_worlds_have_faults_for_every_mission(mission, tmp_path):
    world = (Path(missions.__file__).parent / "worlds" / "small_room.yaml").read_text()
    (tmp_path / "w.yaml").write_text(f"{world}\nfaults:\n  - push: {{}}\n    at: 1 s\n")
    faults = prepare(mission(world="./w.yaml"), RunOptions()).faults
    assert [fault.name for fault in faults] == ["lidar_dropout", "push"]


def test_robots_in_one_world_share_its_furniture(mission):
    with pytest.raises(InputError, match="changes the world"):
        prepare_together(["01_drive_to_a_point", mission()], RunOptions(faults="moved_furniture"))


def test_moved_furniture_is_not_on_the_map(tmp_path):
    from missions.execution.fit.faults import world_of

    plan = prepare("02_office_patrol", RunOptions(faults="moved_chairs"))
    moved = world_of(plan.world, plan.faults, plan.robot, plan.start, seed=1)
    apart = [
        one.pose.distance_to(other.pose)
        for one, other in zip(moved.boxes, plan.world.boxes, strict=True)
    ]
    assert 0 < sum(away > 0.0 for away in apart) < len(apart) and max(apart) <= 0.5


@pytest.mark.parametrize("name", list(fault_files()))
def test_shipped_faults_are_valid_(name):
    plan = prepare("02_office_patrol", RunOptions(faults=name))
    assert len(plan.faults) == 1


def test_files_of_faults_are_checked(tmp_path):
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text("doc: mine\nfaults:\n  - push\n  - kidnap: {to: dock}\n    at: {near: home}\n")
    bad.write_text("doc: mine\nfaults:\n  - pusch\n")
    assert findings_of(good) == ()
    (item,) = findings_of(bad)
    assert (item.code, item.mark.line) == ("E210", 3) and "did you mean 'push'" in item.hint


def test_start_and_people_have_numbers():
    plan = prepare("03_blocked_corridor", RunOptions(parameters={"start.x": "2 m"}))
    assert (plan.start.x, plan.start.y) == (2.0, 3.0)
    office = prepare("02_office_patrol", RunOptions())
    name = office.world.people[0].name
    parameters = {f"person.{name}.speed": "1.25", "start.heading": "90 deg"}
    plan = prepare("02_office_patrol", RunOptions(parameters=parameters))
    assert plan.world.people[0].speed == 1.25
    assert plan.start.heading == pytest.approx(pi / 2)
    for wrong, hint in (
        ({"start.z": "1"}, "a start has x, y, heading"),
        ({"person.nobody.speed": "1"}, "no such person or number"),
        ({f"person.{name}.spead": "1"}, "did you mean 'speed'"),
        ({f"person.{name}.speed": "9"}, "9 m/s must be at most 3"),
    ):
        with pytest.raises(InputError, match=hint):
            prepare("02_office_patrol", RunOptions(parameters=wrong))
