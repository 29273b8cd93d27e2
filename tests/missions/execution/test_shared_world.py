"""Missions that run at once, a robot each, in one world with one clock."""

import gc
from datetime import datetime
from pathlib import Path
from shutil import copytree

import pytest

import missions
from missions.execution.prepare import RunOptions
from missions.execution.records import run_folders
from missions.execution.records.run_folders import RUNS, reserved_suffix
from missions.execution.run import Run
from missions.execution.running import COLLECT_AFTER
from missions.execution.shared_world import prepare_together, run_together
from robots.bodies import sharing
from stack.errors import InputError
from stack.sim.simulation import Simulation
from stack.telemetry.records import Command, MissionState

EAST = """
mission: east
robot: scout
world: small_room
start: [1.0, 2.4, 0 deg]
arguments: {goal: {type: Pose, default: [3.4, 2.3, 0 deg]}}
run: {navigate_to_pose: {goal: $goal}}
"""
WEST = """
mission: west
robot: scout
world: small_room
start: [5.4, 2.4, 180 deg]
run: {navigate_to_pose: {goal: [3.0, 4.0, 180 deg]}}
"""


@pytest.fixture
def files(tmp_path):
    """Two missions in one room, as file names."""

    def write(**texts):
        for name, text in {"east": EAST, "west": WEST, **texts}.items():
            (tmp_path / f"{name}.yaml").write_text(text)
        return [str(tmp_path / f"{name}.yaml") for name in ("east", "west")]

    return write


@pytest.fixture
def together(files):
    """The runs of two missions that share a simulation."""
    simulations = []

    def start(**texts):
        entries = prepare_together(files(**texts), RunOptions(seed=3, serve=False))
        simulation = Simulation(entries[0].plan.world)
        simulations.append(simulation)
        runs = [Run(entry.plan, entry.options, (), sharing(simulation)) for entry in entries]
        return simulation, runs

    yield start
    for simulation in simulations:
        simulation.close()


def rounds(runs, count):
    for _ in range(count):
        for run in runs:
            if run.is_due:
                run.step()


def order(run, kind):
    assert run.engine.runtime.apply(Command(kind, kind, {})).done


def test_two_missions_succeed_and_give_the_same_logs_again(files):
    first, again = (missions.run_together(files(), seed=3) for _ in range(2))
    assert [report.status for report in first] == ["success", "success"]
    assert [report.seed for report in first] == [3, 4]
    assert [report.log_sha256 for report in first] == [report.log_sha256 for report in again]
    assert [report.collisions for report in first] == [0, 0]


def test_the_garbage_collector_is_as_rare_as_with_one_robot_and_restored_afterwards(files):
    before, seen = gc.get_threshold(), set()

    def interrupted():
        seen.add(gc.get_threshold()[0])
        return True

    entries = prepare_together(files(), RunOptions(serve=False))
    reports = run_together(entries, interrupted)
    assert [report.status for report in reports] == ["interrupted", "interrupted"]
    assert seen == {COLLECT_AFTER}
    assert gc.get_threshold() == before


def test_each_run_has_a_folder_and_a_name_of_its_own(files, tmp_path):
    reports = missions.run_together(files(west=WEST.replace("[3.0, 4.0", "[5.0, 2.4")), seed=1,
                                    out=tmp_path / "out")  # fmt: skip
    assert [Path(report.folder).name for report in reports] == ["east", "west"]
    for report in reports:
        assert (Path(report.folder) / "report.json").is_file()
        assert (Path(report.folder) / "events.jsonl").is_file()


def test_holding_one_robot_holds_only_that_one(together):
    simulation, runs = together()
    one, other = (run.engine for run in runs)
    rounds(runs, 20)
    order(runs[0], "pause")
    rounds(runs, 40)  # it comes to a stop
    held, before = one.body.truth.pose, other.body.truth.pose
    time = simulation.time
    rounds(runs, 20)
    assert simulation.time == pytest.approx(time + 1.0)
    assert one.runtime.state is MissionState.PAUSED
    assert one.body.truth.pose.distance_to(held) < 1e-3
    assert other.body.truth.pose.distance_to(before) > 0.1


def test_the_clock_stands_while_all_robots_are_held_and_goes_on_with_the_first(together):
    simulation, runs = together()
    rounds(runs, 10)
    for run in runs:
        order(run, "pause")
    rounds(runs, 60)
    time = simulation.time
    rounds(runs, 3)
    assert simulation.time == time
    assert [run.engine.runtime.is_frozen for run in runs] == [True, True]
    order(runs[1], "resume")
    rounds(runs, 20)
    assert simulation.time == pytest.approx(time + 1.0, abs=0.11)
    assert runs[0].engine.runtime.state is MissionState.PAUSED
    assert runs[1].engine.runtime.state is MissionState.RUNNING
    for run in runs:
        run.close()


def test_an_emergency_stop_stops_only_its_robot(together):
    _, runs = together()
    rounds(runs, 30)
    order(runs[0], "estop")
    rounds(runs, 20)
    speeds = [run.engine.body.truth.twist.linear for run in runs]
    assert abs(speeds[0]) < 0.02
    assert speeds[1] > 0.1


def test_a_robot_whose_mission_is_over_stays_in_the_way(files):
    done = EAST.replace("{navigate_to_pose: {goal: $goal}}", "{wait: 0.1 s}")
    entries = prepare_together(files(east=done), RunOptions(seed=3, serve=False))
    reports = run_together(entries)
    assert [report.status for report in reports] == ["success", "success"]
    assert reports[0].simulated_seconds < 1.0 < reports[1].simulated_seconds


def test_the_other_robot_is_avoided(files):
    """The robot that stands on the straight way, unmapped, is seen and passed."""
    standing = EAST.replace("[1.0, 2.4, 0 deg]", "[3.0, 2.4, 0 deg]").replace(
        "{navigate_to_pose: {goal: $goal}}", "{wait: 0.1 s}"
    )
    passing = WEST.replace("[3.0, 4.0, 180 deg]", "[1.0, 2.4, 180 deg]")
    _, driven = run_together(
        prepare_together(files(east=standing, west=passing), RunOptions(seed=3, serve=False))
    )
    assert (driven.status, driven.collisions) == ("success", 0)
    assert 0.0 < driven.min_clearance_m < 1.0


def test_the_other_robot_is_tracked_as_something_that_moves(together):
    tracking = EAST.replace(
        "run: {navigate_to_pose: {goal: $goal}}",
        "navigation: {costmap: {layers: [static, obstacle, social]}}\nrun: {wait: 60 s}",
    )
    _, runs = together(east=tracking)
    rounds(runs, 60)
    truth = runs[1].engine.body.truth
    tracks = runs[0].engine.runtime.perceived.world.tracks
    moving = [track for track in tracks if track.speed > 0.2]
    assert len(moving) == 1
    assert moving[0].position == pytest.approx((truth.pose.x, truth.pose.y), abs=0.3)


def test_a_signal_ends_all_missions(files):
    entries = prepare_together(files(), RunOptions(seed=3, serve=False))
    reports = run_together(entries, lambda: True)
    assert [report.status for report in reports] == ["interrupted", "interrupted"]


@pytest.mark.parametrize(
    ("changes", "options", "message"),
    [
        ({"west": WEST.replace("small_room", "office").replace("[3.0, 4.0", "[1.9, 2.2")}, {},
         r"east\.yaml is in small room, west\.yaml in office; choose one with --world"),
        ({"west": EAST}, {}, r"east\.yaml and west\.yaml start at the same place, \(1, 2\.4\)"),
        ({}, {"start": "1,1"}, r"--start is for one mission"),
        ({}, {"foxglove": 8765}, r"--foxglove is for one mission"),
        ({}, {"breakpoints": ("a",)}, r"--break is for one mission"),
        ({}, {"arguments": {"speed": "3"}}, r"--set speed: none of the missions"),
        ({"west": WEST.replace("run:", "runs:")}, {}, r"west\.yaml"),
    ],
)  # fmt: skip
def test_what_does_not_fit_together_is_refused(files, changes, options, message):
    with pytest.raises(InputError, match=message):
        prepare_together(files(**changes), RunOptions(**options))


def test_a_robot_file_with_another_body_needs_the_option(files, tmp_path):
    folder = tmp_path / "scout"
    copytree(Path(__file__).parents[3] / "robots" / "scout", folder)
    file = folder / "robot.yaml"
    file.write_text(file.read_text() + "body: scripted\n")
    with pytest.raises(InputError, match=r"is scripted; .* add --body simulated"):
        prepare_together(files(), RunOptions(robot=str(file)))
    assert len(prepare_together(files(), RunOptions(robot=str(file), body="simulated"))) == 2


def test_an_argument_goes_to_the_missions_that_declare_it(files):
    entries = prepare_together(files(), RunOptions(arguments={"goal": "[2, 2.4, 0 deg]"}))
    assert [entry.options.arguments for entry in entries] == [{"goal": "[2, 2.4, 0 deg]"}, {}]


def test_equal_names_are_numbered(files, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "east.yaml").write_text(WEST)
    names = [files()[0], other / "east.yaml"]
    entries = prepare_together(names, RunOptions(out=tmp_path / "out"))
    assert [entry.label for entry in entries] == ["east", "east-2"]
    assert [entry.options.out for entry in entries] == [
        tmp_path / "out" / "east", tmp_path / "out" / "east-2",
    ]  # fmt: skip


def test_robots_with_different_control_rates_share_the_clock(together):
    rate = "\nnavigation: {loop: {control_rate: 50}}\n"
    _, runs = together(west=WEST.replace("\nrun:", f"{rate}run:"))
    while runs[0].engine.body.time < 0.5:
        for run in runs:
            if run.is_due:
                run.step()
    east, west = (run.engine.runtime.steps for run in runs)
    assert east == 10 and west in (25, 26)  # 20 Hz and 50 Hz for half a second


def test_runs_that_begin_in_the_same_second_get_folders_of_their_own(tmp_path, monkeypatch):
    class Noon(datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 11, 22, 12, 0, 0, tzinfo=tz)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_folders, "datetime", Noon)
    names = ["23_courier", "24_second_courier"]
    with reserved_suffix(names) as first, reserved_suffix(names[1:]) as second:
        assert (first, second) == ("-20261122-120000", "-20261122-120000-2")
        assert all((RUNS / (name + first)).is_dir() for name in names)
        Path(RUNS / (names[0] + first) / "log.txt").touch()
    assert sorted(folder.name for folder in RUNS.iterdir()) == [names[0] + first]  # not empty
    with reserved_suffix(names) as third:
        assert third == "-20261122-120000-2"
