"""The field of moving cylinders, and who ran into whom."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from missions.bench.bench import picture_name
from missions.bench.goal_runs import Entry, Setup
from missions.bench.layout import Layout, write_world
from missions.bench.trial import driven
from missions.run_options import RunOptions
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D
from tests.benchmarks.benches.dyna import DYNA, MISSION, RULES, JudgedTrial, entries_of, spread
from tests.benchmarks.benchmark import FILES, MoreOptions
from tests.benchmarks.dyna_worlds import GOAL, HIGHEST, LOWEST, START, dyna_text


def test_the_world_that_comes_along_is_the_first_one():
    assert (FILES / "cylinder_field.yaml").read_text("utf-8") == dyna_text(0)


@pytest.mark.parametrize(("number", "count"), [(0, 10), (10, 15), (19, 20)])
def test_ten_to_twenty_cylinders_move_at_their_speeds_and_keep_off_the_ends(
    number, count, tmp_path
):
    people = read_world(tmp_path / "w.yaml", dyna_text(number)).people
    assert len(people) == count
    for person in people:
        assert person.radius == 0.5 and not person.yields
        assert 0.7 <= person.speed <= 1.7
        assert (person.waypoints >= LOWEST - 1e-3).all()
        assert (person.waypoints <= HIGHEST + 1e-3).all()
        for end in (START, GOAL):
            away = np.hypot(*(person.waypoints - (end.x, end.y)).T)
            assert away.min() > 1.9


def test_cylinders_go_there_and_back(tmp_path):
    """A loop of n points there and n - 2 back turns round at both ends."""
    for person in read_world(tmp_path / "w.yaml", dyna_text(3)).people:
        loop = person.waypoints
        half = len(loop) // 2
        assert np.array_equal(loop[1:half], loop[:half:-1])


def story(tmp_path, do, way, **navigation):
    """What comes of a mission in a field with one cylinder."""
    text = MISSION.read_text("utf-8")
    mission = tmp_path / "mission.yaml"
    mission.write_text(
        text[: text.index("navigation:")].replace(
            "./cylinder_field", str(MISSION.parent / "cylinder_field")
        )
        + f"run:\n  {do}\n"
        + (f"navigation: {json.dumps(navigation)}\n" if navigation else "")
    )
    layout = Layout(Pose2D(4.0, 4.0), Pose2D(6.0, 7.0))
    layout.walls.append(([(0, 0), (8, 0), (8, 8), (0, 8)], True))
    layout.walkers.append(
        {"name": "it", "waypoints": way, "speed": 1.0, "radius": 0.5, "yields": False}
    )
    case = write_world(layout.text("one cylinder", "for a test"), "0", tmp_path / "world.yaml")
    return driven(Entry(Setup(str(mission), RULES, RunOptions(robot="jackal")), case, 0))


def test_a_robot_that_stands_is_struck(tmp_path):
    run = story(tmp_path, "wait: {time: 60 s}", [[7.5, 4], [0.9, 4]]).run
    assert run.status == "struck"
    assert "contact with it at (4." in run.cause


def test_a_robot_that_moves_has_a_contact_even_with_what_overtakes_it(tmp_path):
    """Safety judges by what stands: with prediction the robot stops for what comes from behind."""
    do = "drive_for: {linear: -0.3 m/s, time: 20 s}"
    told = story(tmp_path, do, [[7.5, 4], [0.9, 4]], safety={"predict_motion": False})
    assert told.run.status == "contact"
    assert 0.3 < told.run.driven < 1.0  # at 0.15 m/s: the jackal is blind behind
    assert told.walkers.shape == (1, 3)


def test_the_report_counts_who_ran_into_whom(tmp_path):
    gave_up = story(tmp_path, "say: nothing to do", [[6, 6], [6, 7]]).run
    run = JudgedTrial(**asdict(gave_up), possible=False)
    assert run.status == "gave_up"
    struck, met = replace(run, status="struck", trial=1), replace(run, status="contact", trial=2)
    reached = replace(run, status="success", trial=3, time=9.0, driven=12.0, path_length=6.0)
    (row,) = DYNA.table([run, struck, met, reached])
    assert (row["success"], row["time s"], row["driven / shortest"]) == ("1/4", 9.0, 2.0)
    counts = [row[status] for status in ("contact", "struck", "timeout", "gave_up")]
    assert [*counts, row["impossible"]] == [1, 1, 0, 1, 4]
    assert len(DYNA.report([run, struck, met, reached])) == 5


def test_fewer_worlds_are_spread_evenly(tmp_path):
    options = MoreOptions(tmp_path, names=spread(3), robots=("jackal",), controllers=("dwb",))
    assert [entry.case.name for entry in entries_of(options)] == ["0", "10", "19"]
    with pytest.raises(InputError, match="expected 1 to 20"):
        spread(21)


def test_the_picture_of_a_setup_with_many_parameters_has_a_name_that_a_file_can_have():
    """A file name has 255 bytes at most; the setup of mppi once had 276."""
    many = "dyna jackal mppi " + " ".join(f"controller.parameter_{n}=1.0" for n in range(12))
    names = {picture_name((many + end, world, 0)) for end in ("", " x=1") for world in ("3", "4")}
    assert len(names) == 4
    assert all(len(f"{name}-oracle.png".encode()) < 255 for name in names)
    assert picture_name(("dyna mppi", "4", 0)) == "dyna-mppi-4-0"
