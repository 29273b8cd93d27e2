"""Crossing small worlds for the benchmark: the table, resuming, and what a failure leaves."""

from __future__ import annotations

import json
from itertools import chain

import pytest

from missions.bench.barn_bench import BenchOptions, report, run_barn
from missions.bench.barn_crossing import Setup, cross
from missions.bench.barn_worlds import find_worlds, path_length
from missions.resources import MISSIONS, load_robot
from stack.errors import InputError
from stack.types import Pose2D
from tests.stack.sim.gazebo_text import (
    collision_model,
    cylinder_world,
    gazebo_world,
    unit_cylinder,
)

MISSION = str(MISSIONS / "bench" / "barn.yaml")
START, GOAL = Pose2D(-2.25, 3.0), Pose2D(-2.25, 13.0)

COLUMNS, ROWS = range(30), range(64)
COURT = sorted({*((i, 0) for i in COLUMNS), *((i, j) for j in ROWS for i in (0, 29))})
"""Cells of the walls of a court that is open to the north, like the benchmark's."""

SLALOM = [*((i, 36) for i in range(1, 21)), *((i, 48) for i in range(9, 29))]
"""Two walls across it, with a gap of 1.05 m on either side in turn: a double bend."""


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
    text = (MISSIONS / "bench" / "barn.yaml").read_text("utf-8")
    text = text[: text.index("run:")] + "run:\n  say: $goal is not worth the way\n"
    text = text.replace("../worlds/thicket.yaml", str(MISSIONS / "worlds" / "thicket.yaml"))
    path = tmp_path / "blind.yaml"
    path.write_text(text)
    return str(path)


def test_a_slalom_is_crossed_and_the_table_resumes(tmp_path):
    file = grids(tmp_path / "w.json", [*COURT, *SLALOM])
    options = BenchOptions(file, Setup(MISSION), tmp_path / "out")
    told: list[str] = []
    (crossing,) = run_barn(options, told.append)
    assert (crossing.status, crossing.cause) == ("success", "")
    assert crossing.path_length == 12.0 and crossing.clearance > 0.0
    assert crossing.score(2.0) > 0.45
    assert "2 m/s, 4 rad/s, +5/-5 m/s², 10 rad/s²" in told[0]
    assert not (tmp_path / "out" / "failures").exists()

    table = tmp_path / "out" / "runs.jsonl"
    with table.open("a") as file:
        file.write('{"world": "0", "tri')  # cut off by an interruption
    again: list[str] = []
    assert run_barn(options, again.append) == [crossing]
    assert "1 of 1 runs are in" in again[1]
    assert len(table.read_text().splitlines()) == 1
    assert "success        100.00%  (none failed)" in report([crossing])


def test_the_same_trial_drives_the_same_way(tmp_path):
    (case,) = find_worlds(grids(tmp_path / "w.json", [*COURT, *SLALOM[:8]]))
    (first, way), (second, again) = (cross(case, Setup(MISSION), 3) for _ in range(2))
    assert way == again and first.time == second.time
    assert cross(case, Setup(MISSION), 4)[1] != way


def test_a_failure_has_a_cause_and_a_picture(tmp_path):
    file = grids(tmp_path / "w.json", COURT)
    setup = Setup(blind_mission(tmp_path))
    (crossing,) = run_barn(BenchOptions(file, setup, tmp_path / "out"), print)
    assert crossing.status == "gave_up"
    assert "the mission ended at (-2.25, 3.00), 10.0 m from the goal" in crossing.cause
    picture = tmp_path / "out" / "failures" / "0-0.png"
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_what_the_lidar_cannot_see_is_touched_and_ends_the_run(tmp_path):
    file = tmp_path / "sill.world"  # 0.2 m high, the lidar looks over it at 0.3 m
    sill = collision_model("<box><size>6 0.2 0.4</size></box>", "-2.25 5 0 0 0 0", "sill")
    file.write_text(gazebo_world(sill + unit_cylinder(0, -2.25, 20.0)))
    (crossing,) = run_barn(BenchOptions(file, Setup(MISSION), tmp_path / "out"), print)
    assert crossing.status == "contact" and crossing.score(4.0) == 0.0
    assert "touched at (-2." in crossing.cause and "m/s" in crossing.cause
    assert (tmp_path / "out" / "failures" / "sill-0.png").exists()


def test_another_setting_does_not_mix_with_the_results_there(tmp_path):
    file = grids(tmp_path / "w.json", COURT)
    blind = Setup(blind_mission(tmp_path))
    run_barn(BenchOptions(file, blind, tmp_path / "out"), print)
    other = Setup(blind.mission, {"goal": "[0, 20, 0]"})
    with pytest.raises(InputError, match=r"results of other settings.*choose another --out"):
        run_barn(BenchOptions(file, other, tmp_path / "out"), print)


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
    file = tmp_path / "a.world"
    file.write_text(cylinder_world(places(COURT)))
    (free,) = find_worlds(file)
    assert path_length(free, robot, START, GOAL) == pytest.approx(10.0, abs=0.05)
    file.with_name("b.world").write_text(cylinder_world(chain(places(COURT), places(SLALOM))))
    (bent,) = find_worlds(file.with_name("b.world"))
    # round the corners at (-1.28, 5.4) and (-3.2, 7.2), 0.215 m + 0.075 m away from the posts
    assert 11.3 < path_length(bent, robot, START, GOAL) < 12.3


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
    with pytest.raises(InputError, match=r"E001.*no BARN worlds here"):
        find_worlds(tmp_path)
    file = grids(tmp_path / "w.json", COURT)
    options = BenchOptions(file, Setup(MISSION), tmp_path / "out", only=("7",))
    with pytest.raises(InputError, match="no world '7' among the 1 here"):
        run_barn(options, print)
