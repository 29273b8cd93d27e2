"""Crossing small worlds for the benchmark: the table, resuming, and what a failure leaves."""

from __future__ import annotations

import json
from itertools import chain

import pytest

from missions.bench.goal_runs import Entry, Setup, with_controller
from missions.bench.run_table import measured
from missions.bench.shortest_path import shortest_path_lengths
from missions.bench.trial import driven
from missions.execution.resources import MISSIONS, load_robot
from missions.run_options import RunOptions
from stack.errors import InputError
from stack.types import Pose2D
from tests.benchmarks.barn_worlds import find_worlds
from tests.benchmarks.benches.barn import BARN, MISSION, RULES, score_of
from tests.benchmarks.benchmark import MoreOptions
from tests.stack.sim.gazebo_text import (
    collision_model,
    cylinder_world,
    gazebo_world,
    unit_cylinder,
)

START, GOAL = Pose2D(-2.25, 3.0), Pose2D(-2.25, 13.0)

COLUMNS, ROWS = range(30), range(64)
COURT = sorted({*((i, 0) for i in COLUMNS), *((i, j) for j in ROWS for i in (0, 29))})
"""Cells of the walls of a court that is open to the north, like the benchmark's."""

SLALOM = [*((i, 36) for i in range(1, 21)), *((i, 48) for i in range(9, 29))]
"""Two walls across it, with a gap of 1.05 m on either side in turn: a double bend."""


def barn(file, mission="", out="out", trials=1, jobs=1, tell=print, only=(), **arguments):
    """Runs of a mission through the worlds of a file, in a folder beside it."""
    return measured(BARN, MoreOptions(
        file.parent / out, jobs, range(trials), only, mission=mission, arguments=arguments,
        files=(file,),
    ), tell)  # fmt: skip


def grids(path, *worlds):
    entries = [
        {"id": n, "path_len": 12.0, "cyl": [*map(list, cells)]} for n, cells in enumerate(worlds)
    ]
    path.write_text(json.dumps({"radius": 0.075, "worlds": entries}))
    return path


def places(cells):
    return [(-4.425 + 0.15 * i, 0.075 + 0.15 * j) for i, j in cells]


def blind_mission(tmp_path):
    """A mission that drives straight on, whatever stands there, into a wall close by."""
    text = MISSION.read_text("utf-8")
    text = text[: text.index("run:")] + "run:\n  say: $goal is not worth the way\n"
    path = tmp_path / "blind.yaml"
    path.write_text(text)
    return str(path)


def test_a_slalom_is_crossed_and_the_table_resumes(tmp_path):
    file = grids(tmp_path / "w.json", [*COURT, *SLALOM])
    told: list[str] = []
    (run,) = barn(file, tell=told.append)
    assert (run.status, run.cause) == ("success", "")
    assert run.path_length == 12.0 and run.clearance > 0.0
    assert score_of(run, 2.0) > 0.45
    settings = json.loads((tmp_path / "out" / "settings.json").read_text("utf-8"))
    assert settings["barn"]["limits"]["linear_speed"] == 2.0
    assert not (tmp_path / "out" / "failures").exists()

    table = tmp_path / "out" / "runs.jsonl"
    with table.open("a") as opened:
        opened.write('{"world": "0", "tri')  # cut off by an interruption
    again: list[str] = []
    assert barn(file, tell=again.append) == [run]
    assert "1 of 1 runs are already in" in again[0]
    assert len(table.read_text().splitlines()) == 1
    (row,) = BARN.table([run])
    assert (row["worlds"], row["success %"], row["score k=4"]) == (1, 100.0, score_of(run, 4.0))


def test_the_same_trial_drives_the_same_way(tmp_path):
    (case,) = find_worlds(grids(tmp_path / "w.json", [*COURT, *SLALOM[:8]]))
    setup = Setup(str(MISSION), RULES)
    first, second = (driven(Entry(setup, case, 3)) for _ in range(2))
    assert first.trace == second.trace and first.run.time == second.run.time
    assert driven(Entry(setup, case, 4)).trace != first.trace


def test_a_failure_has_a_cause_and_a_picture(tmp_path):
    file = grids(tmp_path / "w.json", COURT)
    (run,) = barn(file, blind_mission(tmp_path))
    assert run.status == "gave_up"
    assert "the mission ended at (-2.25, 3.00), 10.0 m from the goal" in run.cause
    picture = tmp_path / "out" / "failures" / "blind-0-0.png"
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_what_the_lidar_cannot_see_is_touched_and_ends_the_run(tmp_path):
    file = tmp_path / "sill.world"  # 0.2 m high, the lidar looks over it at 0.3 m
    sill = collision_model("<box><size>6 0.2 0.4</size></box>", "-2.25 5 0 0 0 0", "sill")
    file.write_text(gazebo_world(sill + unit_cylinder(0, -2.25, 20.0)))
    (run,) = barn(file)
    assert run.status == "contact" and score_of(run, 4.0) == 0.0
    assert "contact with a static obstacle at (-2." in run.cause and "m/s" in run.cause
    assert (tmp_path / "out" / "failures" / "barn-sill-0.png").exists()


def test_another_setting_does_not_mix_with_the_results_there(tmp_path):
    file = grids(tmp_path / "w.json", COURT)
    blind = blind_mission(tmp_path)
    barn(file, blind)
    with pytest.raises(InputError, match=r"results of other settings.*choose another --out"):
        barn(file, blind, goal="[0, 20, 0]")


@pytest.mark.slow
def test_worn_out_processes_are_replaced_and_every_run_comes_back(tmp_path, monkeypatch):
    monkeypatch.setattr("missions.bench.run_table.RUNS_PER_PROCESS", 1)
    file = grids(tmp_path / "w.json", COURT)
    rows = barn(file, blind_mission(tmp_path), trials=3, jobs=2)
    assert sorted(row.trial for row in rows) == [0, 1, 2]  # the third in a new process


def test_gazebo_files_are_found_in_their_natural_order(tmp_path):
    for number in (10, 9, 100):
        (tmp_path / f"world_{number}.world").write_text(cylinder_world(places(COURT)))
    found = find_worlds(tmp_path)
    assert [case.name for case in found] == ["world_9", "world_10", "world_100"]
    assert len(found[0].world.cylinders) == len(COURT)
    one = find_worlds(tmp_path / "world_9.world")
    assert [case.name for case in one] == ["world_9"]


def test_the_path_length_of_a_world_without_one_is_the_shortest_way(tmp_path):
    robot = load_robot("jackal", MISSIONS)

    def length(case):
        return shortest_path_lengths(case.world, robot, (START, GOAL))(START, GOAL)

    file = tmp_path / "a.world"
    file.write_text(cylinder_world(places(COURT)))
    (free,) = find_worlds(file)
    assert length(free) == pytest.approx(10.0, abs=0.05)
    file.with_name("b.world").write_text(cylinder_world(chain(places(COURT), places(SLALOM))))
    (bent,) = find_worlds(file.with_name("b.world"))
    # round the corners at (-1.28, 5.4) and (-3.2, 7.2), 0.215 m + 0.075 m away from the posts
    assert 11.3 < length(bent) < 12.3


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("[1", "not JSON"),
        ("{}", "not a file of BARN grids: KeyError 'worlds'"),
        ('{"radius": 1, "worlds": [{"id": 1, "path_len": 3, "cyl": []}]}', "not a file of BARN"),
    ],
)
def test_what_is_no_file_of_grids(tmp_path, content, sentence):
    path = tmp_path / "w.json"
    path.write_text(content)
    with pytest.raises(InputError, match=sentence):
        find_worlds(path)


def test_a_folder_without_worlds_and_an_unknown_name(tmp_path):
    with pytest.raises(InputError, match=r"E001.*no BARN worlds"):
        find_worlds(tmp_path)
    file = grids(tmp_path / "w.json", COURT)
    with pytest.raises(InputError, match="no world '7' among the 1 worlds"):
        barn(file, only=("7",))


def test_the_options_of_a_setup_are_those_of_its_runs():
    given = with_controller("mppi", {"controller.cruise_speed": "1.2"})
    options = RunOptions(robot="scout", start="1,2,0", parameters=given)
    setup = Setup("01_drive_to_a_point", RULES, options)
    assert setup.label == "01_drive_to_a_point scout mppi controller.cruise_speed=1.2"
    plan, used = setup.plan(None, 7)
    assert (used.seed, used.serve, used.camera) == (7, False, "off")
    assert (plan.start, plan.choices["controller"].name) == (Pose2D(1.0, 2.0, 0.0), "mppi")
