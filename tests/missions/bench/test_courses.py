"""Narrow passages: made to measure, the same for everybody, and driven through."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.bench.bench import Options
from missions.bench.course_bench import COURSE_BENCH, entries_of
from missions.bench.courses import COURSES, Size
from missions.bench.shortest_path import shortest_path_lengths
from missions.execution.resources import MISSIONS, load_robot
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world

ROBOTS = {name: load_robot(name, MISSIONS) for name in ("scout", "jackal")}


def world_of(course, robot, trial, tmp_path):
    return read_world(tmp_path / "w.yaml", COURSES[course].text(ROBOTS[robot], trial))


@pytest.mark.parametrize("course", COURSES)
def test_a_trial_is_the_same_for_everybody_and_no_two_are_alike(course):
    made = [COURSES[course].text(ROBOTS["scout"], trial) for trial in range(20)]
    assert made == [COURSES[course].text(ROBOTS["scout"], trial) for trial in range(20)]
    assert len(set(made)) == 20


def test_sizes_are_those_of_the_circles_in_and_round_a_footprint():
    size = Size.of(ROBOTS["jackal"].footprint)
    assert size.width == pytest.approx(0.43)
    assert size.turning == pytest.approx(2 * hypot(0.254, 0.215))


@pytest.mark.parametrize(("robot", "width"), [("scout", 0.44), ("jackal", 0.43)])
def test_the_door_is_ten_centimetres_wider_than_the_robot(robot, width, tmp_path):
    for trial in range(5):
        _, south, north = world_of("door", robot, trial, tmp_path).walls
        assert np.linalg.norm(south.points[1] - north.points[0]) == pytest.approx(
            width + 0.1, abs=2e-4
        )


@pytest.mark.parametrize(("course", "widths"), [("corner", 1.3), ("s_bend", 1.4)])
def test_corridors_are_as_wide_as_they_say(course, widths, tmp_path):
    """At its closed end a corridor is its walls' middles apart, less their thickness."""
    (wall,) = world_of(course, "jackal", 3, tmp_path).walls
    end = wall.points[0] - wall.points[-2]
    assert np.linalg.norm(end) - wall.thickness == pytest.approx(widths * 0.43, abs=2e-4)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.sampled_from(["scout", "jackal"]))
def test_the_clutter_leaves_room_to_turn_everywhere(tmp_path_factory, trial, robot):
    world = world_of("clutter", robot, trial, tmp_path_factory.getbasetemp())
    things = [(item.x, item.y, item.radius) for item in world.cylinders]
    things += [(b.pose.x, b.pose.y, hypot(b.size[0], b.size[1]) / 2) for b in world.boxes]
    room = Size.of(ROBOTS[robot].footprint).turning + 0.12
    for n, (x, y, radius) in enumerate(things):
        for a, b, other in things[:n]:
            assert hypot(x - a, y - b) - radius - other >= room - 1e-3


def test_about_half_of_the_clutter_is_missing_on_the_map(tmp_path):
    """Drawn thing by thing, so that a single trial may happen to hide nothing."""
    worlds = [world_of("clutter", "scout", trial, tmp_path) for trial in range(20)]
    things = [item.on_map for world in worlds for item in (*world.cylinders, *world.boxes)]
    assert 0.35 < sum(things) / len(things) < 0.65


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("course", COURSES)
def test_there_is_a_way_through(course, robot, tmp_path):
    for trial in (20, 21):
        world = world_of(course, robot, trial, tmp_path)
        ends = world.start, world.places["goal"]
        length = shortest_path_lengths(world, ROBOTS[robot], ends)(*ends)
        assert length >= world.start.distance_to(world.places["goal"]) - 0.05


@pytest.mark.parametrize(
    ("course", "robot"),
    [
        ("door", "jackal"), ("s_bend", "scout"), ("corner", "jackal"), ("dead_end", "scout"),
        ("clutter", "jackal"),
    ],
)  # fmt: skip
def test_a_robot_of_default_settings_gets_through(course, robot, tmp_path):
    (entry,) = entries_of(Options(tmp_path, names=(course,), robots=(robot,)))
    run = COURSE_BENCH.row(entry, tmp_path)
    assert (run.status, run.cause) == ("success", "")
    assert run.clearance > 0.01
    line = COURSE_BENCH.report([run])[1]
    assert line.split()[:4] == [*run.setup.split(), course, "1/1"]


@pytest.mark.slow
def test_a_corner_is_passed_in_several_motions(tmp_path):
    """The robot used to stand in these trials: it did not finish the motions that it had planned,
    and safety held it before the end of one. 3 cm are free on each side at best."""
    options = Options(tmp_path, 1, range(21), ("corner",), ("jackal",))
    entries = [entries_of(options)[trial] for trial in (8, 11, 20)]
    runs = [COURSE_BENCH.row(entry, tmp_path) for entry in entries]
    assert [(run.status, run.cause) for run in runs] == [("success", "")] * 3
    assert min(run.clearance for run in runs) > 0.01


@pytest.mark.slow
def test_a_robot_that_is_blind_behind_does_not_stay_before_unseen_ground(tmp_path):
    """It stood in these trials: standstill was preferred to a turn that is as slow as allowed."""
    options = Options(tmp_path, 1, range(16), ("door",), ("jackal",))
    entries = [entries_of(options)[trial] for trial in (13, 15)]
    runs = [COURSE_BENCH.row(entry, tmp_path) for entry in entries]
    assert [(run.status, run.cause) for run in runs] == [("success", "")] * 2


def test_results_of_other_worlds_are_not_mixed_in(tmp_path):
    options = Options(tmp_path, 1, range(2), ("door",), ("scout",))
    first, second = entries_of(options)
    assert [entry.case.file for entry in entries_of(options)] == [
        first.case.file, second.case.file,
    ]  # fmt: skip
    first.case.file.write_text(second.case.file.read_text())
    with pytest.raises(
        InputError, match=r"door_0.yaml differs from the generated world.*choose another --out"
    ):
        entries_of(options)


def test_an_unknown_course_is_named(tmp_path):
    with pytest.raises(InputError, match="no course 'dor'; did you mean 'door'"):
        entries_of(Options(tmp_path, names=("dor",), robots=("scout",)))
