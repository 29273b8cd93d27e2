"""The oracle of the benches among people, in worlds whose answer is known by arithmetic."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.sim.worlds.world import Person
from stack.sim.worlds.world_file import read_world
from stack.streams import stream
from stack.types import Pose2D
from tests.benchmarks.benches.shipped import judged_table
from tests.benchmarks.figures import block, write
from tests.benchmarks.figures import read as read_figures
from tests.benchmarks.judged import JudgedRow
from tests.benchmarks.oracle import (
    STEP,
    Ground,
    Task,
    ground_of,
    is_predictable,
    judge,
    search,
    walks,
)
from tests.benchmarks.oracle_picture import draw_verdict, sentence
from tests.missions.bench.test_flats import ROW

SPEED, RADIUS = 0.8, 0.22
CELL = 0.05


def corridor(pocket: bool = False) -> Ground:
    """A corridor of 12 m with a robot's centre line free over 0.6 m; a pocket of 1.2 m at 6 m."""
    free = np.zeros((round(3.0 / CELL), round(12.0 / CELL)), np.bool_)
    free[round(1.0 / CELL) : round(1.6 / CELL), :] = True
    if pocket:
        free[round(1.6 / CELL) : round(2.8 / CELL), round(5.4 / CELL) : round(6.6 / CELL)] = True
    return Ground(free, CELL, (0.0, 0.0), RADIUS)


def oncoming(speed=1.0, begin=11.5, radius=0.3, until=60.0):
    """Yield somebody who walks through the corridor to its end, and stands there."""
    for step in range(round(until / STEP) + 1):
        yield np.array([[max(0.3, begin - speed * step * STEP), 1.3, radius]])


def nobody():
    while True:
        yield np.empty((0, 3))


FAR = Task(Pose2D(1.0, 1.3), (Pose2D(10.0, 1.3),), 0.3, 40.0)


def test_alone_it_arrives_when_the_way_takes_so_long():
    verdict = search(corridor(), FAR, SPEED, nobody())
    assert verdict.possible
    # (9.0 - 0.3 m) / 0.8 m/s = 10.9 s; a cell's diagonal a second is 9 % too fast, never too slow
    assert 0.89 * 10.9 < verdict.time <= 10.9 + STEP


def test_nobody_passes_somebody_who_fills_a_dead_end():
    """0.3 + 0.22 m of radii cover the free 0.6 m; the robot is pushed back to the end wall."""
    verdict = search(corridor(), FAR, SPEED, oncoming())
    assert not verdict.possible and verdict.time is None
    # they meet the robot in the end at 0.3 + 0.3 + 0.22 m: (11.5 - 0.8) / 1.0 = 10.7 s at most
    assert verdict.ended < 11.5
    assert sentence(verdict).startswith("impossible")


def test_a_pocket_lets_the_robot_step_aside():
    """It is there after 4.4 / 0.8 = 5.5 s, they after (11.5 - 6.6) / 0.5 = 9.8 s."""
    verdict = search(corridor(pocket=True), FAR, SPEED, oncoming(speed=0.5))
    assert verdict.possible
    assert verdict.time > 10.9  # it waits in the pocket: later than alone


def test_a_pocket_out_of_reach_does_not_help():
    """The pocket is 4.4 m away: 5.5 s; at 3 m/s they pass it after (11.5 - 6) / 3 = 1.8 s."""
    verdict = search(corridor(pocket=True), FAR, SPEED, oncoming(speed=3.0))
    assert not verdict.possible


def test_who_walks_ahead_faster_is_no_obstacle_and_slower_delays():
    away = (np.array([[2.0 + 1.0 * k * STEP, 1.3, 0.3]]) for k in range(1000))
    free = search(corridor(), FAR, SPEED, away).time
    assert free == search(corridor(), FAR, SPEED, nobody()).time
    slow = (np.array([[2.0 + 0.4 * k * STEP, 1.3, 0.3]]) for k in range(1000))
    verdict = search(corridor(), FAR, SPEED, slow)
    # at the goal's near side, 9.7 m, the robot is 0.4 m or more behind: (9.7 + 0.4 - 2.0) / 0.4 s
    assert verdict.time == pytest.approx(20.3, abs=0.6)


def test_goals_are_visited_in_turn():
    there_and_back = Task(FAR.start, (*FAR.goals, FAR.start), 0.3, 60.0)
    verdict = search(corridor(), there_and_back, SPEED, nobody())
    # 8.7 m there and 8.4 m back
    assert 0.89 * 21.4 < verdict.time <= 21.4 + STEP
    assert not search(corridor(), Task(FAR.start, there_and_back.goals, 0.3, 15.0), SPEED,
                      nobody()).possible  # fmt: skip


bodies = st.lists(
    st.tuples(
        st.floats(0.0, 12.0), st.floats(0.8, 2.4), st.floats(-1.5, 1.5), st.floats(-0.3, 0.3),
        st.floats(0.1, 0.5),
    ),
    max_size=4,
)  # fmt: skip


def moving(many):
    for step in range(120):
        t = step * STEP
        yield np.array([(x + u * t, y + v * t, r) for x, y, u, v, r in many]).reshape(-1, 3)


@settings(max_examples=20, deadline=None)
@given(bodies, bodies)
def test_further_bodies_never_help(some, more):
    task = Task(Pose2D(1.0, 1.3), (Pose2D(6.0, 1.3),), 0.3, 10.0)
    ground = corridor(pocket=True)
    few, many = (search(ground, task, SPEED, moving(group)) for group in (some, some + more))
    assert few.possible or not many.possible
    if many.possible:
        assert few.time <= many.time
        both = many.arrival <= few.ended  # a search ends with its arrival
        assert np.all(few.arrival[both] <= many.arrival[both])


WORLD = """
world: hall
format: 1
start: [1, 2, 0]
bounds: [-0.2, -0.2, 8.2, 4.2]
walls:
  - points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]
people:
  - {name: one, waypoints: [[7, 1], [7, 3]], speed: 1.0, pause: 0.5, yields: false}
"""


def world(text: str = WORLD):
    return read_world(Path("world.yaml"), text)


def test_ways_are_those_of_the_simulation():
    """2 m at 1 m/s, then 0.5 s of rest: after 2.3 s at the far corner, after 3.5 s half back."""
    places = [rows[0] for rows in islice(walks(world(), 0), 40)]
    assert places[0] == pytest.approx([7.0, 1.0, 0.2])
    assert places[10] == pytest.approx([7.0, 2.0, 0.2], abs=0.011)
    assert places[23] == pytest.approx([7.0, 3.0, 0.2], abs=0.011)
    assert places[35] == pytest.approx([7.0, 2.0, 0.2], abs=0.03)


def test_people_who_react_are_not_judged():
    robot = read_robot(find_robot("scout", Path.cwd()))
    task = Task(Pose2D(1.0, 2.0), (Pose2D(5.0, 2.0),), 0.5, 30.0)
    verdict = judge(world(), robot, 0, task)
    assert verdict is not None and verdict.possible
    for change in ("yields: true", "model: social_force"):
        other = world(WORLD.replace("yields: false", change))
        assert not is_predictable(other)
        assert judge(other, robot, 0, task) is None


PASSAGE = """
world: passage
format: 1
start: [1, 0.5, 0]
bounds: [-0.2, -0.2, 14.2, 1.2]
walls:
  - points: [[0, 0], [14, 0], [14, 1], [0, 1], [0, 0]]
"""


@pytest.mark.parametrize(
    ("begin", "passed", "is_judged"),
    [
        (11.5, (-1.8, 0.0), True),  # the robot gets 6 m far until they meet
        (4.0, (-1.8, 0.0), False),  # it may come within 1.5 m of where they appear
        (11.5, (9.0, 9.6), False),  # they are 1 m in front of it at time 0
    ],
)
def test_recorded_people_are_judged_where_the_robot_cannot_delay_them(begin, passed, is_judged):
    """Somebody fills a dead end, of a recording of 60 s of which some have passed at time 0.

    In the simulation a person whose track begins within 1.5 m of the robot appears later.
    """
    share = np.array(passed) / 60.0 % 1.0
    shares = ((seed, stream(seed, "recorded people").random()) for seed in range(1000))
    seed = next(seed for seed, drawn in shares if share[0] <= drawn < (share[1] or 1.0))
    track = np.array([[0.0, begin, 0.5, -1.0, 0.0], [begin - 0.3, 0.3, 0.5, -1.0, 0.0]])
    person = Person(
        "one", track[:, 1:3], model="recorded", track=track, recorded_duration=60.0, radius=0.3
    )
    passage = replace(world(PASSAGE), people=(person,))
    robot = read_robot(find_robot("scout", Path.cwd()))
    task = Task(Pose2D(1.0, 0.5), (Pose2D(13.0, 0.5),), 0.3, 40.0)
    ground = ground_of(passage, robot.footprint.inscribed_radius)
    assert not search(ground, task, SPEED, walks(passage, seed)).possible
    verdict = judge(passage, robot, seed, task)
    assert (verdict is not None) == is_judged


def test_cells_are_lost_only_when_no_point_is_left():
    """Walls at 0 and 8 m: a centre at 0.22 m from them is free for a disc of that radius."""
    ground = ground_of(world(), RADIUS)
    for x, is_free in ((RADIUS + 0.005, True), (RADIUS - 0.1, False)):
        row, column = int(2.2 / ground.resolution), int((x + 0.2) / ground.resolution)
        assert ground.free[row, column] == is_free


def test_the_picture_shows_walls_and_bodies(tmp_path):
    import cv2

    verdict = search(corridor(), FAR, SPEED, oncoming())
    draw_verdict(tmp_path / "oracle" / "a.png", verdict, FAR.goals)
    pixels = cv2.imread(str(tmp_path / "oracle" / "a.png"))
    assert max(pixels.shape) >= 500
    assert (pixels == (190, 60, 160)).all(axis=2).any()


def test_the_table_counts_impossible_runs_among_those_that_were_judged():
    rows = [
        JudgedRow(**asdict(replace(ROW, people=people, seed=seed)), possible=possible)
        for people, seed, possible in (
            ("unaware", 0, True), ("unaware", 1, False), ("unaware", 2, None),
            ("social_force", 0, None),
        )
    ]  # fmt: skip
    rows = {row["people"]: row["impossible"] for row in judged_table(rows)}
    assert rows == {"unaware": "1/2", "social_force": ""}


def test_a_table_has_the_column_once_it_was_measured(tmp_path):
    figures = read_figures("dyna")
    rows = [{k: v for k, v in row.items() if k != "impossible"} for row in figures.rows]
    write(replace(figures, rows=rows), tmp_path)
    assert "nobody could pass" not in block("dyna", tmp_path)
    write(replace(figures, rows=[{**row, "impossible": 3} for row in rows]), tmp_path)
    assert "| nobody could pass |" in block("dyna", tmp_path)
    assert " s | 3 |" in block("dyna", tmp_path)
