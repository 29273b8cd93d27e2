"""The bench of random flats with people: its cases, its table, and one real run."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
import yaml

from missions.bench.bench import Options, robot_label
from missions.bench.flats import (
    FLATS,
    GOALS,
    START_CLEARANCE,
    entries_of,
    make_flat,
    table_of,
)
from missions.bench.people_runs import (
    MISSION,
    MODELS,
    FailureCodes,
    PeopleEntry,
    PeopleRow,
    settings_of,
)
from missions.bench.run_table import measured, record_settings
from missions.inspection.file_scaffold import new_mission
from robots.load import find_robot
from stack.errors import InputError
from stack.sim.people import People
from stack.sim.worlds.world_file import read_world
from stack.telemetry.records import Event

ROW = PeopleRow(
    "flats", "scout", "unaware", 0, status="passed", cause="", goals=4, visited=4,
    false_goals=0, persons=3, time=60.0, driven=22.0, failures={}, drove_into=0,
    struck_moving=1, struck_standing=0, things=0, least_distance=0.2, intimate=3.0,
    personal=20.0, collision_time=0.8, jerk=1.0, longest_stand=4.0, standoffs=0,
    wall_seconds=3.0,
)  # fmt: skip


def entry(tmp_path, people="unaware", seed=3) -> PeopleEntry:
    return PeopleEntry("flats", "scout", people, seed, make_flat, Options(tmp_path))


@pytest.mark.parametrize("seed", [2, 3])
def test_a_seed_has_the_same_walls_and_goals_for_all_kinds_of_people(tmp_path, seed):
    cases = {model: make_flat(entry(tmp_path, model, seed)) for model in MODELS}
    worlds = {model: read_world(case.file) for model, case in cases.items()}
    assert len({case.goals for case in cases.values()}) == 1
    assert len({str(world.boxes) + str(world.walls) for world in worlds.values()}) == 1
    assert cases["none"].people == 0 < cases["unaware"].people
    assert {person.model for person in worlds["social_force"].people} == {"social_force"}
    assert [person.yields for person in worlds["polite"].people] == [True] * cases["polite"].people
    assert not any(person.yields for person in worlds["unaware"].people)
    assert cases["unaware"].command("scout", seed).startswith("treepilot run ")


@pytest.mark.parametrize("model", ["unaware", "social_force"])
@pytest.mark.parametrize("seed", [3, 21016, 21032, 21054])
def test_nobody_begins_near_the_robot(tmp_path, seed, model):
    """With starts read as numbers of waypoints, people on loops began from 0.66 m on."""
    world = read_world(make_flat(entry(tmp_path, model, seed)).file)
    assert world.people
    for person, (x, y) in zip(world.people, People(world, seed).positions, strict=True):
        longest = np.hypot(*(person.waypoints - (world.start.x, world.start.y)).T).max()
        away = np.hypot(x - world.start.x, y - world.start.y)
        assert away >= min(START_CLEARANCE, longest - 0.3)


def test_the_mission_recovers_as_the_template_of_new_missions_does(tmp_path):
    template = new_mission("own", tmp_path, "office", "scout")

    def recover(path):
        visit = yaml.safe_load(path.read_text("utf-8"))["trees"]["visit"]["do"]["sequence"]
        return visit[0]["timeout"], visit[0]["recover"]

    assert recover(MISSION) == recover(template)


def test_the_table_has_intervals_and_compares_with_the_runs_without_people():
    rows = [
        replace(ROW, people="none", time=50.0, driven=20.0, least_distance=None, struck_moving=0),
        ROW,
        replace(ROW, seed=1, status="failed", visited=3, cause="drive to (1, 2) failed: LOST"),
    ]
    none, unaware = table_of(rows)
    assert (none["people"], unaware["people"]) == ("none", "unaware")
    assert (unaware["all goals"], unaware["goals"]) == ("1/2", "7/8")
    assert unaware["95 % interval"] == "9% to 91%"  # Wilson 1927 for 1 of 2
    assert (unaware["time"], unaware["way"]) == ("1.20", "1.10")
    assert unaware["struck moving"] == 2
    lines = FLATS.report(rows)
    assert lines[-1] == "  flats, scout, unaware, seed 1: failed: drive to (1, 2) failed: LOST"
    assert FLATS.report([]) == []
    both = [*rows, replace(ROW, robot="glide")]
    assert [row["robot"] for row in table_of(both)] == ["scout", "all", "scout", "glide", "all"]


def test_a_kind_of_people_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(InputError, match="--people nice: choose from none, social_force"):
        entries_of(Options(tmp_path, people=("nice",)))
    entries = entries_of(
        Options(tmp_path, seeds=range(2), robots=("scout", "glide"), people=("none",))
    )
    assert [item.key[1:] for item in entries] == [
        ("scout", "none", 0), ("glide", "none", 0), ("scout", "none", 1), ("glide", "none", 1),
    ]  # fmt: skip


def test_a_table_of_another_mission_world_or_robot_is_not_continued(tmp_path, monkeypatch):
    def record(people="social_force", seed=3, robot="scout"):
        made = replace(entry(tmp_path / "made", people, seed), robot=robot)
        record_settings(tmp_path / "out", {made.label: settings_of(made)})

    record()
    record("none", 4)  # other seeds and people continue it

    mission = tmp_path / "flats.yaml"
    mission.write_text(MISSION.read_text("utf-8").replace("90 s", "80 s"), "utf-8")
    with monkeypatch.context() as changed:
        changed.setattr("missions.bench.people_runs.MISSION", mission)
        with pytest.raises(InputError, match="results of other settings"):
            record()
    with monkeypatch.context() as changed:
        changed.setattr("missions.bench.flats.UNMAPPED", 0.5)
        with pytest.raises(InputError, match="results of other settings"):
            record()
    shutil.copytree(find_robot("scout", tmp_path).parent, tmp_path / "scout")
    faster = tmp_path / "scout" / "robot.yaml"
    record(robot=str(faster))
    shape = tmp_path / "scout" / "scout.urdf"
    for file, before, after in (
        (faster, "linear_speed: 0.8 m/s", "linear_speed: 0.9 m/s"),
        (faster, "field_of_view: 360 deg", "field_of_view: 270 deg"),
        (shape, '<mass value="', '<mass value="1'),
    ):
        text = file.read_text("utf-8")
        assert before in text
        file.write_text(text.replace(before, after), "utf-8")
        with pytest.raises(InputError, match="results of other settings"):
            record(robot=str(faster))
        file.write_text(text, "utf-8")
        record(robot=str(faster))


def test_a_run_that_is_not_over_at_its_limit_says_so(tmp_path, monkeypatch):
    """A drive that failed before and was recovered is not the cause."""
    monkeypatch.setattr("missions.bench.people_runs.TIME_LIMIT", 2.0)
    failed = Event(
        0, 0, 1.0, "warning", "navigation", "task", "drive to (1.0, 2.0) failed",
        {"status": "failed", "code": "NO_PROGRESS", "moves": True},
    )  # fmt: skip
    monkeypatch.setattr(FailureCodes, "open", lambda codes, info: codes.event(failed))
    row = FLATS.row(entry(tmp_path, "none", 2), tmp_path)
    (picture,) = (tmp_path / "failures").iterdir()
    assert picture.name == "flats-scout-none-2.png"
    assert (row.status, row.failures) == ("failed", {"NO_PROGRESS": 1})
    assert row.cause == "not finished after 2 s"


def test_a_run_reaches_its_goals_and_a_crash_is_a_row(tmp_path):
    row = FLATS.row(entry(tmp_path, "social_force", 2), tmp_path)
    assert (row.status, row.visited, row.false_goals) == ("passed", GOALS, 0)
    assert (row.drove_into, row.things) == (0, 0)
    assert row.least_distance is not None
    assert 0.0 < row.intimate <= row.personal
    assert row.line.startswith("flats, scout, social_force, seed 2: 4/4 goals")
    crash = PeopleRow.crashed(entry(tmp_path).key, "ValueError: no")
    assert (crash.success, crash.cause) == (False, "ValueError: no")


def test_a_robot_that_does_not_fit_at_its_start_has_failed(tmp_path):
    """The places of a world have random headings: a car does not fit at each of them."""
    row = FLATS.row(replace(entry(tmp_path, "none", 10040), robot="buggy"), tmp_path)
    assert (row.status, row.visited, row.goals) == ("failed", 0, GOALS)
    assert "the robot overlaps a wall" in row.cause


def test_robots_in_files_called_robot_yaml_are_named_by_their_folders(tmp_path):
    names = ("scout", str(tmp_path / "mine/robot.yaml"), "../yours/robot.yaml", "a/b.yaml")
    assert [robot_label(name) for name in names] == ["scout", "mine", "yours", "b"]


def test_two_runs_of_the_same_name_are_refused(tmp_path):
    options = Options(tmp_path / "out", robots=("scout", "scout"), people=("none",))
    with pytest.raises(InputError, match="2 runs have the name flats, scout, none, 0"):
        measured(FLATS, options, print)
