"""Random velocities through the safety stage in simulated clutter; the benchmark drives more."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from missions.bench.bench import Options
from robots.simulated import SimulatedBody
from stack.drivetrain.description import LidarDescription
from stack.safety.parameters import SafetyParameters
from stack.sim.worlds.world import Box, Person, World
from stack.streams import stream
from stack.types import Pose2D, Twist
from tests.benchmarks import twists
from tests.benchmarks.clutter import FREE, Room
from tests.benchmarks.layouts import LAYOUTS
from tests.benchmarks.twists import (
    LONGEST,
    ROBOT_NAMES,
    SHORTEST,
    Drive,
    SafetyLoop,
    class_of,
    described,
    drive,
    wishes,
)

BOUNDS = (-4.0, -4.0, 4.0, 4.0)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_no_random_velocity_drives_a_robot_into_anything(name, tmp_path):
    """Room 0 has no people; without the safety stage every robot hits something."""
    run = drive(Drive(name, 0, 12), tmp_path)
    assert run.touch is None
    assert run.driven > 1.5
    assert 0.0 < run.clearance < 0.7


def touch_of(robot, world, wanted, seconds=4.0, **parameters):
    """The first contact of a robot at the origin that wants one velocity; None without one."""
    body = SimulatedBody(robot, world, start=Pose2D(0.0, 0.0), seed=1)
    loop = SafetyLoop(body, robot, SafetyParameters(**parameters))
    try:
        while body.time < seconds and loop.touch is None:
            loop.step(wanted)
    finally:
        body.close()
    return loop.touch


def test_a_contact_is_described_by_who_moved_and_what_was_seen():
    scout = replace(described()["scout"], camera=None, sonars={})
    walker = Person("person 1", np.array([[1.5, 0.0], [-1.5, 0.0]]), 1.0, yields=False)
    touch = touch_of(scout, World("w", BOUNDS, people=(walker,)), Twist())
    assert (touch.cause, touch.obstacle, touch.seen) == ("standing", "person 1", True)
    assert touch.their_speed == pytest.approx(1.0, abs=0.05)
    # from 1.5 m to the radii of 0.22 and 0.2 m at 1 m/s
    assert touch.time == pytest.approx(1.08, abs=0.06)
    world = World("w", BOUNDS, people=(walker,))
    turning = touch_of(scout, world, Twist(angular=1.0), predict_motion=False)
    assert (turning.cause, turning.blind) == ("person", False)
    crate = Box(Pose2D(0.6, 0.0), (0.4, 0.4, 0.6))
    half = replace(scout, lidar=LidarDescription(Pose2D(0.0, 0.0, np.pi), field_of_view=np.pi))
    touch = touch_of(half, World("w", BOUNDS, boxes=(crate,)), Twist(0.5))
    assert (touch.cause, touch.seen, touch.blind) == ("robot", False, True)
    assert touch.speed == pytest.approx(0.15, abs=0.02)  # the blind speed
    assert class_of(asdict(touch)) == "unseen"
    assert class_of({**asdict(touch), "speed": 0.3}) == "robot"
    assert class_of({**asdict(touch), "seen": True}) == "robot"


def test_a_person_who_crosses_meets_a_robot_that_stands():
    """A walker comes from the right at 1 m/s, straight at the way of a robot that wants 0.5 m/s:
    where he is now, he is beside the way; where his velocity takes him, he is on it."""
    scout = replace(described()["scout"], camera=None, sonars={})
    way = np.array([[1.3, -3.0], [1.3, 3.0]])
    walker = Person("person 1", way, 1.0, yields=False)
    world = World("w", BOUNDS, people=(walker,))
    struck = touch_of(scout, world, Twist(0.5), predict_motion=False)
    assert struck.cause in ("robot", "person") and struck.speed > 0.1
    met = touch_of(scout, world, Twist(0.5))
    assert met is None or met.cause == "standing"


def test_wishes_cover_the_whole_range_of_a_drive():
    glide = described()["glide"]
    made = list(wishes(glide, stream(1, "test"), 500))
    speeds = np.array([(t.linear, t.angular, t.lateral) for t, _ in made])
    assert speeds.min(axis=0) == pytest.approx([-0.7, -2.0, -0.7])
    assert speeds.max(axis=0) == pytest.approx([0.7, 2.0, 0.7])
    spins = (speeds[:, 0] == 0.0) & (speeds[:, 2] == 0.0) & (speeds[:, 1] != 0.0)
    assert spins.mean() == pytest.approx(0.2 * 0.2 * 0.8, abs=0.02)
    times = [seconds for _, seconds in made]
    assert min(times) >= SHORTEST and max(times) <= LONGEST
    # the mean of a log-uniform distribution: (b - a) / ln(b / a)
    assert np.mean(times) == pytest.approx(1.8 / np.log(10.0), abs=0.06)


@pytest.mark.parametrize("seed", range(30))
def test_nothing_stands_on_the_robot_at_the_start(seed):
    world = Room(stream(seed, "clutter"), 0.3).world(people=2)
    for cylinder in world.cylinders:
        assert np.hypot(cylinder.x, cylinder.y) > 0.3 + FREE + cylinder.radius
    for box in world.boxes:
        assert box.pose.distance_to(Pose2D(0.0, 0.0)) > 0.3 + FREE
    assert [person.yields for person in world.people] == [True, False]


def test_the_table_is_resumed_and_has_a_row_for_each_robot(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(twists, "TWISTS_PER_WORLD", 1)
    options = Options(tmp_path)
    rows = twists.twist_table(4, options)
    assert [(row["robot"], row["worlds"], row["twists"]) for row in rows] == [
        ("scout", 1, 1), ("jackal", 1, 1), ("glide", 1, 1), ("buggy", 1, 1),
        ("scout, sonars only", 1, 1),
    ]  # fmt: skip
    layout = LAYOUTS["twists"]
    assert layout.columns["drove into"].format_map(rows[0]) == "0"
    assert all(text.format_map(row) for text in layout.columns.values() for row in rows)
    capsys.readouterr()
    assert twists.twist_table(4, options) == rows
    assert "5 of 5 runs are already in" in capsys.readouterr().err
